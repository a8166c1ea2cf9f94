"""Does a tool point where it must not while a human is within its reach?"""

from __future__ import annotations

import math
from collections.abc import Iterable

from foreshock.messages import HumanPose, Odometry, Vec3
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


def nearest(human: HumanPose, tip: Vec3) -> tuple[float, Vec3] | None:
    """Distance (m) to a human's surface, less its uncertainty, and the vector to the nearest capsule's axis.

    None if the human has no capsules.
    """
    x, y, z = tip
    least, vector, sqrt = math.inf, (0.0, 0.0, 0.0), math.sqrt
    for capsule in human.capsules:
        ax, ay, az = capsule.a
        bx, by, bz = capsule.b
        dx, dy, dz = bx - ax, by - ay, bz - az
        px, py, pz = ax - x, ay - y, az - z
        length = dx * dx + dy * dy + dz * dz
        s = -(px * dx + py * dy + pz * dz)
        if s >= length:
            px, py, pz = bx - x, by - y, bz - z
        elif s > 0.0:
            s /= length
            px, py, pz = px + s * dx, py + s * dy, pz + s * dz
        distance = sqrt(px * px + py * py + pz * pz) - capsule.radius - human.uncertainty
        if distance < least:
            least, vector = distance, (px, py, pz)
    return None if least == math.inf else (least, vector)


def _angle(a: Vec3, b: Vec3) -> float:
    """Angle between two vectors (rad); 0 if one has no length."""
    cross = math.hypot(a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])
    return math.atan2(cross, a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


def unsafe(
    config: ToolConfig, pose: Odometry, command: Odometry, humans: Iterable[HumanPose]
) -> tuple[float, dict[str, float]] | None:
    """How unsafe the orientation is (1 is the limit), and its parts.

    With d the deviation of the axis from its command and b its angle to a human's nearest place, both rad:

        max(d / (cone + follow |omega_commanded|), line / b)    the largest over the humans within reach; 0 without one

    The parts are those of that human, or of the nearest if nobody is within reach. None if an orientation is no
    rotation, or if somebody has no capsules, and so no place, and nobody else makes it unsafe.
    """
    is_at, should = axis(pose.orientation), axis(command.orientation)
    if is_at is None or should is None:
        return None
    deviation = _angle(is_at, should)
    wx, wy, wz = command.angular
    cone = config.cone_rad + config.follow_s * math.sqrt(wx * wx + wy * wy + wz * wz)
    worst, least, placed = -1.0, math.inf, True
    measures = {"deviation_rad": deviation}
    for human in humans:
        found = nearest(human, pose.position)
        if found is None:
            placed = False
            continue
        distance, vector = found
        bearing = _angle(is_at, vector)
        within = distance <= config.reach_m
        value = max(deviation / cone, config.line_rad / max(bearing, LEAST_RAD)) if within else 0.0
        if value > worst or (value == worst and distance < least):
            worst, least = value, distance
            measures = {"deviation_rad": deviation, "bearing_rad": bearing, "distance_m": distance}
    if not placed and worst < 1.0:
        return None
    return max(worst, 0.0), measures
