"""Pairs of kinds: how often they occur together, more often than by chance, and in which order."""

from __future__ import annotations

from collections.abc import Sequence

import msgspec
import numpy as np
from numpy.typing import NDArray

from foreshock.events.schema import Event
from foreshock.taxonomy import Taxonomy

__all__ = ["Matrix", "cooccurrence", "lift", "order", "seen_kinds"]


class Matrix(msgspec.Struct, frozen=True):
    """Values by row and column, both named by kinds; None where a value is not defined."""

    names: tuple[str, ...]
    values: tuple[tuple[float | None, ...], ...]


def seen_kinds(events: Sequence[Event], taxonomy: Taxonomy) -> tuple[str, ...]:
    """Kinds that occur, in the order of the taxonomy, so that a class stands together."""
    seen = {p.kind for e in events for p in e.precursors}
    return tuple(k.id for c in taxonomy.classes for k in taxonomy.kinds if k.class_ == c.id and k.id in seen)


def cooccurrence(events: Sequence[Event], kinds: Sequence[str]) -> Matrix:
    """Number n_ij of events with both i and j; on the diagonal, with i."""
    return _matrix(kinds, _both(events, kinds))


def lift(events: Sequence[Event], kinds: Sequence[str]) -> Matrix:
    """P(i and j) / (P(i) P(j)) = n n_ij / (n_ii n_jj); 1 if independent, None where i or j does not occur."""
    both = _both(events, kinds)
    alone = np.diag(both)
    expected = np.outer(alone, alone)
    ratio = np.divide(len(events) * both, expected, out=np.full(both.shape, np.nan), where=expected > 0)
    return _matrix(kinds, ratio)


def order(events: Sequence[Event], kinds: Sequence[str]) -> Matrix:
    """Number of events in which some onset of i (row) is before some onset of j (column).

    Where kinds recur, one event can count for both orders. On the diagonal: events in which i has two onsets.
    """
    index = {kind: k for k, kind in enumerate(kinds)}
    counts = np.zeros((len(index), len(index)))
    for event in events:
        first: dict[int, float] = {}
        last: dict[int, float] = {}
        for p in event.precursors:
            if p.kind in index:
                k = index[p.kind]
                first[k] = min(p.onset_s, first.get(k, p.onset_s))
                last[k] = max(p.onset_s, last.get(k, p.onset_s))
        for i, begun in first.items():
            for j, ended in last.items():
                counts[i, j] += begun < ended
    return _matrix(kinds, counts)


def _both(events: Sequence[Event], kinds: Sequence[str]) -> NDArray[np.float64]:
    held = [{p.kind for p in e.precursors} for e in events]
    present = np.array([[kind in mine for kind in kinds] for mine in held], float).reshape(len(events), len(kinds))
    both: NDArray[np.float64] = present.T @ present
    return both


def _matrix(kinds: Sequence[str], values: NDArray[np.float64]) -> Matrix:
    return Matrix(tuple(kinds), tuple(tuple(None if np.isnan(v) else float(v) for v in row) for row in values))
