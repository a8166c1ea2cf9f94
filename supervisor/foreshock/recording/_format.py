"""What a journal file holds, beside its samples: names of topics and metadata, and the record of each tick."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping

import msgspec

from foreshock.journal import OperatorReset

__all__ = [
    "DECISION",
    "END",
    "HEAD",
    "RESET",
    "TICK",
    "End",
    "Head",
    "SampleNote",
    "TickRecord",
    "head_digest",
    "sample_chain",
    "sample_digest",
]

HEAD = "foreshock"
"""Name of the metadata record that comes first."""
TICK, DECISION, RESET = "/foreshock/tick", "/foreshock/decision", "/foreshock/operator_reset"
END = "/foreshock/end"
VERSION = 2
"""1 had no end record."""


class Head(msgspec.Struct, frozen=True):
    """What a replay needs beside the samples.

    Attributes:
        config: the supervisor's configuration, as it was read.
        base: folder that its relative paths start from.
        seed: that the detectors were reset with.
        began_ns: when the supervisor was reset, on its timeline.
        version: of this format.
        foreshock: version of the program that wrote it.
        python: version and platform, since floating-point libraries differ between platforms.
        plugins: distribution and version of every detector and policy.
        segment: number of the file within its run; one above 0 begins in the middle.
    """

    config: dict[str, object]
    base: str
    seed: int
    began_ns: int
    version: int = VERSION
    foreshock: str = ""
    python: str = ""
    plugins: dict[str, str] = {}
    segment: int = 0


class SampleNote(msgspec.Struct, frozen=True, array_like=True):
    """Of one sample what MCAP has no exact place for: channel, source time, sequence number, arrival."""

    channel: str
    stamp_ns: int
    seq: int
    received_ns: int


class TickRecord(msgspec.Struct, frozen=True):
    """One tick: when, on which samples (those before it in the file, in order), with which verdicts, and the chains.

    Attributes:
        now_ns: time of the tick.
        tick: its number.
        samples: those that it was given.
        verdicts: see Supervisor.verdicts_of.
        decisions: hash chain over all decisions so far.
        data: hash chain over all samples so far: payload and note.
    """

    now_ns: int
    tick: int
    samples: tuple[SampleNote, ...]
    verdicts: Mapping[str, str]
    decisions: str
    data: str


class End(msgspec.Struct, frozen=True):
    """The last message of a closed file, so that one that was cut short is told from a whole one.

    Attributes:
        ticks: how many are in the file.
        decisions: hash chain over all decisions and resets; empty (not known) where a recovered file ends in resets.
        data: hash chain over all samples, at the last tick.
        head: SHA-256 of the head, as it is written.
        left_out: what `journal recover` could not save of the file that this one was made of; empty for a run's own.
    """

    ticks: int
    decisions: str
    data: str
    head: str
    left_out: str = ""


def head_digest(head: str) -> str:
    """Of a head, as it is written."""
    return hashlib.sha256(head.encode()).hexdigest()


def sample_chain() -> hashlib._Hash:
    """The chain over samples, before the first."""
    return hashlib.sha256(b"foreshock samples 1")


def sample_digest(chain: hashlib._Hash, note: SampleNote, payload: bytes) -> None:
    """Add a sample to the chain."""
    chain.update(msgspec.msgpack.encode((*msgspec.structs.astuple(note), len(payload))))
    chain.update(payload)


assert OperatorReset.__struct_fields__ == ("stamp_ns", "who", "why", "dimension")  # noqa: S101 # RESET's record
