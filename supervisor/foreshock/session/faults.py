"""Faults as a scenario declares them (``[[faults]]``): of sensors and their messages, of actuators, of detectors.

Each kind is a Struct of its own, so that a setting which a kind does not have is refused. What they do is in
``faulty``; that their names fit a twin and a supervisor is checked there, when both are known.
"""

from __future__ import annotations

import math
from typing import Any, Literal, TypeAlias

import msgspec

from foreshock._strict import convert, within
from foreshock.clock import ns
from foreshock.errors import ConfigError

__all__ = [
    "Bias",
    "Crash",
    "Delay",
    "Dropout",
    "Fault",
    "Freeze",
    "Ignored",
    "Late",
    "Loss",
    "Noise",
    "NotANumber",
    "SensorFault",
    "kind_of",
    "parse_faults",
]


class _Base(
    msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, tag_field="kind", tag=lambda n: n.lower()
):
    """When a fault holds.

    Attributes:
        from_s: simulated time at which it begins.
        until_s: at which it has ended; None lasts to the end of the run.
        probability: that it happens at all in a run, drawn once from a stream of its own. Of ``loss``: that a message
            is lost, drawn for each.
    """

    from_s: float = 0.0
    until_s: float | None = None
    probability: float = 1.0

    def __post_init__(self) -> None:
        place = f"faults.{kind_of(self)}"
        within(f"{place}.from_s", self.from_s, 0.0)
        if self.until_s is not None:
            within(f"{place}.until_s", self.until_s, self.from_s, above=True)
        within(f"{place}.probability", self.probability, 0.0, 1.0)

    def holds(self, t_ns: int) -> bool:
        """Whether t lies in from_s <= t < until_s."""
        return t_ns >= ns(self.from_s) and (self.until_s is None or t_ns < ns(self.until_s))


class SensorFault(_Base, frozen=True, kw_only=True):
    """channel: pattern (``fnmatch``) of the channels below the robot's name, judged by the samples' source stamps."""

    channel: str


class Dropout(SensorFault, frozen=True):
    """The sensor measures nothing: no messages, and its sequence numbers stand still meanwhile."""


class Loss(SensorFault, frozen=True):
    """The transport loses messages: their sequence numbers are missing."""


class Freeze(SensorFault, frozen=True):
    """The value stays what it was; stamps and sequence numbers go on as if it were measured."""


class NotANumber(SensorFault, frozen=True, tag="nan"):
    """Every float is NaN; a message without any is lost."""


class Delay(SensorFault, frozen=True, kw_only=True):
    """Messages arrive later by magnitude; their source stamps are what they were."""

    magnitude: float
    unit: Literal["s"] = "s"

    def __post_init__(self) -> None:
        super().__post_init__()
        within("faults.delay.magnitude", self.magnitude, 0.0)


class _OnFields(SensorFault, frozen=True, kw_only=True):
    """Settings of what changes numbers.

    Attributes:
        fields: of the message, e.g. ``position``, ``angular_velocity[2]``, ``humans.capsules.a``; without an index all
            elements.
        magnitude: what is added (bias), or the standard deviation of what is added (noise).
        unit: of magnitude, which must be that of the fields.
    """

    fields: tuple[str, ...]
    magnitude: float
    unit: str

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.fields:
            raise ConfigError(f"faults.{kind_of(self)}.fields", "empty; name the fields that it changes")


class Bias(_OnFields, frozen=True):
    """A constant is added."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if not math.isfinite(self.magnitude):
            raise ConfigError("faults.bias.magnitude", f"{self.magnitude!r} is not a finite number")


class Noise(_OnFields, frozen=True):
    """White Gaussian noise is added, independent per number and message."""

    def __post_init__(self) -> None:
        super().__post_init__()
        within("faults.noise.magnitude", self.magnitude, 0.0)


class _OnActions(_Base, frozen=True, kw_only=True):
    """actions: patterns (``fnmatch``) of the actions that it concerns, of those that the twin understands."""

    actions: tuple[str, ...] = ("*",)

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.actions:
            raise ConfigError(f"faults.{kind_of(self)}.actions", "empty; '*' means all")


class Late(_OnActions, frozen=True, kw_only=True):
    """Interventions and their releases take effect later by magnitude, in their order."""

    magnitude: float
    unit: Literal["s"] = "s"

    def __post_init__(self) -> None:
        super().__post_init__()
        within("faults.late.magnitude", self.magnitude, 0.0)


class Ignored(_OnActions, frozen=True):
    """The actuator obeys no command: what held before holds on. The supervisor is not told."""


class Crash(_Base, frozen=True, kw_only=True):
    """detector: id of the detector that raises in every update."""

    detector: str


Fault: TypeAlias = Dropout | Loss | Freeze | NotANumber | Delay | Bias | Noise | Late | Ignored | Crash


class _Table(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    faults: tuple[Fault, ...]


def kind_of(fault: _Base) -> str:
    """What the table calls it."""
    return str(fault.__struct_config__.tag)


def parse_faults(data: object, place: str) -> tuple[Fault, ...]:
    """A list of tables as faults.

    Raises:
        ConfigError: names place, key path, value and nearest name of the first thing that is wrong.
    """
    table: dict[str, Any] = {"faults": data}
    return convert(table, _Table, place).faults
