"""What flows: Sample -> Indication -> Precursor -> RiskEstimate -> Trust -> Intervention, bundled in a Decision.

All records are frozen; times are integer nanoseconds on the source's timeline. Those made many times a tick are not
tracked by the garbage collector: frozen trees of values cannot be part of a cycle.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Literal, TypeAlias

import msgspec

from foreshock.messages import AnyMessage

__all__ = [
    "Attribution",
    "ChannelState",
    "Decision",
    "Explanation",
    "Health",
    "Indication",
    "Intervention",
    "Lease",
    "Phase",
    "Precursor",
    "ProtectionLevel",
    "RiskEstimate",
    "Sample",
    "SampleRef",
    "Trust",
]

Phase: TypeAlias = Literal["onset", "ongoing", "cleared"]
ChannelState: TypeAlias = Literal["ok", "late", "stale", "failed", "unobserved", "warm-up"]


class ProtectionLevel(IntEnum):
    """How strongly the robot is protected; totally ordered."""

    NORMAL = 0
    CAUTION = 1
    PROTECTIVE = 2
    MINIMAL_RISK = 3


class Sample(msgspec.Struct, frozen=True, gc=False):
    """One message on one channel.

    Attributes:
        stamp_ns: when the source measured it.
        channel: ``<robot>/<subject>/<quantity>``.
        value: the typed message.
        seq: the stream's own sequence number, from 0; -1 where the source has none.
        received_ns: when it arrived, on the receiver's timeline; -1 means at once.
    """

    stamp_ns: int
    channel: str
    value: AnyMessage
    seq: int = -1
    received_ns: int = -1


class SampleRef(msgspec.Struct, frozen=True, gc=False):
    """Points to a sample as evidence."""

    channel: str
    stamp_ns: int


class Indication(msgspec.Struct, frozen=True, gc=False):
    """What a detector says of one of its kinds and one subject, every period. Absence is said, not implied.

    Attributes:
        kind: taxonomy id, e.g. ``foot-micro-slip``.
        subject: what it is about: a foot, a gripper, a human's track id; ``""`` for the whole robot.
        stamp_ns: source time of the newest sample behind it.
        present: the detector's verdict after its own hysteresis.
        statistic: the number that was judged, in unit.
        threshold: what it was judged against, in unit.
        unit: SI unit of both; ``"1"`` if dimensionless.
        severity: 0 (at the threshold) .. 1 (as bad as the detector can tell).
        evidence: the samples behind it.
        time_to_event_s: predicted time until the accident, where the detector can predict one.
        measures: further figures for people, plots and journals; never judged by the core.
    """

    kind: str
    subject: str
    stamp_ns: int
    present: bool
    statistic: float
    threshold: float
    unit: str
    severity: float = 1.0
    evidence: tuple[SampleRef, ...] = ()
    time_to_event_s: float | None = None
    measures: dict[str, float] = {}


class Precursor(msgspec.Struct, frozen=True, gc=False):
    """Evidence of one kind about one subject inside the window.

    Attributes:
        kind: taxonomy id.
        subject: what it is about.
        phase: onset (this tick), ongoing, or cleared (absent now, still inside the window).
        severity: the window's maximum, 0..1.
        occurrences: its share of q.
        weight: its share of m: 1 for the boxcar window, less with an exponential kernel.
        onset_ns: source stamp of the first onset that still counts.
        onsets_ns: source stamps of all onsets that still count, sorted; empty means onset_ns alone.
        detector: who saw it (the strongest, if several).
        frozen: nobody observes it now, so that its clock stands still.
        statistic: last judged number.
        threshold: what it was judged against.
        unit: SI unit of both.
        evidence: the samples behind it.
    """

    kind: str
    subject: str
    phase: Phase
    severity: float
    occurrences: float
    weight: float
    onset_ns: int
    detector: str
    frozen: bool = False
    statistic: float = 0.0
    threshold: float = 0.0
    unit: str = "1"
    evidence: tuple[SampleRef, ...] = ()
    onsets_ns: tuple[int, ...] = ()


class Attribution(msgspec.Struct, frozen=True):
    """By how much P falls if one precursor is left out."""

    kind: str
    subject: str
    share: float


class Explanation(msgspec.Struct, frozen=True):
    """Why P is what it is, overall or for one accident mode.

    Attributes:
        mode: code of the accident mode; ``""`` for overall.
        probability: P that actions are taken on.
        attribution: by how much that P falls if one precursor is left out, the largest first.
        gate: of trust, that the smallest set is about.
        smallest: the fewest precursors that alone keep T = 1 - P below the gate; empty if all of them do not.
    """

    mode: str
    probability: float
    attribution: tuple[Attribution, ...]
    gate: float
    smallest: tuple[tuple[str, str], ...]


class RiskEstimate(msgspec.Struct, frozen=True):
    """Accident probability, with its bounds and the counts behind it.

    Attributes:
        probability: P of Eq. 1, 0..1, on all precursors.
        lower: lower bound of P over what the model does not know.
        upper: upper bound; trust is built on it by default.
        m: number of distinct (kind, subject) pairs; the effective number where they correlate.
        q: number of their occurrences; likewise.
        by_mode: P per accident mode, on the kinds that belong to the mode.
        by_class: P per precursor class.
        counts: (m, q) per accident mode.
        upper_by_mode: upper bound per accident mode.
        upper_by_class: upper bound per precursor class.
    """

    probability: float
    lower: float
    upper: float
    m: float
    q: float
    by_mode: dict[str, float] = {}
    by_class: dict[str, float] = {}
    counts: dict[str, tuple[float, float]] = {}
    upper_by_mode: dict[str, float] = {}
    upper_by_class: dict[str, float] = {}


class Trust(msgspec.Struct, frozen=True):
    """T = 1 - P (Eq. 2), and the control-level trust <= T that gates actions.

    Attributes:
        trust: T overall.
        control_trust: T with recovery time and caps for what is not observed.
        by_mode: T per accident mode.
        control_by_mode: control-level trust per accident mode.
        by_class: T per precursor class.
        coverage: share of the configured kinds that are observed now, 0..1.
        unobserved: the configured kinds that are not.
        control_by_class: control-level trust per precursor class.
        coverage_by_mode: coverage per accident mode; 0 where no configured detector watches it.
    """

    trust: float
    control_trust: float
    by_mode: dict[str, float] = {}
    control_by_mode: dict[str, float] = {}
    by_class: dict[str, float] = {}
    coverage: float = 1.0
    unobserved: tuple[str, ...] = ()
    control_by_class: dict[str, float] = {}
    coverage_by_mode: dict[str, float] = {}


class Intervention(msgspec.Struct, frozen=True, gc=False):
    """An action asked of the robot. It persists until it is replaced or released (strength 0).

    Attributes:
        stamp_ns: tick that decided it.
        action: action id, e.g. ``step-suppression``.
        strength: 0 (released) .. 1 (full).
        mode: accident mode that it is meant for; ``""`` for all.
        reasons: the rule and the precursors behind it, for people.
    """

    stamp_ns: int
    action: str
    strength: float
    mode: str = ""
    reasons: tuple[str, ...] = ()


class Lease(msgspec.Struct, frozen=True):
    """Permission to move at all until guard_ns + ttl_ns on the robot's own clock.

    nonce and guard_ns are echoes of the robot-side guard's request, so that a delayed lease never renews;
    a higher epoch fences off an older supervisor.
    """

    epoch: int
    nonce: int
    guard_ns: int
    ttl_ns: int


class Health(msgspec.Struct, frozen=True):
    """State of a detector or channel, with the reason; recorded when it changes."""

    stamp_ns: int
    source: str
    state: ChannelState
    reason: str = ""


class Decision(msgspec.Struct, frozen=True):
    """All that one tick concluded.

    Attributes:
        now_ns: time of the tick.
        tick: number of the tick since reset, from 0.
        precursors: all evidence inside the window.
        risk: probability and counts.
        trust: trust and control-level trust.
        level: protection level over all modes.
        levels: protection level per accident mode.
        interventions: the actions that hold now, strength > 0.
        changes: interventions that the robot must be told of: new, changed, released.
        health: what changed in the state of detectors and channels.
        motion_permitted: whether a lease may be granted.
        time_to_event_s: the shortest predicted time to an accident, if one is predicted.
        indications: what the detectors said in this tick.
        class_levels: protection level per precursor class.
        explanations: why, in a tick in which the level of a mode or the overall level rose.
    """

    now_ns: int
    tick: int
    precursors: tuple[Precursor, ...]
    risk: RiskEstimate
    trust: Trust
    level: ProtectionLevel
    levels: dict[str, ProtectionLevel]
    interventions: tuple[Intervention, ...]
    changes: tuple[Intervention, ...]
    health: tuple[Health, ...]
    motion_permitted: bool
    time_to_event_s: float | None = None
    indications: tuple[Indication, ...] = ()
    class_levels: dict[str, ProtectionLevel] = {}
    explanations: tuple[Explanation, ...] = ()
