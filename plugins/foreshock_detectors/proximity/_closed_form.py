"""The independent check of one distance: which feature of each segment is closest is tried out, not solved for.

The closest points of two segments are an end of one and its foot on the other, or the feet of the common perpendicular
of the lines where both lie within; the least of the five candidates is the distance. Scalar, and shares nothing with
the others.
"""

from __future__ import annotations

import math

from foreshock.messages import Vec3

__all__ = ["segment_distance_m"]


def segment_distance_m(a: Vec3, b: Vec3, c: Vec3, d: Vec3) -> float:
    """Distance (m) of the segments a-b and c-d; either may be a point."""
    least = min(_point_m(a, c, d), _point_m(b, c, d), _point_m(c, a, b), _point_m(d, a, b))
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    vx, vy, vz = d[0] - c[0], d[1] - c[1], d[2] - c[2]
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    nn = nx * nx + ny * ny + nz * nz
    if nn == 0.0:
        return least
    wx, wy, wz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    # feet of the common perpendicular by Cramer's rule: w = s u - t v + h n
    s = (wx * (vy * nz - vz * ny) + wy * (vz * nx - vx * nz) + wz * (vx * ny - vy * nx)) / nn
    t = (wx * (uy * nz - uz * ny) + wy * (uz * nx - ux * nz) + wz * (ux * ny - uy * nx)) / nn
    if 0.0 < s < 1.0 and 0.0 < t < 1.0:
        return min(least, abs(wx * nx + wy * ny + wz * nz) / math.sqrt(nn))
    return least


def _point_m(p: Vec3, a: Vec3, b: Vec3) -> float:
    """Distance of a point from the segment a-b."""
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    wx, wy, wz = p[0] - a[0], p[1] - a[1], p[2] - a[2]
    uu = ux * ux + uy * uy + uz * uz
    t = (ux * wx + uy * wy + uz * wz) / uu if uu > 0.0 else 0.0
    t = 0.0 if t < 0.0 else 1.0 if t > 1.0 else t
    return math.hypot(wx - t * ux, wy - t * uy, wz - t * uz)
