"""Timelines of precursors, scripted: when each begins, when it ends, and how severe it is."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import msgspec

from foreshock._strict import within
from foreshock.errors import ConfigError

__all__ = ["Episode", "Timeline", "timelines_of"]

ONSETS_S = (0.0, 0.48, 1.12)
"""Onsets of the case study A1 (section 3.3); the other modes' cascades of Table 3 are given the same."""
BRIEF_S = 0.5
"""How long a precursor is present; the paper does not say. Its shortest overlap (section 3.2.2)."""
LONG_S = 3.0
"""How long one that lasts is present: two windows."""
SEVERITY = 0.5
"""In the middle, so that presence and severity can matter in both directions."""


class Episode(msgspec.Struct, frozen=True):
    """A stretch of time in which one precursor is present, from onset_s to end_s, both included.

    Attributes:
        kind: taxonomy id.
        onset_s: its first moment.
        end_s: its last moment.
        severity: all along it, 0..1.
        subject: what it is about.
    """

    kind: str
    onset_s: float
    end_s: float
    severity: float = SEVERITY
    subject: str = ""

    def __post_init__(self) -> None:
        within("episode.onset_s", self.onset_s, 0.0)
        within("episode.end_s", self.end_s, self.onset_s, above=True)
        within("episode.severity", self.severity, 0.0, 1.0)


class Timeline(msgspec.Struct, frozen=True):
    """A story of precursors.

    Attributes:
        id: kebab-case id.
        title: for people.
        episodes: in any order; those of one (kind, subject) do not touch.

    Raises:
        ConfigError: no episode, or two of one (kind, subject) that touch.
    """

    id: str
    title: str
    episodes: tuple[Episode, ...]

    def __post_init__(self) -> None:
        if not self.episodes:
            raise ConfigError(f"timeline {self.id}", "has no episodes")
        for a, b in pairwise(sorted(self.episodes, key=lambda e: (e.kind, e.subject, e.onset_s))):
            if (a.kind, a.subject) == (b.kind, b.subject) and b.onset_s <= a.end_s:
                problem = f"{a.kind} at {b.onset_s:g} s begins before it has ended at {a.end_s:g} s"
                raise ConfigError(f"timeline {self.id}", problem)

    @property
    def onsets_s(self) -> tuple[float, ...]:
        """First onset of every precursor, in order."""
        first: dict[tuple[str, str], float] = {}
        for e in self.episodes:
            first[e.kind, e.subject] = min(e.onset_s, first.get((e.kind, e.subject), math.inf))
        return tuple(sorted(first.values()))

    @property
    def end_s(self) -> float:
        """When the last condition ends: nothing raises P after it."""
        return max(e.end_s for e in self.episodes)

    def of_severity(self, severity: float) -> Timeline:
        """This timeline with every episode as severe."""
        episodes = tuple(msgspec.structs.replace(e, severity=severity) for e in self.episodes)
        return msgspec.structs.replace(self, episodes=episodes)


def timelines_of(kinds: Sequence[str]) -> tuple[Timeline, ...]:
    """The stories that the paper's three claims are about, for a cascade of three kinds (Table 3).

    ``isolated``: the first alone, for LONG_S. ``two``: the first two. ``cascade``: all three. ``decay``: all three,
    each for LONG_S, ending one after the other. BRIEF_S where nothing else is said.
    """
    onset = dict(zip(kinds, ONSETS_S, strict=True))

    def story(id_: str, title: str, chosen: Sequence[str], length_s: float) -> Timeline:
        return Timeline(id_, title, tuple(Episode(k, onset[k], onset[k] + length_s) for k in chosen))

    return (
        story("isolated", "one precursor that lasts", kinds[:1], LONG_S),
        story("two", "two of the three", kinds[:2], BRIEF_S),
        story("cascade", "the whole cascade", kinds, BRIEF_S),
        story("decay", "the cascade, lasting, then ending one by one", kinds, LONG_S),
    )
