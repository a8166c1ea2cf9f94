"""How often each accident mode and precursor class occurs, beside the paper's Table 1 and section 3.2.2."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import msgspec

from foreshock.events.schema import Event
from foreshock.session.rates import Rate, wilson
from foreshock.taxonomy import Taxonomy

__all__ = ["ClassShare", "ModeFrequency", "class_shares", "mode_frequencies"]


class ModeFrequency(msgspec.Struct, frozen=True):
    """An accident mode's share of the accidents, with the paper's count and percent (Table 1)."""

    code: str
    title: str
    rate: Rate
    paper_n: int
    paper_percent: float


class ClassShare(msgspec.Struct, frozen=True):
    """A class's share of the precursors of accidents, with the paper's share, 0..1 (section 3.2.2).

    The interval takes precursors as independent; those of one event are not, so that it is somewhat too narrow.
    """

    id: str
    title: str
    rate: Rate
    paper_share: float


def mode_frequencies(events: Sequence[Event], taxonomy: Taxonomy) -> tuple[ModeFrequency, ...]:
    """Of the accidents, how many were of each mode; 95% Wilson intervals."""
    counts = Counter(e.outcome for e in events if e.accident)
    n = counts.total()
    return tuple(ModeFrequency(m.code, m.title, wilson(counts[m.code], n), m.n, m.percent) for m in taxonomy.modes)


def class_shares(events: Sequence[Event], taxonomy: Taxonomy) -> tuple[ClassShare, ...]:
    """Of the precursors of accidents, how many were of each class; 95% Wilson intervals."""
    counts = Counter(taxonomy.class_of(p.kind) for e in events if e.accident for p in e.precursors)
    n = counts.total()
    return tuple(ClassShare(c.id, c.title, wilson(counts[c.id], n), c.share) for c in taxonomy.classes)
