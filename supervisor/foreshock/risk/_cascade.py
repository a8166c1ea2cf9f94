"""Cascade lift: how much more an ordered chain of precursors says than the same precursors in any order."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

__all__ = ["Element", "Links", "cascade_lift"]

Links = Mapping[str, Mapping[str, float]]
"""By first and second kind, the lift (1 - r_ij) J_ij > 0 of "some onset of i before some onset of j"."""

MOST_REPEATED = 8
"""Beyond so many linked kinds, where one has several onsets or subjects, chains are bounded instead of searched."""


class Element(NamedTuple):
    """A precursor in a chain: its kind, its strength 0..1, and its onsets in ns, sorted."""

    kind: str
    strength: float
    onsets: tuple[int, ...]


def cascade_lift(elements: Sequence[Element], links: Links) -> float:
    """The largest sum of link(i, j) min(s_i, s_j) over consecutive i, j of an onset-ordered chain.

    A chain is a sequence of onsets, each strictly later than the one before, that uses each kind once; kinds without a
    link may follow each other, for 0. Never falls when an element, an onset or strength is added. With more than
    MOST_REPEATED linked kinds of which one has several onsets or subjects, it is an upper bound: every kind takes its
    best link.

    Args:
        elements: precursors; several subjects of a kind are several elements.
        links: of pairs of kinds.
    """
    followers = {kind for later in links.values() for kind in later}
    linked = [e for e in elements if e.kind in links or e.kind in followers]
    into: list[dict[int, float]] = [{} for _ in linked]
    for j, b in enumerate(linked):
        for i, a in enumerate(linked):
            if a.kind != b.kind and a.onsets[0] < b.onsets[-1]:
                weight = links.get(a.kind, {}).get(b.kind, 0.0)
                if weight > 0.0:
                    into[j][i] = weight * min(a.strength, b.strength)
    if not any(into):
        return 0.0
    kinds = {e.kind for e in linked}
    if len(kinds) == len(linked) and all(len(e.onsets) == 1 for e in linked):
        return _by_onset(linked, into)
    if len(kinds) <= MOST_REPEATED:
        return _searched(linked, into)
    best: dict[str, float] = {}
    for e, weights in zip(linked, into, strict=True):
        best[e.kind] = max([best.get(e.kind, 0.0), *weights.values()])
    return sum(best.values())


def _by_onset(elements: Sequence[Element], into: Sequence[Mapping[int, float]]) -> float:
    """The best chain where every kind has one onset: their order is given."""
    longest: dict[int, float] = {}
    for j in sorted(range(len(elements)), key=lambda k: elements[k].onsets[0]):
        earlier = [v + into[j].get(i, 0.0) for i, v in longest.items() if elements[i].onsets[0] < elements[j].onsets[0]]
        longest[j] = max(earlier, default=0.0)
    return max(longest.values())


def _searched(elements: Sequence[Element], into: Sequence[Mapping[int, float]]) -> float:
    """The best chain, onset by onset: of all that use the same kinds and end in the same element, the heaviest."""
    best: dict[tuple[frozenset[str], int], float] = {}
    times = sorted({t for e in elements for t in e.onsets})
    for t in times:
        grown: dict[tuple[frozenset[str], int], float] = {}
        for j, e in enumerate(elements):
            if t not in e.onsets:
                continue
            grown.setdefault((frozenset([e.kind]), j), 0.0)
            for (used, i), value in best.items():
                if e.kind not in used:
                    key = (used | {e.kind}, j)
                    grown[key] = max(grown.get(key, 0.0), value + into[j].get(i, 0.0))
        for key, value in grown.items():
            best[key] = max(best.get(key, 0.0), value)
    return max(best.values())
