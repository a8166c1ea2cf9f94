"""The effective number of independent kinds in a set, and the Choquet integral over it.

Two detectors that see one sway count nearly once. With R >= 0 the correlation of their statistics in nominal operation,

    mu(A) = max over v >= 0 of 2 1'v - v' R_A v,

which is 1' R_A^-1 1 where R_A^-1 1 >= 0. It is monotone in A, antitone in R, and lies between 1 and the size of A.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

__all__ = ["Capacity", "choquet", "effective_number"]

Matrix = NDArray[np.float64]

LARGEST = 10
"""Largest matrix, not positive semidefinite, whose supports are all searched: 1,023 small systems, once."""
JITTER = 1e-11
"""Added to the diagonal where duplicates (r = 1) make R singular; mu moves by less than JITTER times its size."""


def effective_number(r: Matrix) -> float:
    """Effective number (mu) of the kinds of a correlation matrix.

    Args:
        r: n x n, symmetric, unit diagonal, entries 0..1. Two feet that each correlate with the torso but not with each
            other can leave it without being positive semidefinite: the maximum is then looked for on every support, up
            to LARGEST kinds; beyond, r is scaled down until it is, which counts more, never less.

    Returns:
        The maximum over v >= 0 of 2 1'v - v'rv, in 1..n; 0 for n = 0.
    """
    n = len(r)
    if n < 2:
        return float(n)
    least = float(np.linalg.eigvalsh(r)[0])
    if least < -1e-9:
        if n <= LARGEST:
            return _on_every_support(r)
        # the eigenvalues of I + t (R - I) are 1 + t (w - 1): zero at t = 1 / (1 - w)
        r, least = np.eye(n) + (r - np.eye(n)) / (1.0 - least), 0.0
    ones = np.ones(n)
    v = np.linalg.solve(r, ones) if least > 1e-6 else -ones
    if (v < 0.0).any():
        # min |F v - y|^2 with F'F = R and F'y = 1 has the same maximiser
        from scipy.optimize import nnls

        lower = np.linalg.cholesky(r + (JITTER + max(-least, 0.0)) * np.eye(n))
        v, _ = nnls(lower.T, np.linalg.solve(lower, ones), maxiter=50 * n)
    return float(min(max(2.0 * v.sum() - v @ r @ v, 1.0), n))


def _on_every_support(r: Matrix) -> float:
    """The largest 1'v over supports S with R_S v = 1, v >= 0: the maximum is one of these stationary points."""
    n, best = len(r), 1.0
    for size in range(2, n + 1):
        chosen = np.array(list(combinations(range(n), size)))
        blocks = r[chosen[:, :, None], chosen[:, None, :]] + JITTER * np.eye(size)
        v = np.linalg.solve(blocks, np.ones((len(chosen), size, 1)))[:, :, 0]
        inside = (v >= 0.0).all(axis=1)
        if inside.any():
            best = max(best, float(v[inside].sum(axis=1).max()))
    return min(best, float(n))


class Capacity:
    """mu over multisets of kinds; each set is worked out once.

    Two subjects of one kind (the left foot, the right foot) are two elements that do not correlate.

    Args:
        r: correlation of pairs of kinds, 0..1; pairs that are not named have none.
    """

    def __init__(self, r: Mapping[tuple[str, str], float]) -> None:
        self._r: dict[str, dict[str, float]] = {}
        for (a, b), value in r.items():
            if value > 0.0 and a != b:
                self._r.setdefault(a, {})[b] = value
                self._r.setdefault(b, {})[a] = value
        # each kind has 16 bits for how many subjects of it are in the set
        self._code = {kind: 1 << (16 * k) for k, kind in enumerate(sorted(self._r))}
        self._known: dict[int, float] = {0: 0.0}

    def correlation(self, a: str, b: str) -> float:
        """The correlation of two kinds."""
        return self._r.get(a, {}).get(b, 0.0)

    def correlated(self, kinds: Sequence[str]) -> bool:
        """Whether any two of these kinds correlate; else mu is their number."""
        linked = [k for k in kinds if k in self._r]
        return any(b in self._r[a] for i, a in enumerate(linked) for b in linked[i + 1 :])

    def of(self, kinds: Iterable[str]) -> float:
        """Effective number of a multiset of kinds: one entry for each (kind, subject)."""
        return self.growth(list(kinds))[-1]

    def growth(self, kinds: Sequence[str]) -> list[float]:
        """Effective numbers of the first 0, 1, 2, ... of these kinds."""
        values, key, alone = [0.0], 0, 0
        inside: list[str] = []
        for kind in kinds:
            code = self._code.get(kind)
            if code is None:
                alone += 1  # correlates with nothing
            else:
                key += code
                inside.append(kind)
            values.append(alone + self._of_linked(key, inside))
        return values

    def _of_linked(self, key: int, kinds: Sequence[str]) -> float:
        value = self._known.get(key)
        if value is None:
            value = self._known[key] = math.fsum(self._of_block(block) for block in self._blocks(kinds))
        return value

    def _of_block(self, kinds: Sequence[str]) -> float:
        n = len(kinds)
        if n == 1:
            return 1.0
        r = np.eye(n)
        for i, a in enumerate(kinds):
            for j in range(i):
                r[i, j] = r[j, i] = self.correlation(a, kinds[j])
        return effective_number(r)

    def _blocks(self, kinds: Sequence[str]) -> list[list[str]]:
        """Connected components: mu of a block-diagonal matrix is the sum over its blocks."""
        left = sorted(kinds)
        blocks = []
        while left:
            block, grown = [left.pop()], True
            while grown:
                near = [k for k in left if any(k in self._r[b] for b in block)]
                left = [k for k in left if k not in near]
                block += near
                grown = bool(near)
            blocks.append(sorted(block))
        return blocks


def choquet(values: Sequence[float], kinds: Sequence[str], capacity: Capacity) -> float:
    """The Choquet integral: values sorted descending, each weighed by what its kind adds to mu.

    Equals the sum of the values where nothing correlates, and the largest of them where all are duplicates.
    """
    order = sorted(range(len(values)), key=lambda k: -values[k])
    mu = capacity.growth([kinds[k] for k in order])
    return math.fsum([values[k] * (mu[n + 1] - mu[n]) for n, k in enumerate(order)])
