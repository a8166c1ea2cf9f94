"""Labelled moments: what the evidence window held at a time, and whether the accident came within the horizon.

P is calibrated as the probability of the accident within the horizon H of a moment t. A moment is censored, and left
out, where no accident happened and the observation ends before t + H: nobody knows what it would have been.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Literal

import msgspec

from foreshock._strict import within
from foreshock.errors import BadInputError
from foreshock.events.schema import Event

__all__ = ["Landmark", "Seen", "landmarks"]


class Seen(msgspec.Struct, frozen=True):
    """One (kind, subject) inside the window.

    Attributes:
        kind: taxonomy id.
        subject: what it is about.
        occurrences: as the evidence window counts them.
        severity: the largest; 1 while a stretch lasts: a table holds the largest of a stretch, which nobody knows
            before it is over, and what rises towards the accident must not tell of it beforehand.
        onsets_s: times of the onsets.
    """

    kind: str
    subject: str
    occurrences: int
    severity: float
    onsets_s: tuple[float, ...]


class Landmark(msgspec.Struct, frozen=True):
    """A labelled moment: of which event and fold group, when, what was seen, and whether the accident came within H."""

    event: str
    group: str
    t_s: float
    seen: tuple[Seen, ...]
    accident: bool


def landmarks(
    events: Iterable[Event],
    window_s: float,
    horizon_s: float,
    mode: str = "",
    at: Literal["grid", "last-onset"] = "grid",
    every_s: float = 0.1,
) -> list[Landmark]:
    """The labelled moments of these events.

    Args:
        events: each coded once; treated runs must not be among them, since what was prevented cannot be learned.
        window_s: of the evidence; a precursor counts while it was present within it.
        horizon_s: H.
        mode: code of the accident mode that is predicted; ``""`` for any.
        at: ``grid``: every every_s from the start; ``last-onset``: one moment per event, when its last precursor began.
        every_s: of the grid.

    Raises:
        BadInputError: an event of a treated run, or a time that is not above 0.
    """
    for name, value in (("window_s", window_s), ("horizon_s", horizon_s), ("every_s", every_s)):
        within(name, value, 0.0, above=True)
    found = []
    for event in events:
        if event.source == "treated":
            raise BadInputError(f"event {event.id}", "of a treated run: what was prevented cannot be learned from it")
        struck_s = event.outcome_s if event.accident and mode in ("", event.outcome) else None
        for t in _moments(event, at, every_s):
            hit = struck_s is not None and t < struck_s <= t + horizon_s
            if hit or t + horizon_s <= event.until_s + 1e-9:
                found.append(Landmark(event.id, event.group, t, _seen(event, t, window_s), hit))
    return found


def _moments(event: Event, at: str, every_s: float) -> Sequence[float]:
    if at == "last-onset":
        onsets = [p.onset_s for p in event.precursors if p.onset_s < event.until_s]
        return [max(onsets)] if onsets else []
    return [k * every_s for k in range(int(event.until_s / every_s) + 1) if k * every_s < event.until_s]


def _seen(event: Event, t: float, window_s: float) -> tuple[Seen, ...]:
    """What the window holds at t: an onset counts one, a condition that persists one more per window."""
    by_pair: dict[tuple[str, str], list[tuple[float, float, float]]] = {}
    for p in event.precursors:
        last = min(event.end_of(p), t)
        if p.onset_s <= t and last > t - window_s:
            severity = p.severity if event.end_of(p) <= t else 1.0
            by_pair.setdefault((p.kind, p.subject), []).append((p.onset_s, last, severity))
    found = []
    for (kind, subject), stretches in sorted(by_pair.items()):
        count = 0
        for onset, last, _ in stretches:
            steps = int((last - onset) / window_s + 1e-9)
            count += sum(onset + k * window_s > t - window_s for k in range(steps + 1))
        onsets = tuple(sorted(onset for onset, _, _ in stretches))
        found.append(Seen(kind, subject, max(count, 1), max(s for _, _, s in stretches), onsets))
    return tuple(found)
