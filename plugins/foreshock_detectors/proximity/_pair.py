"""The distance that is reported: python-fcl on one pair of capsules, checked by the closed form."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import fcl

from foreshock.messages import Vec3
from foreshock_detectors.proximity._closed_form import segment_distance_m

__all__ = ["PlacedCapsule", "checked_distance_m"]


class PlacedCapsule(NamedTuple):
    """All points within radius (m) of the segment from a to b (m)."""

    a: Vec3
    b: Vec3
    radius: float


# capsule against capsule, this is exact and negative in overlap; with signed distances enabled it errs by up to 14 mm
_REQUEST = fcl.DistanceRequest(enable_signed_distance=False)


def checked_distance_m(robot: PlacedCapsule, human: PlacedCapsule, tolerance_m: float) -> float:
    """Distance between the surfaces (m), negative in overlap.

    Raises:
        ValueError: python-fcl and the closed form differ by more than the tolerance, or one is not a number.
    """
    # a result must not be used twice: distance() leaves it alone once it holds a smaller one
    found: float = fcl.distance(_object(robot), _object(human), _REQUEST, fcl.DistanceResult())
    expected = segment_distance_m(robot.a, robot.b, human.a, human.b) - robot.radius - human.radius
    if not abs(found - expected) <= tolerance_m:
        raise ValueError(
            f"python-fcl finds {found:.6f} m between robot and human, the closed form {expected:.6f} m; "
            f"they may differ by {tolerance_m:g} m"
        )
    return found


def _object(capsule: PlacedCapsule) -> Any:
    """The capsule for fcl, where it lies along z and is centred: z is turned to the segment, either way round."""
    (ax, ay, az), (bx, by, bz), radius = capsule
    dx, dy, dz = bx - ax, by - ay, bz - az
    length = math.sqrt(dx * dx + dy * dy + dz * dz)
    if dz < 0.0:
        dx, dy, dz = -dx, -dy, -dz
    w, x, y = (length + dz, -dy, dx) if length > 0.0 else (1.0, 0.0, 0.0)
    norm = math.sqrt(w * w + x * x + y * y)
    turn = (w / norm, x / norm, y / norm, 0.0)
    centre = (0.5 * (ax + bx), 0.5 * (ay + by), 0.5 * (az + bz))
    return fcl.CollisionObject(fcl.Capsule(radius, length), fcl.Transform(turn, centre))
