"""What the detectors saw of a run, as precursors of an event: every stretch of presence with its highest severity."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from foreshock.clock import seconds
from foreshock.events.schema import EventPrecursor
from foreshock.journal import NO_VERDICTS, OperatorReset
from foreshock.records import Decision, Sample

__all__ = ["Stretches"]

DIGITS = 3
"""Of a severity."""
Pair = tuple[str, str]
"""kind, subject."""


class _Stretch(NamedTuple):
    """Onset and last moment of presence in s; every (time, severity) that was the highest so far."""

    pair: Pair
    onset_s: float
    last_s: float
    rises: tuple[tuple[float, float], ...]


class Stretches:
    """A journal of stretches: from an onset until the detectors say that the condition is over.

    An onset has the source stamp of the newest onset in the evidence window. Detectors of one kind are one condition,
    which is present while any of them says so; one that nobody observes any more stays what it was.

    Args:
        kinds: that are kept.
    """

    def __init__(self, kinds: frozenset[str]) -> None:
        self._kinds = kinds
        self._open: dict[Pair, _Stretch] = {}
        self._ended: list[_Stretch] = []

    def tick(self, samples: Sequence[Sample], decision: Decision, verdicts: Mapping[str, str] = NO_VERDICTS) -> None:  # noqa: ARG002 # a journal is given them
        """Take one tick."""
        now_s = seconds(decision.now_ns)
        present = {
            (p.kind, p.subject): seconds(max(p.onsets_ns or (p.onset_ns,)))
            for p in decision.precursors
            if p.kind in self._kinds and p.phase != "cleared"
        }
        for pair in self._open.keys() - present.keys():
            self._ended.append(self._open.pop(pair))
        severity: dict[Pair, float] = {}
        for i in decision.indications:
            if i.present:
                severity[i.kind, i.subject] = max(i.severity, severity.get((i.kind, i.subject), 0.0))
        for pair, onset_s in present.items():
            before = self._open.get(pair) or _Stretch(pair, onset_s, now_s, ((onset_s, 0.0),))
            now = severity.get(pair, 0.0)
            rises = (*before.rises, (now_s, now)) if now > before.rises[-1][1] else before.rises
            self._open[pair] = before._replace(last_s=now_s, rises=rises)

    def operator_reset(self, record: OperatorReset) -> None:
        """Nothing to keep."""

    def close(self) -> None:
        """Nothing to close."""

    def found(self, until_s: float) -> tuple[EventPrecursor, ...]:
        """Stretches that began by until_s, by onset, with their severity until then; those that lasted have no end."""
        ended = [(s, s.last_s if s.last_s < until_s else None) for s in self._ended]
        every = [*ended, *((s, None) for s in self._open.values())]
        precursors = [
            EventPrecursor(
                s.pair[0], s.onset_s, end_s, round(max(v for t, v in s.rises if t <= until_s), DIGITS), s.pair[1]
            )
            for s, end_s in every
            if s.onset_s <= until_s
        ]
        return tuple(sorted(precursors, key=lambda p: (p.onset_s, p.kind, p.subject)))
