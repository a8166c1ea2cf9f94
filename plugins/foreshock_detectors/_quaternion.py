"""Orientations as they come in messages: which of them are rotations."""

from __future__ import annotations

import math
from typing import TypeAlias

__all__ = ["Quaternion", "unit"]

Quaternion: TypeAlias = tuple[float, float, float, float]
"""x, y, z, w."""

TOLERANCE = 0.01
"""A quaternion farther off unit length than this is no orientation (1 % already shifts TALOS's CoM by 0.8 mm if it is
not normalised); below, it is normalised."""


def unit(quaternion: Quaternion) -> Quaternion | None:
    """The quaternion at unit length; None if it is no rotation, as one of zeros, which any formula takes for level."""
    x, y, z, w = quaternion
    norm = math.sqrt(x * x + y * y + z * z + w * w)
    if not abs(norm - 1.0) <= TOLERANCE:
        return None
    return x / norm, y / norm, z / norm, w / norm
