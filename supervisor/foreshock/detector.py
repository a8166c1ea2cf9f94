"""The detector port: what a precursor detector declares (DetectorSpec) and does (Detector)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal, Protocol, TypeAlias

import msgspec

from foreshock.messages import Message
from foreshock.records import Indication, Sample

__all__ = ["Detector", "DetectorSpec", "Input", "Inputs", "Isolation", "NoConfig"]

Isolation: TypeAlias = Literal["in-process", "process"]


class NoConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Configuration of a detector that has none."""


class Input(msgspec.Struct, frozen=True):
    """A channel that a detector reads.

    Attributes:
        name: the detector's own name for it, the key in Inputs.
        channel: ``<subject>/<quantity>`` below the robot's name, e.g. ``joints/state``; ``*`` reads every channel.
        type: the message type that it must carry.
        max_age_s: older than this, counted from its source stamp, it is stale.
        min_rate_hz: slower than this, counted over one second, it is late; 0 does not check.
        required: if stale, the whole detector is unobserved; an optional input is left out of Inputs.latest instead.
        max_standstill_s: if its values stay the same to the last bit for longer, counted in source stamps, it is
            frozen, which counts as stale; 0 does not check. For what is measured with noise, not for commands.
    """

    name: str
    channel: str
    type: type[Message]
    max_age_s: float = 0.1
    min_rate_hz: float = 0.0
    required: bool = True
    max_standstill_s: float = 0.0


class Inputs(msgspec.Struct, frozen=True):
    """What a detector gets to see in one update.

    Attributes:
        latest: newest valid sample per input name; a stale optional input is missing.
        new: samples since the previous update per input name, by arrival; empty tuple if none.
    """

    latest: Mapping[str, Sample]
    new: Mapping[str, Sequence[Sample]]


class Detector(Protocol):
    """Turns samples into indications. Synchronous and stateful; no clock, no global random source, no I/O."""

    def reset(self, seed: int) -> None:
        """Forget everything; afterwards the detector behaves like a new one."""

    def update(self, now_ns: int, inputs: Inputs) -> Sequence[Indication]:
        """One indication per declared kind and known subject, present or absent, at time now_ns.

        A declared kind that is missing from the answer counts as unobserved, as does a subject that was present
        before; so a subject that has left is reported absent for as long as it had been reported present.
        """


class DetectorSpec(msgspec.Struct, frozen=True):
    """What a detector declares.

    Attributes:
        id: kebab-case name, unique among the loaded detectors.
        kinds: taxonomy ids that it can report on.
        inputs: channels that it reads, or a function of its configuration that gives them.
        build: makes the detector from its configuration; imports heavy packages here, not at module level.
        config: frozen Struct of its settings, with defaults, forbid_unknown_fields.
        period_s: how often it is updated; 0 is every tick.
        deadline_s: CPU time that one update may take.
        warm_up_s: time after reset before it can observe.
        isolation: ``process`` runs it in a child process, where it can hang or crash without harm.
        extra: the extra of foreshock (or the distribution) that its heavy packages come with.
        summary: one line for ``foreshock detectors list``.
        reports: gives those of kinds that it reports under a configuration; None is all of them, under any.
    """

    id: str
    kinds: tuple[str, ...]
    inputs: tuple[Input, ...] | Callable[[Any], tuple[Input, ...]]
    build: Callable[[Any], Detector]
    config: type[msgspec.Struct] = NoConfig
    period_s: float = 0.0
    deadline_s: float = 0.005
    warm_up_s: float = 0.0
    isolation: Isolation = "in-process"
    extra: str = ""
    summary: str = ""
    reports: Callable[[Any], tuple[str, ...]] | None = None
