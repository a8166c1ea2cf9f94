"""All that a table of events says, beside what the paper publishes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import msgspec

from foreshock.errors import BadInputError, MissingExtraError, nearest
from foreshock.events.agreement import Agreement, agreement
from foreshock.events.association import Association, class_association, kind_association
from foreshock.events.cascades import CascadeOrder, SequenceCount, cascade_orders, common_sequences
from foreshock.events.codings import one_coding
from foreshock.events.frequencies import ClassShare, ModeFrequency, class_shares, mode_frequencies
from foreshock.events.overlap import OverlapPoint, overlap
from foreshock.events.pairs import Matrix, cooccurrence, lift, order, seen_kinds
from foreshock.events.schema import SYNTHETIC, Event
from foreshock.taxonomy import Taxonomy

__all__ = ["Analysis", "analyse"]


class Analysis(msgspec.Struct, frozen=True):
    """What was counted. Everything but agreement is over one coding of each event.

    Attributes:
        rows: codings in the table.
        events: distinct events.
        accidents: of these.
        precursors: of the events.
        synthetic: events that a generator drew; nobody observed them.
        sources: number of events by source.
        coders: number of events by the coder whose coding counts; see codings.one_coding.
        modes: frequencies beside Table 1.
        classes: shares beside section 3.2.2.
        by_class: outcomes and classes beside Table 2.
        by_kind: outcomes and kinds beside Table 3.
        cooccurrence: events with both kinds.
        lift: of two kinds in one event.
        order: events in which the row's kind begins before the column's.
        overlap: share of accidents with two precursors within a window, over its length.
        cascades: order of Table 3, by mode.
        sequences: the most common orders of all events.
        agreement: of each two coders with common events.
    """

    rows: int
    events: int
    accidents: int
    precursors: int
    synthetic: int
    sources: dict[str, int]
    coders: dict[str, int]
    modes: tuple[ModeFrequency, ...]
    classes: tuple[ClassShare, ...]
    by_class: Association
    by_kind: Association
    cooccurrence: Matrix
    lift: Matrix
    order: Matrix
    overlap: tuple[OverlapPoint, ...]
    cascades: tuple[CascadeOrder, ...]
    sequences: tuple[SequenceCount, ...]
    agreement: tuple[Agreement, ...]


def analyse(events: Sequence[Event], taxonomy: Taxonomy, *, coder: str = "", seed: int = 0) -> Analysis:
    """Count.

    Args:
        events: all codings of all events.
        taxonomy: their kinds and modes.
        coder: whose coding counts for double-coded events; see codings.one_coding.
        seed: of the bootstrap intervals of kappa.

    Raises:
        BadInputError: no such coder.
        MissingExtraError: scipy or statsmodels is not installed.
    """
    names = {e.coder for e in events}
    if coder and coder not in names:
        raise BadInputError("coder", f"nobody is called {coder!r}", nearest(coder, names))
    once = one_coding(events, coder)
    kinds = seen_kinds(once, taxonomy)
    try:
        return Analysis(
            len(events),
            len(once),
            sum(e.accident for e in once),
            sum(len(e.precursors) for e in once),
            sum(e.source == SYNTHETIC for e in once),
            dict(Counter(e.source for e in once)),
            dict(Counter(e.coder for e in once)),
            mode_frequencies(once, taxonomy),
            class_shares(once, taxonomy),
            class_association(once, taxonomy),
            kind_association(once, taxonomy),
            cooccurrence(once, kinds),
            lift(once, kinds),
            order(once, kinds),
            overlap(once),
            cascade_orders(once, taxonomy),
            common_sequences(once),
            agreement(events, taxonomy, seed),
        )
    except ImportError as e:
        raise MissingExtraError("analysis", f"needs {e.name}", "; run: pip install 'foreshock[analysis]'") from e
