"""The share of accidents with two or more precursors within a short window (section 3.2.2: 73 % at 0.5 to 1.5 s)."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import msgspec

from foreshock.events.schema import Event
from foreshock.session.rates import Rate, wilson

__all__ = ["WINDOWS_S", "OverlapPoint", "overlap"]

WINDOWS_S = tuple(k / 10 for k in range(5, 16))
"""0.5, 0.6, ... 1.5 s."""

RESOLUTION_S = 1e-6
"""Differences of times in a file are exact to this."""


class OverlapPoint(msgspec.Struct, frozen=True):
    """Share of accidents with two distinct precursors (kind or subject differ) within a window; 95% Wilson intervals.

    Attributes:
        window_s: length w of the window.
        begun: their onsets lie at most w apart.
        present: both are present at some times at most w apart: the later began at most w after the earlier was over.
            This is what m > 1 means for a supervisor with window w.
    """

    window_s: float
    begun: Rate
    present: Rate


def overlap(events: Sequence[Event], windows_s: Sequence[float] = WINDOWS_S) -> tuple[OverlapPoint, ...]:
    """The curve over the window; events that are no accidents do not count."""
    accidents = [e for e in events if e.accident]
    gaps = [_least_gaps(e) for e in accidents]
    points = []
    for w in windows_s:
        begun = sum(a <= w + RESOLUTION_S for a, _ in gaps)
        present = sum(b <= w + RESOLUTION_S for _, b in gaps)
        points.append(OverlapPoint(w, wilson(begun, len(gaps)), wilson(present, len(gaps))))
    return tuple(points)


def _least_gaps(event: Event) -> tuple[float, float]:
    """Least time between onsets, and between presences, of two distinct precursors, in s; infinite without two."""
    begun = present = float("inf")
    for a, b in combinations(sorted(event.precursors, key=lambda p: p.onset_s), 2):
        if (a.kind, a.subject) != (b.kind, b.subject):
            begun = min(begun, b.onset_s - a.onset_s)
            present = min(present, max(0.0, b.onset_s - event.end_of(a)))
    return begun, present
