"""Double-coded events: which coding counts, and which codings can be compared."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from itertools import combinations

from foreshock.events.schema import Event

__all__ = ["coder_pairs", "one_coding"]


def one_coding(events: Sequence[Event], coder: str = "") -> tuple[Event, ...]:
    """Each event once, in the order of the table.

    Args:
        events: any codings.
        coder: whose coding counts where there are several; by default that of the coder with most rows, and of those
            with equally many the first in the table. Where that coder has none, the next in this order.
    """
    rows = Counter(e.coder for e in events)
    rank = {name: k for k, (name, _) in enumerate(rows.most_common())}
    if coder:
        rank[coder] = -1
    best: dict[str, Event] = {}
    for event in events:
        if event.id not in best or rank[event.coder] < rank[best[event.id].coder]:
            best[event.id] = event
    return tuple(best.values())


def coder_pairs(events: Sequence[Event]) -> dict[tuple[str, str], list[tuple[Event, Event]]]:
    """For each two coders that share events: both codings of each."""
    of: dict[str, dict[str, Event]] = {}
    for event in events:
        of.setdefault(event.coder, {})[event.id] = event
    pairs = {}
    for a, b in combinations(of, 2):
        if shared := [(mine, of[b][id_]) for id_, mine in of[a].items() if id_ in of[b]]:
            pairs[a, b] = shared
    return pairs
