"""What a run was: its outcome, timeline and series."""

from __future__ import annotations

from typing import Literal, TypeAlias

import msgspec

from foreshock.records import Health, Intervention
from foreshock.twin import TwinEvent

__all__ = ["Arm", "Run", "TimelineRow"]

Arm: TypeAlias = Literal["on", "shadow", "off"]


class TimelineRow(msgspec.Struct, frozen=True):
    """A tick at which something changed, as in Table 4.

    Attributes:
        t_s: time of the tick.
        precursors: ``kind`` or ``kind@subject`` of the scenario's mode inside the window; new ones carry a ``+``.
        m: number of distinct precursors of the mode.
        q: number of their occurrences.
        probability: P of the mode.
        trust: T of the mode.
        control_trust: control-level trust of the mode.
        level: protection level of the mode, or minimal risk.
        interventions: action and strength of what changed.
        events: what happened in the plant.
    """

    t_s: float
    precursors: tuple[str, ...]
    m: float
    q: float
    probability: float
    trust: float
    control_trust: float
    level: str
    interventions: tuple[str, ...] = ()
    events: tuple[str, ...] = ()


class Run(msgspec.Struct, frozen=True):
    """What happened; never assumed.

    Attributes:
        scenario: its id.
        mode: its accident mode.
        supervisor: on, shadow or off.
        policy: what acted, or would have.
        seed: of all randomness.
        parameters: that were set.
        accident: whether an event of the scenario's mode happened.
        outcome: the first accident's id, else the first event's, else ``none``.
        events: everything that the referee saw.
        end_s: simulated time at the end.
        first_s: first time of each precursor kind of the mode, in s.
        gate_s: first time at the caution and protective level of the mode.
        interventions: all changes.
        ignored: actions that were decided or scripted but that the twin does not understand.
        health: all changes of detectors and channels.
        timeline: ticks at which something changed.
        series: columns over time, for plots; ``t_s`` is the first.
        digest: of all decisions, empty if not asked for.
        max_level: highest protection level of the mode, or minimal risk.
        warnings: what of the configuration leaves the scenario's mode unwatched or unprotected.
        peak_p: highest P of the mode before its accident; None if nobody judged.
        safe_s: since when the mode's control-level trust has been at its caution gate or above until the end, 0 if
            always; None if it was not at the end, the accident happened, or nobody judged.
    """

    scenario: str
    mode: str
    supervisor: Arm
    policy: str
    seed: int
    parameters: dict[str, float]
    accident: bool
    outcome: str
    events: tuple[TwinEvent, ...]
    end_s: float
    first_s: dict[str, float] = {}
    gate_s: dict[str, float] = {}
    interventions: tuple[Intervention, ...] = ()
    ignored: tuple[str, ...] = ()
    health: tuple[Health, ...] = ()
    timeline: tuple[TimelineRow, ...] = ()
    series: dict[str, list[float]] = {}
    digest: str = ""
    max_level: int = 0
    warnings: tuple[str, ...] = ()
    peak_p: float | None = None
    safe_s: float | None = None

    @property
    def harmed(self) -> bool:
        """Whether an accident of any mode happened; a touch or a load put down is an event, and no accident."""
        return any(e.mode for e in self.events)
