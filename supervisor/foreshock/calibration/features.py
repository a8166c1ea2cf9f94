"""Effective numbers of labelled moments: m*, q* and the cascade lift, as arrays."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foreshock.calibration.landmarks import Landmark, Seen
from foreshock.risk import Capacity, Element, cascade_lift, choquet

__all__ = ["Features", "effective", "features", "lifted"]

Array = NDArray[np.float64]
Values = Mapping[tuple[str, str], float]
"""r by pair of kinds, or J by (first, then)."""


class Features(NamedTuple):
    """Of n moments: m* without lift, q*, the lift at kappa = 1, the label (0 or 1), the number of the fold group."""

    m: Array
    q: Array
    lift: Array
    y: Array
    group: NDArray[np.int64]

    def of(self, chosen: NDArray[np.bool_] | NDArray[np.int64]) -> Features:
        """The features of some of the moments."""
        return Features(self.m[chosen], self.q[chosen], self.lift[chosen], self.y[chosen], self.group[chosen])


def features(moments: Sequence[Landmark], correlation: Values, lifts: Values, presence: float = 1.0) -> Features:
    """Features of these moments.

    Args:
        moments: labelled.
        correlation: r of pairs of kinds.
        lifts: J by (first, then).
        presence: strength of a precursor of severity 0.
    """
    groups = {g: k for k, g in enumerate(sorted({x.group for x in moments}))}
    m, q = effective(moments, correlation, presence)
    return Features(
        m,
        q,
        lifted(moments, correlation, lifts, presence),
        np.array([x.accident for x in moments], float),
        np.array([groups[x.group] for x in moments], np.int64),
    )


def effective(moments: Sequence[Landmark], correlation: Values, presence: float = 1.0) -> tuple[Array, Array]:
    """m* without lift, and q*; see features."""
    mu = Capacity(correlation)
    known: dict[tuple[tuple[str, int, float], ...], tuple[float, float]] = {}
    rows = []
    for x in moments:
        key = tuple((s.kind, s.occurrences, s.severity) for s in x.seen)
        if key not in known:
            kinds = [s.kind for s in x.seen]
            counts = [float(s.occurrences) for s in x.seen]
            known[key] = (choquet(_strengths(x.seen, presence), kinds, mu), choquet(counts, kinds, mu))
        rows.append(known[key])
    table = np.array(rows, float).reshape(len(rows), 2)
    return table[:, 0], table[:, 1]


def lifted(moments: Sequence[Landmark], correlation: Values, lifts: Values, presence: float = 1.0) -> Array:
    """The cascade lift at kappa = 1; see features."""
    mu = Capacity(correlation)
    links: dict[str, dict[str, float]] = {}
    for (first, then), lift in lifts.items():
        if (weight := (1.0 - mu.correlation(first, then)) * lift) > 0.0:
            links.setdefault(first, {})[then] = weight
    if not links:
        return np.zeros(len(moments))
    known: dict[tuple[Seen, ...], float] = {(): 0.0}
    out = np.empty(len(moments))
    for n, x in enumerate(moments):
        # a window holds the same from one moment of the grid to the next, most of the time
        if x.seen not in known:
            strengths = _strengths(x.seen, presence)
            elements = [
                Element(s.kind, w, tuple(round(t * 1e9) for t in s.onsets_s))
                for s, w in zip(x.seen, strengths, strict=True)
            ]
            known[x.seen] = cascade_lift(elements, links)
        out[n] = known[x.seen]
    return out


def _strengths(seen: Sequence[Seen], presence: float) -> list[float]:
    return [presence + (1.0 - presence) * s.severity for s in seen]
