"""path-overlap: how far apart in time are both at the place where their paths cross?"""

from __future__ import annotations

import math
from collections.abc import Sequence

from foreshock.messages import PlannedPath

__all__ = ["least_gap_s"]


def least_gap_s(
    path: PlannedPath,
    age_s: float,
    x: float,
    y: float,
    vx: float,
    vy: float,
    discs: Sequence[tuple[float, float, float]],
    radius_m: float,
    horizon_s: float,
) -> float:
    """Predicted encroachment time (s): robot at a point of its path at t, human there within the interval [s1, s2].

    The gap is 0 if t lies within the interval, else the distance to it; the least over all points and discs. It is
    infinite if the paths do not cross within the horizon. (Post-encroachment time of Allen, Shin and Cooper, 1978,
    predicted at constant velocity of the human.)

    Args:
        path: the robot's plan.
        age_s: time since its stamp.
        x: the human's middle now (m).
        y: the same.
        vx: the human's velocity (m/s).
        vy: the same.
        discs: parts of the human that count, about the middle.
        radius_m: half breadth of the robot and the margin.
        horizon_s: how far ahead is judged, for both.
    """
    least = math.inf
    speed2 = vx * vx + vy * vy
    for px, py, at_s in zip(path.x, path.y, path.time_from_start, strict=False):
        t = at_s - age_s
        if t < 0.0:
            continue
        if t > horizon_s:
            break
        for ox, oy, r in discs:
            dx, dy = x + ox - px, y + oy - py
            reach = r + radius_m
            apart2 = dx * dx + dy * dy - reach * reach
            if speed2 < 1e-4:  # one who stands is there all the time
                if apart2 <= 0.0:
                    return 0.0
                continue
            b = dx * vx + dy * vy
            root = b * b - speed2 * apart2
            if root < 0.0:
                continue
            root = math.sqrt(root)
            s1, s2 = (-b - root) / speed2, (-b + root) / speed2
            if s2 < 0.0 or s1 > horizon_s:
                continue
            gap = s1 - t if t < s1 else t - s2 if t > s2 else 0.0
            if gap < least:
                least = gap
                if gap == 0.0:
                    return 0.0
    return least
