"""Does a tool point where it must not while a human is within its reach?"""

from __future__ import annotations

import math
from collections.abc import Iterable

from foreshock.messages import Capsule, HumanPose, Odometry, Vec3
from foreshock_detectors.tool._config import ToolConfig

__all__ = ["axis", "nearest", "unsafe"]

LEAST_RAD = 0.01
"""A tool that points straight at somebody is unsafe by 15 degrees over this."""


def axis(q: tuple[float, float, float, float]) -> Vec3 | None:
    """The x axis of a frame with orientation q (x, y, z, w); None if q is no rotation."""
    x, y, z, w = q
    norm = x * x + y * y + z * z + w * w
    if not 0.25 < norm < 4.0:
        return None
    s = 2.0 / norm
    return (1.0 - s * (y * y + z * z), s * (x * y + w * z), s * (x * z - w * y))


def _on(c: Capsule, p: Vec3) -> tuple[float, Vec3]:
    """Distance (m) of a point from a capsule's surface, and the vector from it to the capsule's axis."""
    a, b = c.a, c.b
    dx, dy, dz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    px, py, pz = a[0] - p[0], a[1] - p[1], a[2] - p[2]
    length = dx * dx + dy * dy + dz * dz
    if length > 0.0:
        s = -(px * dx + py * dy + pz * dz) / length
        s = 0.0 if s < 0.0 else 1.0 if s > 1.0 else s
        px, py, pz = px + s * dx, py + s * dy, pz + s * dz
    return math.sqrt(px * px + py * py + pz * pz) - c.radius, (px, py, pz)


def nearest(humans: Iterable[HumanPose], tip: Vec3) -> tuple[float, Vec3] | None:
    """Distance (m) to the nearest human's surface, less its uncertainty, and the vector to that place."""
    best: tuple[float, Vec3] | None = None
    for human in humans:
        for capsule in human.capsules:
            distance, vector = _on(capsule, tip)
            distance -= human.uncertainty
            if best is None or distance < best[0]:
                best = (distance, vector)
    return best


def _angle(a: Vec3, b: Vec3) -> float:
    """Angle between two vectors (rad); 0 if one has no length."""
    cross = math.hypot(a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])
    return math.atan2(cross, a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


def unsafe(
    config: ToolConfig, pose: Odometry, command: Odometry, humans: Iterable[HumanPose]
) -> tuple[float, dict[str, float]] | None:
    """How unsafe the orientation is (1 is the limit), and its parts; None if an orientation is no rotation.

    With d the deviation of the axis from its command and b its angle to the nearest human's nearest place, both rad:

        max(d / (cone + follow |omega_commanded|), line / b)    if that human is within reach,    else 0
    """
    is_at, should = axis(pose.orientation), axis(command.orientation)
    if is_at is None or should is None:
        return None
    deviation = _angle(is_at, should)
    found = nearest(humans, pose.position)
    if found is None:
        return 0.0, {"deviation_rad": deviation}
    distance, vector = found
    bearing = _angle(is_at, vector)
    measures = {"deviation_rad": deviation, "bearing_rad": bearing, "distance_m": distance}
    if distance > config.reach_m:
        return 0.0, measures
    wx, wy, wz = command.angular
    cone = config.cone_rad + config.follow_s * math.sqrt(wx * wx + wy * wy + wz * wz)
    return max(deviation / cone, config.line_rad / max(bearing, LEAST_RAD)), measures
