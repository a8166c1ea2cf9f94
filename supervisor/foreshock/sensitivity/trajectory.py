"""A timeline through the real evidence window, ticked only where its evidence can change.

P is constant between such moments (boxcar window), so that a dozen ticks give what a fine grid gives.
"""

from __future__ import annotations

from typing import NamedTuple

from foreshock.evidence import Evidence, Key, Window, step
from foreshock.records import Indication, Precursor
from foreshock.sensitivity.timeline import Timeline

__all__ = ["Moment", "trajectory"]


class Moment(NamedTuple):
    """From at_ns on, until the next moment, these are the precursors."""

    at_ns: int
    precursors: tuple[Precursor, ...]


def trajectory(timeline: Timeline, window: Window) -> tuple[Moment, ...]:
    """The moments at which what P depends on changes, from the first onset to the last expiry.

    Args:
        timeline: what is present when.
        window: a boxcar; with an exponential kernel P changes all the time.
    """
    spans = [(e.kind, e.subject, round(e.onset_s * 1e9), round(e.end_s * 1e9), e.severity) for e in timeline.episodes]
    keys: list[Key] = sorted({(kind, subject, "timeline") for kind, subject, *_ in spans})
    moments: list[Moment] = []
    state, before = Evidence(), None
    for now in _ticks(spans, window):
        said = {key: Indication(key[0], key[1], now, False, 0.0, 1.0, "1", 0.0) for key in keys}
        for kind, subject, onset, end, severity in spans:
            if onset <= now <= end:
                said[kind, subject, "timeline"] = Indication(kind, subject, now, True, 1.0, 1.0, "1", severity)
        state, precursors = step(state, window, now, said)
        counted = [(p.kind, p.subject, p.weight, p.occurrences, p.severity, p.onsets_ns) for p in precursors]
        if counted != before:
            moments.append(Moment(now, precursors))
            before = counted
    return tuple(moments)


def _ticks(spans: list[tuple[str, str, int, int, float]], window: Window) -> list[int]:
    """Onsets, recurrences, ends, the first moment after each end, and when each leaves the window."""
    length = round(window.length_s * 1e9)
    recur = round((window.recurrence_s or window.length_s) * 1e9)
    ticks: set[int] = set()
    for _, _, onset, end, _ in spans:
        stays = [*range(onset, end + 1, recur), end]
        ticks.update(stays, [end + 1], [t + length for t in stays])
    return sorted(ticks)
