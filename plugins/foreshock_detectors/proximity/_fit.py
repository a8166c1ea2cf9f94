"""The smallest capsule found around a set of points.

For an axis through c along the unit vector u, let t = (x - c).u and p the distance of the vertex x from the axis. With
r = max p every vertex is inside when the segment reaches from min(t + s) to max(t - s), s = sqrt(r^2 - p^2). The axis
is searched from the principal directions of the hull's vertices by Nelder and Mead (1965) over two shifts and two
tilts.
"""

from __future__ import annotations

import math
from typing import TypeAlias

import msgspec
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.spatial import ConvexHull, QhullError

from foreshock.messages import Vec3

__all__ = ["FittedCapsule", "Points", "bounding_capsule", "hull_vertices", "outside_m", "quick_capsule"]

Points: TypeAlias = NDArray[np.float64]

PADDING_M = 1e-9
"""Added to each radius, so that rounding leaves no vertex outside; a million times below any measurement here."""


class FittedCapsule(msgspec.Struct, frozen=True):
    """All points within radius (m) of the segment from a to b (m)."""

    a: Vec3
    b: Vec3
    radius: float

    @property
    def volume_m3(self) -> float:
        """Volume: pi r^2 l + 4/3 pi r^3."""
        return _volume(math.dist(self.a, self.b), self.radius)


def hull_vertices(points: Points) -> Points:
    """The vertices of the convex hull, shape (n, 3); flat or too few points are returned as they are."""
    unique = np.unique(points, axis=0)
    if len(unique) < 5:
        return unique
    try:
        return np.asarray(unique[ConvexHull(unique).vertices], dtype=np.float64)
    except QhullError:
        return unique


def quick_capsule(hull: Points) -> FittedCapsule:
    """The smallest of the three capsules along the principal directions, without a search."""
    return _capsule(hull, *_principal(hull))


def bounding_capsule(hull: Points) -> FittedCapsule:
    """The capsule of least volume found around hull vertices of shape (n, 3) in m; deterministic."""
    c0, u0 = _principal(hull)
    side = _across(u0)
    spread = float(np.ptp(hull, axis=0).max())
    if spread == 0.0:
        return _capsule(hull, c0, u0)

    def axis(x: Points) -> tuple[Points, Points]:
        u = u0 + x[2] * side[0] + x[3] * side[1]
        return c0 + (x[0] * side[0] + x[1] * side[1]) * spread, u / math.sqrt(float(u @ u))

    def volume(x: Points) -> float:
        low, high, r = _extent(hull, *axis(x))
        return _volume(high - low, r) / spread**3

    simplex = np.vstack([np.zeros(4), np.diag([0.1, 0.1, 0.15, 0.15])])
    options = {"maxiter": 400, "xatol": 1e-5, "fatol": 1e-6, "initial_simplex": simplex}
    best = minimize(volume, np.zeros(4), method="Nelder-Mead", options=options)
    return _capsule(hull, *axis(best.x))


def outside_m(capsule: FittedCapsule, points: Points) -> float:
    """By how much the farthest of the points lies outside of the capsule (m); not above 0 if all are inside."""
    a, b = np.array(capsule.a), np.array(capsule.b)
    d = b - a
    length2 = float(d @ d)
    t = np.clip((points - a) @ d / length2, 0.0, 1.0) if length2 > 0.0 else np.zeros(len(points))
    return float(np.linalg.norm(points - a - np.outer(t, d), axis=1).max()) - capsule.radius


def _capsule(hull: Points, c: Points, u: Points) -> FittedCapsule:
    low, high, r = _extent(hull, c, u)
    a, b = (c + low * u).tolist(), (c + high * u).tolist()
    return FittedCapsule((a[0], a[1], a[2]), (b[0], b[1], b[2]), r + PADDING_M)


def _extent(hull: Points, c: Points, u: Points) -> tuple[float, float, float]:
    """Ends of the segment along the axis and the radius; see the module."""
    w = hull - c
    t = w @ u
    p2 = np.maximum((w * w).sum(axis=1) - t * t, 0.0)
    r2 = float(p2.max())
    s = np.sqrt(r2 - p2)
    low, high = float((t + s).min()), float((t - s).max())
    if high < low:  # a ball suffices
        low = high = (low + high) / 2.0
    return low, high, math.sqrt(r2)


def _principal(hull: Points) -> tuple[Points, Points]:
    """Centre and direction of the best axis along a principal direction, centred on the mid-range across it."""
    mean = hull.mean(axis=0)
    candidates: list[tuple[float, int, Points, Points]] = []
    centred = hull - mean
    for u in np.linalg.eigh(centred.T @ centred)[1].T[::-1]:
        side = _across(u)
        shift = centred @ side.T
        c = mean + (shift.max(axis=0) + shift.min(axis=0)) / 2.0 @ side
        low, high, r = _extent(hull, c, u)
        candidates.append((_volume(high - low, r), len(candidates), c, u))
    _, _, c, u = min(candidates)
    return c, u


def _across(u: Points) -> Points:
    """Two unit vectors across u and each other, as rows."""
    first = np.cross(u, np.eye(3)[int(np.argmin(np.abs(u)))])
    first /= math.sqrt(float(first @ first))
    return np.vstack([first, np.cross(u, first)])


def _volume(length: float, radius: float) -> float:
    return math.pi * radius * radius * (length + 4.0 / 3.0 * radius)
