"""Convex polygons in the ground plane, in scalar Python: for eight corners that is faster than numpy, scipy or shapely.

A point is (x, y) in m; a polygon is a list of corners, counterclockwise, without repetition.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TypeAlias

__all__ = ["Point", "Polygon", "convex_hull", "nearest_boundary_point", "signed_margin"]

Point: TypeAlias = tuple[float, float]
Polygon: TypeAlias = Sequence[Point]


def convex_hull(points: Iterable[Point]) -> list[Point]:
    """Corners of the convex hull, counterclockwise (Andrew's monotone chain, 1979).

    Points on an edge are left out. Fewer than three corners come back where all points lie on one line.
    """
    ordered = sorted(set(points))
    if len(ordered) < 3:
        return ordered
    lower = _chain(ordered)
    ordered.reverse()
    upper = _chain(ordered)
    del lower[-1], upper[-1]
    return lower + upper


def _chain(points: Iterable[Point]) -> list[Point]:
    chain: list[Point] = []
    ax = ay = bx = by = 0.0  # the last corner but one, and the last
    for point in points:
        x, y = point
        n = len(chain)
        while n > 1 and (bx - ax) * (y - ay) <= (by - ay) * (x - ax):
            chain.pop()
            n -= 1
            bx, by = ax, ay
            if n > 1:
                ax, ay = chain[n - 2]
        chain.append(point)
        ax, ay, bx, by = bx, by, x, y
    return chain


def signed_margin(polygon: Polygon, x: float, y: float) -> float:
    """Distance (m) of a point to the boundary, positive inside, negative outside.

    Outside it is the Euclidean distance: the distance to the nearest edge's line would understate it beyond a corner.
    A polygon of one or two corners has no inside. Raises ValueError for an empty one.
    """
    least = math.inf
    ax, ay = polygon[-1] if polygon else _empty()
    for bx, by in polygon:
        ex, ey = bx - ax, by - ay
        length = math.sqrt(ex * ex + ey * ey)
        if length > 0.0:
            distance = (ex * (y - ay) - ey * (x - ax)) / length
            if distance < least:
                least = distance
        ax, ay = bx, by
    if least >= 0.0 and len(polygon) > 2:
        return least
    px, py = nearest_boundary_point(polygon, x, y)
    return -math.hypot(x - px, y - py)


def nearest_boundary_point(polygon: Polygon, x: float, y: float) -> Point:
    """The point of the boundary that is nearest to (x, y). Raises ValueError for an empty polygon."""
    best = math.inf
    nearest = ax, ay = polygon[-1] if polygon else _empty()
    for bx, by in polygon:
        ex, ey = bx - ax, by - ay
        square = ex * ex + ey * ey
        t = ((x - ax) * ex + (y - ay) * ey) / square if square > 0.0 else 0.0
        if not t > 0.0:
            t = 0.0
        elif t > 1.0:
            t = 1.0
        px, py = ax + t * ex, ay + t * ey
        d = (x - px) * (x - px) + (y - py) * (y - py)
        if d < best:
            best, nearest = d, (px, py)
        ax, ay = bx, by
    return nearest


def _empty() -> Point:
    raise ValueError("a polygon without corners has no boundary")
