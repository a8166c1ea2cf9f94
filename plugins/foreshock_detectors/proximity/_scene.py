"""The robot's capsules and one person's, as coal sees them: finds the closest pair.

coal goes through all pairs in C++: 280 in 13 us, a hundredth of what a Python loop over python-fcl takes. Placements
are written to its memory as arrays; positions are relative to the robot's base.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import coal
import numpy as np
import pinocchio as pin

from foreshock.messages import Vec3
from foreshock_detectors.proximity._axes import Array, capsule_placements
from foreshock_detectors.proximity._bulk import ShapeArrays
from foreshock_detectors.proximity._kinematics import CapsuleKinematics
from foreshock_detectors.proximity._people import Person
from foreshock_detectors.proximity._robot import Robot

__all__ = ["ClosestPair", "Scene"]


class ClosestPair(NamedTuple):
    """Index of the robot's capsule and of the person's, and the closest point on the person's, from the base (m)."""

    robot: int
    human: int
    point: Array


class Scene:
    """Kept for one track; follows its measurements.

    Args:
        robot: its capsules.
        person: first measurement.
    """

    def __init__(self, robot: Robot, person: Person) -> None:
        geometry: Any = pin.GeometryModel()
        n, k = len(robot.capsules), len(person.radius)
        self._k = k
        _, half = capsule_placements(np.array([(c.a, c.b) for c in robot.capsules]))
        for i, c in enumerate(robot.capsules):
            shape = coal.Capsule(c.radius, 2.0 * half.item(i))
            geometry.addGeometryObject(pin.GeometryObject(f"robot {i}", 0, pin.SE3.Identity(), shape))
        for j in range(k):
            shape = coal.Capsule(1.0, 1.0)
            geometry.addGeometryObject(pin.GeometryObject(f"human {j}", 0, pin.SE3.Identity(), shape))
        for i in range(n):
            for j in range(k):
                geometry.addCollisionPair(pin.CollisionPair(i, n + j))
        self._geometry = geometry
        shapes = [o.geometry for o in geometry.geometryObjects]
        self._robot_shapes, self._human_shapes = shapes[:n], shapes[n:]
        self._radius: Array | None = None
        self._middle: Array = np.zeros((k, 3))
        self._stamp_ns = -1
        found = ShapeArrays(geometry)
        self._data, self._places, self._humans = found.data, found.placements[:n], found.placements[n:]
        self._middles = self._humans[:, 3]
        self.measure(person)

    def fits(self, person: Person) -> bool:
        """Whether he has as many capsules as the scene."""
        return len(person.radius) == self._k

    def measure(self, person: Person) -> None:
        """Take his newest measurement."""
        if person.stamp_ns == self._stamp_ns:
            return
        self._stamp_ns = person.stamp_ns
        places, half = capsule_placements(person.ends)
        self._middle = places[:, 3].copy()
        self._humans[:, :3] = places[:, :3]
        rows = zip(self._human_shapes, half.tolist(), person.radius.tolist(), strict=True)
        for shape, length, radius in rows:
            shape.halfLength, shape.radius = length, radius

    def closest(self, body: CapsuleKinematics, centre: Vec3 | Array) -> ClosestPair:
        """The closest pair.

        Args:
            body: the robot at this instant.
            centre: of the person at this instant, from the robot's base (m).
        """
        if body.radius is not self._radius:
            self._radius = body.radius
            for shape, radius in zip(self._robot_shapes, body.radius.tolist(), strict=True):
                shape.radius = radius
        self._places[:] = body.placements
        np.add(self._middle, centre, out=self._middles)
        index = pin.computeDistances(self._geometry, self._data)
        i, j = divmod(index, self._k)
        return ClosestPair(i, j, self._data.distanceResults[index].getNearestPoint2())
