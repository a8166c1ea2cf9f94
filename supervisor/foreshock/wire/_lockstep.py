"""Stepping a twin by query: JSON that any simulator can speak, samples in it as base64 of CDR (docs/twins.md).

Key ``foreshock/<robot>/@/twin``. Each request names an operation; the reply is a JSON object, or a reply error with a
text. ``advance`` to the time that was reached already gives the same answer again, so that a request whose answer was
lost may be repeated.
"""

from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence

import msgspec

from foreshock.errors import WireError, nearest
from foreshock.records import Intervention, Sample
from foreshock.twin import TwinEvent
from foreshock.wire._codec import Codec
from foreshock.wire._ros import BY_ROS, ROS_NAMES
from foreshock.wire._types import rihs01

__all__ = [
    "PROTOCOL",
    "ChannelNote",
    "Hello",
    "Request",
    "Stepped",
    "WireSample",
    "check_hello",
    "pack_samples",
    "unpack_samples",
]

PROTOCOL = 1


class ChannelNote(msgspec.Struct, frozen=True):
    """A channel that a twin offers: name below the robot's, ROS 2 type, its RIHS01 hash, period."""

    name: str
    type: str
    hash: str
    period_ns: int


class Hello(msgspec.Struct, frozen=True):
    """What a twin declares when it is met.

    Attributes:
        protocol: version of this exchange.
        robot: whose channels they are.
        period_ns: communication step.
        stepped: time passes only in ``advance``.
        clock: ``simulated`` or ``real``.
        units: ``SI``; no other is spoken.
        frames: ``REP-103``: x forward, y left, z up.
        channels: that it streams.
        actions: that it understands.
    """

    protocol: int
    robot: str
    period_ns: int
    stepped: bool
    clock: str
    units: str
    frames: str
    channels: tuple[ChannelNote, ...]
    actions: tuple[str, ...]


class Request(msgspec.Struct, frozen=True, omit_defaults=True):
    """What is asked of a twin.

    Attributes:
        op: ``hello``, ``reset``, ``advance``, ``intervene``.
        parameters: of a reset.
        seed: of a reset.
        until_ns: of an advance.
        interventions: to apply before an advance, or alone.
    """

    op: str
    parameters: dict[str, float] = {}
    seed: int = 0
    until_ns: int = 0
    interventions: tuple[Intervention, ...] = ()


class WireSample(msgspec.Struct, frozen=True):
    """A sample: full channel, ROS 2 type, source time, sequence number, CDR in base64, arrival in simulated time."""

    channel: str
    type: str
    stamp_ns: int
    seq: int
    data: str
    received_ns: int = -1


class Stepped(msgspec.Struct, frozen=True):
    """Answer to an advance: samples since the last, all events since reset, truth for reports."""

    samples: tuple[WireSample, ...]
    events: tuple[TwinEvent, ...] = ()
    probes: dict[str, float | None] = {}


def pack_samples(samples: Iterable[Sample], codec: Codec) -> tuple[WireSample, ...]:
    """Samples as they go over the wire."""
    return tuple(
        [
            WireSample(
                s.channel,
                ROS_NAMES[type(s.value)],
                s.stamp_ns,
                s.seq,
                base64.b64encode(codec.encode(s.value, max(s.stamp_ns, 0))).decode(),
                s.received_ns,
            )
            for s in samples
        ]
    )


def unpack_samples(rows: Sequence[WireSample], codec: Codec) -> list[Sample]:
    """The inverse.

    Raises:
        WireError: an unknown type, or bytes that are not of it.
    """
    found = []
    for row in rows:
        cls = BY_ROS.get(row.type)
        if cls is None:
            raise WireError(row.channel, f"{row.type!r} is no type that Foreshock reads", nearest(row.type, BY_ROS))
        try:
            data = base64.b64decode(row.data, validate=True)
        except ValueError as e:
            raise WireError(row.channel, f"no base64: {e}") from None
        value, _ = codec.decode(cls, data)
        found.append(Sample(row.stamp_ns, row.channel, value, row.seq, row.received_ns))
    return found


def check_hello(hello: Hello, place: str, stepped: bool = True) -> None:
    """Refuse a twin that speaks something else.

    Args:
        hello: what it declares.
        place: who it is, for the error.
        stepped: it is to be stepped; else it streams on a clock of its own.

    Raises:
        WireError: names what differs.
    """
    clock = "simulated" if stepped else "real"
    expected = {"protocol": PROTOCOL, "units": "SI", "frames": "REP-103", "stepped": stepped, "clock": clock}
    for name, wanted in expected.items():
        if getattr(hello, name) != wanted:
            raise WireError(f"{place}: {name}", f"{getattr(hello, name)!r}, {wanted!r} is expected")
    for channel in hello.channels:
        if channel.type not in BY_ROS:
            known = nearest(channel.type, BY_ROS)
            raise WireError(f"{place}: {channel.name}", f"{channel.type!r} is no type that Foreshock reads", known)
        if channel.hash != rihs01(channel.type):
            said = f"{channel.type} has the hash {channel.hash}, here it is {rihs01(channel.type)}"
            raise WireError(f"{place}: {channel.name}", said)
