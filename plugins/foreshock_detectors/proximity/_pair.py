"""The distance that is reported: python-fcl on one pair of capsules, checked by the closed form."""

from __future__ import annotations

import math
import struct
from typing import Any, NamedTuple

import fcl
import numpy as np

from foreshock.messages import Vec3
from foreshock_detectors.proximity._closed_form import segment_distance_m

__all__ = ["Gauge", "PlacedCapsule", "checked_distance_m"]


class PlacedCapsule(NamedTuple):
    """All points within radius (m) of the segment from a to b (m)."""

    a: Vec3
    b: Vec3
    radius: float


# capsule against capsule, this is exact and negative in overlap; with signed distances enabled it errs by up to 14 mm
_REQUEST = fcl.DistanceRequest(enable_signed_distance=False)

_pack = struct.Struct("7d").pack_into  # numpy takes three times as long to convert a tuple


class Gauge:
    """Two capsules of python-fcl that are moved about: to make a Transform takes longer than to measure a distance."""

    def __init__(self) -> None:
        self._robot, self._human = _Shape(), _Shape()

    def distance_m(self, robot: PlacedCapsule, human: PlacedCapsule) -> float:
        """Distance between the surfaces (m), negative in overlap."""
        # a result must not be used twice: distance() leaves it alone once it holds a smaller one
        result = fcl.DistanceResult()
        found: float = fcl.distance(self._robot.moved(robot), self._human.moved(human), _REQUEST, result)
        return found


def checked_distance_m(
    robot: PlacedCapsule, human: PlacedCapsule, tolerance_m: float, gauge: Gauge | None = None
) -> float:
    """Distance between the surfaces (m), negative in overlap.

    Args:
        robot: one capsule.
        human: the other.
        tolerance_m: by how much python-fcl and the closed form may differ.
        gauge: the caller's, which measures; a new one without.

    Raises:
        ValueError: the two differ by more, or one is not a number.
    """
    found = (gauge or Gauge()).distance_m(robot, human)
    expected = segment_distance_m(robot.a, robot.b, human.a, human.b) - robot.radius - human.radius
    if not abs(found - expected) <= tolerance_m:
        raise ValueError(
            f"python-fcl finds {found:.6f} m between robot and human, the closed form {expected:.6f} m; "
            f"they may differ by {tolerance_m:g} m"
        )
    return found


class _Shape:
    """A capsule for fcl, where it lies along z and is centred: z is turned to the segment, either way round."""

    def __init__(self) -> None:
        self._capsule = fcl.Capsule(1.0, 1.0)
        self._object = fcl.CollisionObject(self._capsule, fcl.Transform())
        pose = np.zeros(7)
        self._memory, self._turn, self._centre = pose.data, pose[:4], pose[4:]

    def moved(self, capsule: PlacedCapsule) -> Any:
        """The object of fcl, as and where this capsule is."""
        (ax, ay, az), (bx, by, bz), radius = capsule
        dx, dy, dz = bx - ax, by - ay, bz - az
        length = math.sqrt(dx * dx + dy * dy + dz * dz)
        if dz < 0.0:
            dx, dy, dz = -dx, -dy, -dz
        w, x, y = (length + dz, -dy, dx) if length > 0.0 else (1.0, 0.0, 0.0)
        norm = math.sqrt(w * w + x * x + y * y)
        self._capsule.radius, self._capsule.lz = radius, length
        _pack(self._memory, 0, w / norm, x / norm, y / norm, 0.0, 0.5 * (ax + bx), 0.5 * (ay + by), 0.5 * (az + bz))
        self._object.setQuatRotation(self._turn)
        self._object.setTranslation(self._centre)
        return self._object
