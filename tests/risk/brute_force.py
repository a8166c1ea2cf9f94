"""The model of docs/model.md by exhaustion: every support, every level set, every chain. It shares no code with it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from itertools import combinations

import numpy as np

from foreshock.records import Precursor
from foreshock.risk import Link, Pair, Provenance, RiskParameters

SOURCE = Provenance(source="a test")
KINDS = (
    "foot-micro-slip",
    "torso-angular-spike",
    "grip-micro-slip",
    "handover-occlusion",
    "timing-mismatch",
    "human-proximity-breach",
)
"""Of four classes; tied to A1 A2 A11, A4 A5 A10 A11, A4 A6 A8, A4 A9 A12 and A2 A3 A6."""


def pair(a: str, b: str) -> tuple[str, str]:
    return (a, b) if a <= b else (b, a)


def matrix(kinds: Sequence[str], r: Mapping[tuple[str, str], float]) -> np.ndarray:
    """R of elements by their kinds; two subjects of one kind do not correlate."""
    n = len(kinds)
    found = np.eye(n)
    for i, j in combinations(range(n), 2):
        if kinds[i] != kinds[j]:
            found[i, j] = found[j, i] = r.get(pair(kinds[i], kinds[j]), 0.0)
    return found


def capacities(r: np.ndarray) -> list[float]:
    """mu of every subset, by bit mask.

    On the support B of a maximum v the gradient 2 (1 - R_B v) is 0. Where R_B is singular, a step along its null space
    keeps the value (1'n = v'R n = 0) and ends on a smaller support. So the best over all regular supports is the
    maximum; each value is that of some v >= 0, so that it is never above it.
    """
    n = len(r)
    best = [0.0] * (1 << n)
    for mask in range(1, 1 << n):
        support = [i for i in range(n) if mask >> i & 1]
        inner = r[np.ix_(support, support)]
        try:
            v = np.clip(np.linalg.solve(inner, np.ones(len(support))), 0.0, None)
            value = float(2.0 * v.sum() - v @ inner @ v)
        except np.linalg.LinAlgError:
            value = 0.0
        best[mask] = max(value, *(best[mask & ~(1 << i)] for i in support))
    return best


def mu(r: np.ndarray) -> float:
    return capacities(r)[-1]


def solved(rows: Sequence[Sequence[Fraction]]) -> list[Fraction] | None:
    """R^-1 1 in rationals; None where R is singular."""
    n = len(rows)
    a = [[*row, Fraction(1)] for row in rows]
    for c in range(n):
        pivot = next((k for k in range(c, n) if a[k][c]), None)
        if pivot is None:
            return None
        a[c], a[pivot] = a[pivot], a[c]
        for k in range(n):
            if k != c and a[k][c]:
                f = a[k][c] / a[c][c]
                a[k] = [x - f * y for x, y in zip(a[k], a[c], strict=True)]
    return [a[k][n] / a[k][k] for k in range(n)]


def exact_mu(r: Sequence[Sequence[Fraction]]) -> Fraction:
    """As capacities, without rounding."""
    n = len(r)
    best = Fraction(0)
    for size in range(1, n + 1):
        for support in combinations(range(n), size):
            v = solved([[r[i][j] for j in support] for i in support])
            if v is not None and min(v) >= 0:
                best = max(best, sum(v, Fraction(0)))
    return best


def choquet(values: Sequence[float], capacity: Sequence[float]) -> float:
    """The integral over t >= 0 of mu{i: x_i >= t}, which is constant between two values."""
    total, below = 0.0, 0.0
    for t in sorted(set(values)):
        level = sum(1 << i for i, x in enumerate(values) if x >= t)
        total += (t - below) * capacity[level]
        below = t
    return total


Chained = tuple[str, float, Sequence[int]]
"""Kind, strength and onsets."""


def lift(elements: Sequence[Chained], link: Callable[[str, str], float]) -> float:
    """The best of all chains: each permutation of each subset, with each choice of onsets."""

    def best(last: Chained, at: int, used: frozenset[str]) -> float:
        found = 0.0
        for following in elements:
            kind, strength, onsets = following
            if kind not in used:
                gain = link(last[0], kind) * min(last[1], strength)
                for onset in onsets:
                    if onset > at:
                        found = max(found, gain + best(following, onset, used | {kind}))
        return found

    return max((best(e, t, frozenset([e[0]])) for e in elements for t in e[2]), default=0.0)


def le(m: float, q: float, a: float = 1.6, b: float = 2.0, c: float = 1.2) -> float:
    """Eq. 1."""
    return (1.0 - math.exp(-c * q)) / (1.0 + math.exp(-a * (m - b)))


def strength(p: Precursor, presence: float) -> float:
    return p.weight * (presence + (1.0 - presence) * p.severity)


def effective(
    found: Sequence[Precursor],
    parameters: RiskParameters,
    r: Mapping[tuple[str, str], float],
    j: Mapping[tuple[str, str], float],
) -> tuple[float, float, float]:
    """m*, q* and P* at this R and this J."""
    if not found:
        return 0.0, 0.0, 0.0
    capacity = capacities(matrix([p.kind for p in found], r))
    strengths = [strength(p, parameters.presence) for p in found]
    chained = [(p.kind, s, p.onsets_ns or (p.onset_ns,)) for p, s in zip(found, strengths, strict=True)]
    gain = lift(chained, lambda a, b: (1.0 - r.get(pair(a, b), 0.0)) * j.get((a, b), 0.0)) if parameters.kappa else 0.0
    m = choquet(strengths, capacity) + parameters.kappa * gain
    q = choquet([p.occurrences for p in found], capacity)
    return m, q, le(m, q, parameters.a, parameters.b, parameters.c)


def correlations(parameters: RiskParameters, end: str = "r") -> dict[tuple[str, str], float]:
    """r of every pair, or an end of its interval."""
    return {pair(*p.kinds): getattr(p, end) for p in parameters.correlation}


def lifts(parameters: RiskParameters, end: str = "lift") -> dict[tuple[str, str], float]:
    """J of every ordered pair, or an end of its interval."""
    return {(x.first, x.then): getattr(x, end) for x in parameters.cascade}


def independent(found: Sequence[Precursor], parameters: RiskParameters) -> float:
    """Eq. 1 on the plain counts."""
    m, q = sum(p.weight for p in found), sum(p.occurrences for p in found)
    return le(m, q, parameters.a, parameters.b, parameters.c) if found else 0.0


def bounds(found: Sequence[Precursor], parameters: RiskParameters) -> tuple[float, float, float]:
    """lower, P and upper."""
    p = effective(found, parameters, correlations(parameters), lifts(parameters))[2]
    low = effective(found, parameters, correlations(parameters, "high"), lifts(parameters, "low"))[2]
    free = effective(found, parameters, {}, lifts(parameters, "high"))[2]
    return low, p, max(independent(found, parameters), free)


def parameters_of(correlation: Sequence[Pair] = (), cascade: Sequence[Link] = (), **fields: float) -> RiskParameters:
    return RiskParameters(
        name="of-a-test", provenance=SOURCE, correlation=tuple(correlation), cascade=tuple(cascade), **fields
    )
