"""Where bodies are and how they move, in plan view."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TypeAlias

from foreshock.messages import Capsule, HumanPose, Odometry
from foreshock_detectors._quaternion import unit

__all__ = ["Disc", "Mover", "discs", "place"]

Disc: TypeAlias = tuple[float, float, float]
"""x, y from the human's middle, radius (m)."""


def place(message: Odometry) -> tuple[float, float, float, float]:
    """x, y (m) and the velocity in the odometry's own frame (m/s); its twist is in the child frame.

    Raises:
        ValueError: the orientation is no rotation.
    """
    orientation = unit(message.orientation)
    if orientation is None:
        raise ValueError(f"odometry: orientation {list(message.orientation)} is no rotation; expected unit length")
    qx, qy, qz, qw = orientation
    vx, vy, vz = message.linear
    x, y, _ = message.position
    return (
        x,
        y,
        (1.0 - 2.0 * (qy * qy + qz * qz)) * vx + 2.0 * (qx * qy - qz * qw) * vy + 2.0 * (qx * qz + qy * qw) * vz,
        2.0 * (qx * qy + qz * qw) * vx + (1.0 - 2.0 * (qx * qx + qz * qz)) * vy + 2.0 * (qy * qz - qx * qw) * vz,
    )


def _shadow(capsule: Capsule) -> Disc:
    """The disc about a capsule's plan view; of an upright one it is exact."""
    a, b = capsule.a, capsule.b
    half = 0.5 * math.hypot(b[0] - a[0], b[1] - a[1])
    return 0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1]), capsule.radius + half


def discs(pose: HumanPose, regions: Sequence[str]) -> tuple[float, float, float, tuple[Disc, ...]]:
    """Middle x, y and radius of the disc about what counts of a human, and the discs that count, about the middle.

    Raises:
        ValueError: there are no capsules.
    """
    if not pose.capsules:
        raise ValueError(f"humans/pose: human {pose.id!r} has no capsules; expected at least one")
    shadows = [_shadow(c) for c in pose.capsules if not regions or c.region in regions]
    if not shadows:
        shadows = [_shadow(c) for c in pose.capsules]
    x = sum([s[0] for s in shadows]) / len(shadows)
    y = sum([s[1] for s in shadows]) / len(shadows)
    radius = max([math.hypot(sx - x, sy - y) + r for sx, sy, r in shadows])
    if not regions:
        return x, y, radius, ((0.0, 0.0, radius),)
    return x, y, radius, tuple([(sx - x, sy - y, r) for sx, sy, r in shadows])


class Mover:
    """Filtered position and velocity of a body.

    The velocity is the measured one through a first-order filter that starts at its first value, and so known at once;
    where none is measured, that of the positions, which is known after two time constants. A measurement of little
    weight moves both only a little off the prediction.
    """

    __slots__ = ("_known_ns", "_time_ns", "stamp_ns", "vx", "vy", "x", "y")

    def __init__(self, time_s: float) -> None:
        self._time_ns = time_s * 1e9
        self.stamp_ns = self._known_ns = -1
        self.x = self.y = self.vx = self.vy = 0.0

    def push(
        self, stamp_ns: int, x: float, y: float, velocity: tuple[float, float] | None, weight: float = 1.0
    ) -> None:
        """Take a newer measurement of weight 0 < w <= 1; one after a long silence begins anew."""
        dt = stamp_ns - self.stamp_ns
        if self.stamp_ns >= 0 and dt <= 0:
            return
        if self.stamp_ns < 0 or dt > 10.0 * self._time_ns or (velocity is not None and not self.known()):
            self._known_ns = stamp_ns + (0 if velocity is not None else round(2.0 * self._time_ns))
            self.vx, self.vy = velocity or (0.0, 0.0)
            self.x, self.y = x, y
        else:
            vx, vy = velocity or ((x - self.x) / dt * 1e9, (y - self.y) / dt * 1e9)
            gain = weight * (1.0 - math.exp(-min(dt / self._time_ns, 0.5)))  # one value after a gap is still one value
            guess_x, guess_y = self.at(stamp_ns)
            self.vx += gain * (vx - self.vx)
            self.vy += gain * (vy - self.vy)
            self.x, self.y = guess_x + weight * (x - guess_x), guess_y + weight * (y - guess_y)
        self.stamp_ns = stamp_ns

    def known(self) -> bool:
        """Whether the velocity has been measured or has settled."""
        return 0 <= self._known_ns <= self.stamp_ns

    def at(self, now_ns: int) -> tuple[float, float]:
        """Position at now_ns by constant velocity (m)."""
        dt = (now_ns - self.stamp_ns) * 1e-9
        return self.x + self.vx * dt, self.y + self.vy * dt
