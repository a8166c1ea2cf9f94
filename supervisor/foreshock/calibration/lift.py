"""J from accident events: how much more often one kind begins before another than chance would have it.

    J_ij = max(0, ln(n_ij + k) / (e_ij + k)),    e_ij = N p_i p_j / 2

n_ij counts accident events in which some onset of i lies before some onset of j, N p_i those with any; k = 2 shrinks
what few events say. Independent kinds that come in any order have e_ij.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from foreshock.events.schema import Event
from foreshock.risk import Link

__all__ = ["lifts"]

SHRINK = 2.0
FEWEST = 3
"""A pair seen in fewer events is no evidence."""


def lifts(events: Sequence[Event], seed: int = 0, draws: int = 200) -> tuple[Link, ...]:
    """Ordered pairs that lift, with 95% intervals by a bootstrap over events.

    Args:
        events: each coded once; those without an accident are left out.
        seed: of the bootstrap.
        draws: of the bootstrap.
    """
    accidents = [e for e in events if e.accident]
    kinds = sorted({p.kind for e in accidents for p in e.precursors})
    if not kinds:
        return ()
    at = {kind: k for k, kind in enumerate(kinds)}
    has = np.zeros((len(accidents), len(kinds)))
    before = np.zeros((len(accidents), len(kinds), len(kinds)))
    for n, e in enumerate(accidents):
        for p in e.precursors:
            has[n, at[p.kind]] = 1.0
        for p, q in itertools.permutations(e.precursors, 2):
            if p.kind != q.kind and p.onset_s < q.onset_s:
                before[n, at[p.kind], at[q.kind]] = 1.0

    def value(chosen: np.ndarray[tuple[int], np.dtype[np.int64]]) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
        n, p = before[chosen].sum(axis=0), has[chosen].sum(axis=0)
        expected = np.outer(p, p) / (2.0 * len(accidents))
        return np.asarray(np.maximum(0.0, np.log((n + SHRINK) / (expected + SHRINK))))

    everyone = np.arange(len(accidents))
    point, counts = value(everyone), before.sum(axis=0)
    rng = np.random.default_rng([0x6A, seed])
    some = np.stack([value(rng.integers(0, len(accidents), len(accidents))) for _ in range(draws)])
    low, high = np.quantile(some, (0.025, 0.975), axis=0)
    return tuple(
        Link(kinds[i], kinds[j], lift, min(lift, float(low[i, j])), max(lift, float(high[i, j])))
        for i, j in itertools.permutations(range(len(kinds)), 2)
        if counts[i, j] >= FEWEST and (lift := float(point[i, j])) > 0.0
    )
