"""A coded event: the fields of the paper's coding template (sections 2.1 and 3.1) as frozen records."""

from __future__ import annotations

import msgspec

__all__ = ["DEVIATIONS", "NO_ACCIDENT", "SYNTHETIC", "TASKS", "Event", "EventPrecursor"]

TASKS = (
    "assembly",
    "inspection",
    "logistics",
    "maintenance",
    "fastening",
    "handover",
    "navigation",
    "co-carrying",
    "balance-recovery",
)
"""The nine task categories of section 3.1."""

DEVIATIONS = ("kinematic", "perceptual", "human-behavioural")
"""The deviation characteristics of the template (section 2.1)."""

NO_ACCIDENT = "none"
"""The outcome of a near miss or of nominal operation."""

SYNTHETIC = "synthetic"
"""The source of events that nobody observed; their ids begin with it too."""


class EventPrecursor(msgspec.Struct, frozen=True):
    """One precursor of an event; times in s from the event's start.

    Attributes:
        kind: taxonomy id.
        onset_s: when it began, at least 0.
        end_s: when it was over; None: it lasted to the outcome, or to the end of observation.
        severity: 0..1.
        subject: which part or person, e.g. ``left-foot``; empty if there is but one.
    """

    kind: str
    onset_s: float
    end_s: float | None = None
    severity: float = 1.0
    subject: str = ""


class Event(msgspec.Struct, frozen=True):
    """One event as one coder saw it; (id, coder) is unique, and one id with two coders is a double coding.

    Free text may be empty, which means that it was not coded.

    Attributes:
        id: of the event, not of the coding.
        task: one of TASKS.
        platform: the robot.
        environment: where, in words.
        spatial_relation: of human and robot, in words.
        deviation: some of DEVIATIONS.
        precursors: in any order; a kind may come several times.
        escalation: how one led to the other, in words.
        outcome: code of an accident mode, or ``none``.
        outcome_s: when the accident happened, in s; None exactly if there was none.
        observed_s: for how long the event was observed, in s.
        coder: who coded it.
        group: events that must stay on one side of a cross-validation (a video, a run); by default the id.
        source: ``coded``, ``simulated``, ``synthetic``.
    """

    id: str
    task: str
    platform: str
    environment: str
    spatial_relation: str
    deviation: tuple[str, ...]
    precursors: tuple[EventPrecursor, ...]
    escalation: str
    outcome: str
    outcome_s: float | None
    observed_s: float
    coder: str
    group: str = ""
    source: str = ""

    def __post_init__(self) -> None:
        if not self.group:
            msgspec.structs.force_setattr(self, "group", self.id)

    @property
    def accident(self) -> bool:
        """Whether it ended in an accident."""
        return self.outcome != NO_ACCIDENT

    @property
    def until_s(self) -> float:
        """When its precursors stop to matter: at the outcome, else at the end of observation."""
        return self.observed_s if self.outcome_s is None else self.outcome_s

    def end_of(self, precursor: EventPrecursor) -> float:
        """When one of its precursors was over, in s; not after the outcome."""
        return self.until_s if precursor.end_s is None else min(precursor.end_s, self.until_s)
