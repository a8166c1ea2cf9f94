"""The twin port: whatever stands for the robot and its world, in process, an FMU, MuJoCo or a remote simulator."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol, TypeAlias, runtime_checkable

import msgspec

from foreshock.records import Intervention, Sample

__all__ = [
    "Caption",
    "Channel",
    "Parameters",
    "Pictures",
    "Recorder",
    "Take",
    "Twin",
    "TwinBuilder",
    "TwinEvent",
    "TwinSpec",
]

Parameters: TypeAlias = Mapping[str, float]


class Channel(msgspec.Struct, frozen=True):
    """A channel that a twin declares: its name below the robot's, message type name and period in ns."""

    name: str
    type: str
    period_ns: int


class TwinEvent(msgspec.Struct, frozen=True):
    """Something that happened in the plant, seen by nobody but the referee: an accident, a contact, a recovery.

    Attributes:
        stamp_ns: when it happened.
        id: event id, e.g. ``fall-onto-human``.
        mode: accident mode if the event is an accident, else ``""``.
        value: the physical quantity that decided it.
        limit: what it was compared with.
        unit: SI unit of both.
    """

    stamp_ns: int
    id: str
    mode: str
    value: float
    limit: float
    unit: str


class Twin(Protocol):
    """A robot and its world. The same twin gives the same samples however it is hosted."""

    @property
    def channels(self) -> Sequence[Channel]:
        """What it streams."""

    @property
    def period_ns(self) -> int:
        """Communication step."""

    @property
    def stepped(self) -> bool:
        """True if time passes only in advance(); False if it runs on a clock of its own."""

    @property
    def actions(self) -> frozenset[str]:
        """Action ids that it understands; others are ignored."""

    def reset(self, parameters: Parameters, seed: int) -> None:
        """Back to time 0 with these parameter values; all randomness follows from the seed."""

    def advance(self, until_ns: int) -> Sequence[Sample]:
        """Run to until_ns and give the samples that were measured on the way, by source stamp.

        Raises:
            TwinError: the model failed; the twin must be reset or closed.
        """

    def intervene(self, intervention: Intervention) -> None:
        """Apply an intervention from now on."""

    def events(self) -> Sequence[TwinEvent]:
        """Events since reset, by time. For the referee; detectors never see them."""

    def probes(self) -> Mapping[str, float]:
        """Ground truth now, for reports. Detectors never see it."""

    def close(self) -> None:
        """Free everything; idempotent."""


class TwinBuilder(Protocol):
    """Makes a twin; scratch is a private directory that its owner removes."""

    def __call__(self, config: Any, robot: str, scratch: Path) -> Twin:
        """The twin for a robot of this name."""
        ...


@runtime_checkable
class Recorder(Protocol):
    """What a twin offers besides, if pictures can be made of its runs: it keeps what moved."""

    def record(self, rate_hz: float) -> None:
        """Keep what moved at about this rate, from the next reset on; 0 keeps nothing."""

    def save(self, path: Path) -> None:
        """Write what was kept since the reset into a file for the pictures of its kind of twin."""


class Caption(msgspec.Struct, frozen=True):
    """What is known of a run from a time on, to be written above its picture.

    Attributes:
        t_s: from when.
        text: short: a protection level and what is done.
        trust: T, 0..1; None where nobody judges.
        alarm: what has happened, e.g. ``fall``; empty if nothing has.
    """

    t_s: float
    text: str = ""
    trust: float | None = None
    alarm: str = ""


class Take(msgspec.Struct, frozen=True):
    """A run to be shown.

    Attributes:
        title: above the picture.
        recording: the file that its twin saved.
        captions: by time.
    """

    title: str
    recording: Path
    captions: tuple[Caption, ...] = ()


class Pictures(Protocol):
    """Shows runs side by side."""

    def __call__(self, config: Any, takes: Sequence[Take], times_s: Sequence[float], files: Sequence[Path]) -> None:
        """Write files: ``.mp4`` or ``.gif`` is a film of all of it in real time, ``.png`` stills at these times.

        Raises:
            MissingExtraError: a package is not installed.
            NoOpenGLError: nothing can be drawn on this machine.
        """
        ...


class TwinSpec(msgspec.Struct, frozen=True):
    """A kind of twin that a plugin offers.

    Attributes:
        id: what ``--twin`` and a scenario's ``twin`` name, e.g. ``fmi``.
        build: makes one from the scenario's ``[twin]`` table, the robot's name and a private scratch directory.
        config: frozen Struct of the ``[twin]`` table without its ``kind``.
        summary: one line for people.
        files: the files that a twin of this configuration consists of, by role: its FMU, its binding. A campaign knows
            by their content whether it is still the same twin. None if the kind has none, or cannot say.
        pictures: draws what twins of this kind have saved, see Recorder; None if the kind has no pictures.
    """

    id: str
    build: TwinBuilder
    config: type[msgspec.Struct]
    summary: str = ""
    files: Callable[[Any], Mapping[str, Path]] | None = None
    pictures: Pictures | None = None
