"""Closest approach of two bodies at constant velocity."""

from __future__ import annotations

import math

import msgspec

__all__ = ["Encounter", "encounter"]


class Encounter(msgspec.Struct, frozen=True, gc=False):
    """How two bodies meet.

    Attributes:
        gap_m: between both surfaces now; 0 at a touch.
        closing_m_s: how fast the gap shrinks.
        miss_m: gap at closest approach, negative if they would overlap; the gap now if they part.
        time_s: until then; 0 if they part.
    """

    gap_m: float
    closing_m_s: float
    miss_m: float
    time_s: float


def encounter(dx: float, dy: float, vx: float, vy: float, radii_m: float) -> Encounter:
    """Closest approach: t* = -d.v / v.v, miss = |d + v t*| - radii, with d and v of the one relative to the other."""
    range_m = math.hypot(dx, dy)
    along = dx * vx + dy * vy
    closing = -along / range_m if range_m > 1e-9 else 0.0
    gap = max(0.0, range_m - radii_m)
    speed2 = vx * vx + vy * vy
    if along >= 0.0 or speed2 < 1e-9:
        return Encounter(gap, closing, gap, 0.0)
    time_s = -along / speed2
    return Encounter(gap, closing, math.hypot(dx + vx * time_s, dy + vy * time_s) - radii_m, time_s)
