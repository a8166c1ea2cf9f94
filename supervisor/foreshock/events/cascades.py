"""Whether the cascades of Table 3 come in their order, and which orders are common."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from itertools import pairwise
from math import factorial

import msgspec

from foreshock.events.schema import Event
from foreshock.session.rates import Rate, wilson
from foreshock.taxonomy import Taxonomy

__all__ = ["CascadeOrder", "SequenceCount", "cascade_orders", "common_sequences"]


class SequenceCount(msgspec.Struct, frozen=True):
    """Kinds in the order of their first onsets, and the number of events with just these."""

    kinds: tuple[str, ...]
    n: int


class CascadeOrder(msgspec.Struct, frozen=True):
    """How a mode's accidents keep to its cascade.

    Attributes:
        code: of the mode.
        cascade: Table 3.
        complete: accidents of the mode with all of its kinds.
        in_order: of those with at least two of them, how many have these in the cascade's order; first onsets count,
            and a tie is no order. 95% Wilson interval.
        by_chance: what in_order would be if every order were as likely, the mean of 1 / k!; None if n is 0.
        common: the most common sequences of the mode, of two kinds or more.
    """

    code: str
    cascade: tuple[str, ...]
    complete: int
    in_order: Rate
    by_chance: float | None
    common: tuple[SequenceCount, ...]


def cascade_orders(events: Sequence[Event], taxonomy: Taxonomy, most: int = 3) -> tuple[CascadeOrder, ...]:
    """One entry per mode, with the most common sequences."""
    out = []
    for mode in taxonomy.modes:
        mine = [e for e in events if e.outcome == mode.code]
        cascade = tuple(taxonomy.kind(k).id for k in mode.cascade)
        onsets = [tuple(first[k] for k in cascade if k in first) for first in map(_first_onsets, mine)]
        several = [o for o in onsets if len(o) > 1]
        kept = sum(all(a < b for a, b in pairwise(o)) for o in several)
        chance = sum(1 / factorial(len(o)) for o in several) / len(several) if several else None
        complete = sum(len(o) == len(cascade) for o in onsets)
        in_order = wilson(kept, len(several))
        out.append(CascadeOrder(mode.code, cascade, complete, in_order, chance, common_sequences(mine, most)))
    return tuple(out)


def common_sequences(events: Sequence[Event], most: int = 10) -> tuple[SequenceCount, ...]:
    """The most common sequences of two kinds or more; of those as common, the first by name."""
    counts = Counter(tuple(sorted(first, key=lambda k: (first[k], k))) for first in map(_first_onsets, events))
    ranked = sorted(((n, kinds) for kinds, n in counts.items() if len(kinds) > 1), key=lambda c: (-c[0], c[1]))
    return tuple(SequenceCount(kinds, n) for n, kinds in ranked[:most])


def _first_onsets(event: Event) -> dict[str, float]:
    first: dict[str, float] = {}
    for p in event.precursors:
        first[p.kind] = min(p.onset_s, first.get(p.kind, p.onset_s))
    return first
