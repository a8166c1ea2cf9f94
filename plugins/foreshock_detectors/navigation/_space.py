"""narrow-shared-space: how much room is left between robot, human and walls?"""

from __future__ import annotations

import math
from collections.abc import Sequence

from foreshock.messages import PlannedPath
from foreshock_detectors.navigation._config import Wall

__all__ = ["path_clearance_m", "path_extent_m", "wall_gap_m"]


def path_clearance_m(
    path: PlannedPath,
    age_s: float,
    x: float,
    y: float,
    discs: Sequence[tuple[float, float, float]],
    radius_m: float,
    lookahead_s: float,
) -> float:
    """Least room between both surfaces where the robot's path leads past the human (m); negative if into him.

    The human is taken as he stands: where he will be in a while is no room yet.
    """
    least = math.inf
    for px, py, at_s in zip(path.x, path.y, path.time_from_start, strict=False):
        t = at_s - age_s
        if t < -0.05:
            continue
        if t > lookahead_s:
            break
        hx, hy = x - px, y - py
        for ox, oy, r in discs:
            clearance = math.hypot(hx + ox, hy + oy) - r
            if clearance < least:
                least = clearance
    return least - radius_m


def path_extent_m(path: PlannedPath, lookahead_s: float) -> float:
    """How far from its beginning the path leads within the lookahead (m): 0 for a robot that means to stand."""
    far, x0, y0 = 0.0, path.x[0], path.y[0]
    for px, py, at_s in zip(path.x, path.y, path.time_from_start, strict=False):
        if at_s <= lookahead_s:
            far = max(far, math.hypot(px - x0, py - y0))
    return far


def wall_gap_m(walls: Sequence[Wall], rx: float, ry: float, hx: float, hy: float, radius_m: float) -> float:
    """From the human's surface to the nearest wall that the robot would press him against (m); infinite if none."""
    least = math.inf
    for ax, ay, bx, by in walls:
        ux, uy = bx - ax, by - ay
        share = ((hx - ax) * ux + (hy - ay) * uy) / (ux * ux + uy * uy)
        share = min(1.0, max(0.0, share))
        wx, wy = ax + share * ux - hx, ay + share * uy - hy
        if wx * (hx - rx) + wy * (hy - ry) > 0.0:
            least = min(least, math.hypot(wx, wy) - radius_m)
    return least
