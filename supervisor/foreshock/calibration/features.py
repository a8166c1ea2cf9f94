"""Effective numbers of labelled moments: m*, q* and the cascade lift, as arrays."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foreshock.calibration.landmarks import Landmark
from foreshock.risk import Capacity, Element, cascade_lift, choquet

__all__ = ["Features", "features"]

Array = NDArray[np.float64]


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


def features(
    moments: Sequence[Landmark],
    correlation: Mapping[tuple[str, str], float],
    lifts: Mapping[tuple[str, str], float],
    presence: float = 1.0,
) -> Features:
    """Features of these moments.

    Args:
        moments: labelled.
        correlation: r of pairs of kinds.
        lifts: J by (first, then).
        presence: strength of a precursor of severity 0.
    """
    mu = Capacity(correlation)
    links: dict[str, dict[str, float]] = {}
    for (first, then), lift in lifts.items():
        if (weight := (1.0 - mu.correlation(first, then)) * lift) > 0.0:
            links.setdefault(first, {})[then] = weight
    groups = {g: k for k, g in enumerate(sorted({x.group for x in moments}))}
    rows = []
    known: dict[tuple[object, ...], tuple[float, float, float]] = {}
    for x in moments:
        # a window holds the same from one moment of the grid to the next, most of the time
        if x.seen not in known:
            kinds = [s.kind for s in x.seen]
            strengths = [presence + (1.0 - presence) * s.severity for s in x.seen]
            elements = [
                Element(s.kind, w, tuple(round(t * 1e9) for t in s.onsets_s))
                for s, w in zip(x.seen, strengths, strict=True)
            ]
            counts = [float(s.occurrences) for s in x.seen]
            known[x.seen] = (
                choquet(strengths, kinds, mu),
                choquet(counts, kinds, mu),
                cascade_lift(elements, links) if elements else 0.0,
            )
        rows.append((*known[x.seen], float(x.accident), groups[x.group]))
    table = np.array(rows, float).reshape(len(rows), 5)
    return Features(table[:, 0], table[:, 1], table[:, 2], table[:, 3], table[:, 4].astype(np.int64))
