"""The robot's capsules and one person's, as coal sees them: finds the closest pair.

coal goes through all pairs in C++: 280 in 13 us, a hundredth of what a Python loop over python-fcl takes. The person
stands still in his own frame, so that his capsules are written once per measurement; it is the robot's base that moves.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import coal
import numpy as np
import pinocchio as pin

from foreshock.messages import Vec3
from foreshock_detectors.proximity._kinematics import Array, CapsuleKinematics
from foreshock_detectors.proximity._people import Person
from foreshock_detectors.proximity._robot import Robot

__all__ = ["ClosestPair", "Scene"]

_UP = np.array([0.0, 0.0, 1.0])


class ClosestPair(NamedTuple):
    """Index of the robot's capsule and of the person's, and the closest point on the person's, from his centre (m)."""

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
        self._model = robot.model
        self._data: Any = robot.model.createData()
        self._geometry: Any = pin.GeometryModel()
        self._q: Array = robot.reference.copy()
        n, k = len(robot.capsules), len(person.radius)
        self._k = k
        for i, c in enumerate(robot.capsules):
            placement, half = _placement(np.array((c.a, c.b)))
            joint = robot.model.getJointId(c.joint)
            shape = coal.Capsule(c.radius, 2.0 * half)
            self._geometry.addGeometryObject(pin.GeometryObject(f"robot {i}", joint, placement, shape))
        for j in range(k):
            shape = coal.Capsule(1.0, 1.0)
            self._geometry.addGeometryObject(pin.GeometryObject(f"human {j}", 0, pin.SE3.Identity(), shape))
        for i in range(n):
            for j in range(k):
                self._geometry.addCollisionPair(pin.CollisionPair(i, n + j))
        objects = list(self._geometry.geometryObjects)
        self._humans = objects[n:]
        self._shapes = [o.geometry for o in objects]
        self._radius: Array | None = None
        self._stamp_ns = -1
        self.measure(person)
        self._found: Any = pin.GeometryData(self._geometry)

    def fits(self, person: Person) -> bool:
        """Whether he has as many capsules as the scene."""
        return len(person.radius) == self._k

    def measure(self, person: Person) -> None:
        """Take his newest measurement."""
        if person.stamp_ns == self._stamp_ns:
            return
        self._stamp_ns = person.stamp_ns
        shapes = self._shapes[-self._k :]
        rows = zip(shapes, self._humans, person.ends, person.radius.tolist(), strict=True)
        for shape, placed, ends, radius in rows:
            placed.placement, shape.halfLength = _placement(ends)
            shape.radius = radius

    def closest(self, body: CapsuleKinematics, centre: Vec3) -> ClosestPair:
        """The closest pair.

        Args:
            body: the robot at this instant.
            centre: of the person at this instant, from the robot's base (m).
        """
        if body.radius is not self._radius:
            self._radius = body.radius
            for shape, radius in zip(self._shapes, body.radius.tolist(), strict=False):
                shape.radius = radius
        q = self._q
        q[:] = body.q
        q[:3] = (-centre[0], -centre[1], -centre[2])
        pin.forwardKinematics(self._model, self._data, q)
        pin.updateGeometryPlacements(self._model, self._data, self._geometry, self._found)
        index = pin.computeDistances(self._geometry, self._found)
        i, j = divmod(index, self._k)
        return ClosestPair(i, j, self._found.distanceResults[index].getNearestPoint2())


def _placement(ends: Array) -> tuple[Any, float]:
    """Where coal's capsule, centred along its z axis, lies, and half its length, for the ends of shape (2, 3)."""
    along = ends[1] - ends[0]
    length = float(np.sqrt(along @ along))
    turn = pin.Quaternion.FromTwoVectors(_UP, along).matrix() if length > 0.0 else np.eye(3)
    return pin.SE3(turn, (ends[0] + ends[1]) / 2.0), length / 2.0
