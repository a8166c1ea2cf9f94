"""All pairs of n robot and m human capsules at once: how far apart, and how fast the robot's side approaches.

For segments p1 + s d1 and p2 + t d2 with s, t in [0, 1] and r = p1 - p2 (Ericson, Real-Time Collision Detection,
5.1.9):

    s = clamp((d1.d2 d2.r - d1.r d2.d2) / (d1.d1 d2.d2 - (d1.d2)^2)),  0 for parallel ones
    t = clamp((s d1.d2 + d2.r) / d2.d2),  then  s = clamp((t d1.d2 - d1.r) / d1.d1)

Taking s anew for the clamped t covers all of Ericson's cases without a branch. Every scalar product comes from one
matrix product, and every step is one array operation into memory kept for the purpose. Rounding: some 1e-8 m near
contact.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

__all__ = ["Array", "PairDistances"]

Array: TypeAlias = NDArray[np.float64]

_TINY_M4 = 1e-14
"""Below this (d1.d1)(d2.d2) sin^2 counts as parallel; a clamped s is then refined by the projections that follow."""
_TINY_M2 = 1e-30
"""Squared length that stands for the segment of a ball; its numerators are exactly 0."""


class PairDistances:
    """Gaps and directed speeds of all n x m pairs.

    Attributes:
        gap: distance between surfaces, shape (n, m), m; negative in overlap.
        speed: speed of the robot's closest point towards the human's, shape (n, m), m/s.
    """

    def __init__(self, n: int, m: int) -> None:
        self._n, self._m = n, m
        self._left, self._right = np.zeros((4 * n, 3)), np.zeros((3, 2 * m))
        self._dots = np.zeros((4 * n, 2 * m))
        self._s, self._t, self._w, self._x, self._c, self._f = (np.zeros((n, m)) for _ in range(6))
        self.gap, self.speed = np.zeros((n, m)), np.zeros((n, m))

    def evaluate(self, robot: tuple[Array, Array, Array, Array, Array], human: tuple[Array, Array, Array]) -> None:
        """Fill gap and speed.

        Args:
            robot: start, along, velocity of the start, spin (each (n, 3)), radius (n,).
            human: start, along (each (m, 3)), radius (m,).
        """
        n, m = self._n, self._m
        p1, d1, v1, w1, r1 = robot
        p2, d2, r2 = human
        left, right, dots = self._left, self._right, self._dots
        left[:n], left[n : 2 * n], left[2 * n : 3 * n], left[3 * n :] = p1, d1, v1, w1
        right[:, :m], right[:, m:] = p2.T, d2.T
        np.matmul(left, right, dots)
        a = np.einsum("ij,ij->i", d1, d1)[:, None]
        e = np.einsum("ij,ij->i", d2, d2)
        b = dots[n : 2 * n, m:]
        own = np.einsum("ij,ij->i", d1, p1)[:, None]
        c = np.subtract(own, dots[n : 2 * n, :m], self._c)
        f = np.subtract(dots[:n, m:], np.einsum("ij,ij->i", d2, p2), self._f)
        self._closest(a, b, c, e, f)
        s, t, w, x, gap = self._s, self._t, self._w, self._x, self.gap
        # |r + s d1 - t d2|^2 = r.r + s (s a + 2 c - 2 t b) + t (t e - 2 f)
        np.multiply(s, a, w)
        w += c
        w += c
        np.multiply(t, b, x)
        w -= x
        w -= x
        w *= s
        np.multiply(t, e, x)
        x -= f
        x -= f
        x *= t
        w += x
        np.multiply(dots[:n, :m], -2.0, x)
        w += x
        w += np.einsum("ij,ij->i", p1, p1)[:, None] + np.einsum("ij,ij->i", p2, p2)
        np.sqrt(np.maximum(w, _TINY_M2, w), w)
        np.subtract(w, r1[:, None], gap)
        gap -= r2
        self._directed(p1, d1, v1, w1)

    def _closest(self, a: Array, b: Array, c: Array, e: Array, f: Array) -> None:
        s, t, w = self._s, self._t, self._w
        np.multiply(b, f, s)
        np.multiply(c, e, w)
        s -= w
        np.multiply(b, b, w)
        np.subtract(a * e, w, w)
        np.maximum(w, _TINY_M4, w)
        s /= w
        _clamp(s)
        np.multiply(s, b, t)
        t += f
        t /= np.maximum(e, _TINY_M2)
        _clamp(t)
        np.multiply(t, b, s)
        s -= c
        s /= np.maximum(a, _TINY_M2)
        _clamp(s)

    def _directed(self, p1: Array, d1: Array, v1: Array, w1: Array) -> None:
        """(v + s w).(p2 + t d2 - p1 - s d1) over the distance of the axes, which _w holds."""
        n, m = self._n, self._m
        dots, s, t, x, y, speed = self._dots, self._s, self._t, self._x, self._c, self.speed
        np.multiply(t, dots[3 * n :, m:], x)
        x += dots[3 * n :, :m]
        np.multiply(s, np.einsum("ij,ij->i", w1, d1)[:, None], y)
        x -= y
        x -= (np.einsum("ij,ij->i", v1, d1) + np.einsum("ij,ij->i", w1, p1))[:, None]
        x *= s
        np.multiply(t, dots[2 * n : 3 * n, m:], speed)
        speed += dots[2 * n : 3 * n, :m]
        speed -= np.einsum("ij,ij->i", v1, p1)[:, None]
        speed += x
        speed /= self._w


def _clamp(x: Array) -> None:
    np.maximum(x, 0.0, x)
    np.minimum(x, 1.0, x)
