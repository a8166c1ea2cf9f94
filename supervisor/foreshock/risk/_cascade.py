"""Cascade lift: how much more an ordered chain of precursors says than the same precursors in any order."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

__all__ = ["Element", "Links", "cascade_lift"]

Links = Mapping[str, Mapping[str, float]]
"""By first and second kind, the lift (1 - r_ij) J_ij > 0 of "some onset of i before some onset of j"."""

MOST_REPEATED = 8
"""Beyond so many linked kinds, some of which have several onsets, the chains are bounded instead of searched."""


class Element(NamedTuple):
    """A precursor in a chain: its kind, its strength 0..1, and its onsets in ns, sorted."""

    kind: str
    strength: float
    onsets: tuple[int, ...]


def cascade_lift(elements: Sequence[Element], links: Links) -> float:
    """The largest sum of link(i, j) min(s_i, s_j) over consecutive i, j of an onset-ordered chain.

    A chain is a sequence of onsets, each strictly later than the one before, that uses each kind once.
    Never falls when an element, an onset or strength is added. With more than MOST_REPEATED linked kinds of which some
    have several onsets, it is an upper bound: every kind takes its best link.

    Args:
        elements: precursors; several subjects of a kind are several elements.
        links: of pairs of kinds.
    """
    linked = [e for e in elements if e.kind in links or any(e.kind in later for later in links.values())]
    pairs = [
        (i, j, w * min(a.strength, b.strength))
        for i, a in enumerate(linked)
        for j, b in enumerate(linked)
        if a.kind != b.kind and (w := links.get(a.kind, {}).get(b.kind, 0.0)) > 0.0 and a.onsets[0] < b.onsets[-1]
    ]
    if not pairs:
        return 0.0
    kinds = {linked[k].kind for i, j, _ in pairs for k in (i, j)}
    if len(kinds) == 2:
        # one pair of kinds: a chain has one link
        return max(w for _, _, w in pairs)
    if len(kinds) == len(linked) and all(len(e.onsets) == 1 for e in linked):
        return _by_first_onset(linked, pairs)
    if len(kinds) > MOST_REPEATED:
        best: dict[str, float] = {}
        for _, j, w in pairs:
            kind = linked[j].kind
            best[kind] = max(w, best.get(kind, 0.0))
        return sum(best.values())
    return _searched(linked, pairs)


def _by_first_onset(elements: Sequence[Element], pairs: Sequence[tuple[int, int, float]]) -> float:
    """Longest path where every kind has one onset: their order is given."""
    into: dict[int, list[tuple[int, float]]] = {}
    for i, j, w in pairs:
        into.setdefault(j, []).append((i, w))
    longest: dict[int, float] = {}
    for j in sorted(range(len(elements)), key=lambda k: elements[k].onsets[0]):
        longest[j] = max([longest[i] + w for i, w in into.get(j, ())], default=0.0)
    return max(longest.values())


def _searched(elements: Sequence[Element], pairs: Sequence[tuple[int, int, float]]) -> float:
    """Depth-first over chains; each goes on from the earliest onset that is late enough, which leaves most room."""
    out: dict[int, list[tuple[int, float]]] = {}
    for i, j, w in pairs:
        out.setdefault(i, []).append((j, w))
    best = 0.0

    def follow(at: int, time_ns: int, used: frozenset[str], total: float) -> None:
        nonlocal best
        best = max(best, total)
        for j, w in out.get(at, ()):
            e = elements[j]
            if e.kind not in used:
                onset = next((t for t in e.onsets if t > time_ns), None)
                if onset is not None:
                    follow(j, onset, used | {e.kind}, total + w)

    for i in out:
        follow(i, elements[i].onsets[0], frozenset([elements[i].kind]), 0.0)
    return best
