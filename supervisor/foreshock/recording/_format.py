"""What a journal file holds, beside its samples: names of topics and metadata, and the record of each tick."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping

import msgspec

from foreshock.journal import OperatorReset

__all__ = ["DECISION", "HEAD", "RESET", "TICK", "Head", "SampleNote", "TickRecord", "sample_digest"]

HEAD = "foreshock"
"""Name of the metadata record that comes first."""
TICK, DECISION, RESET = "/foreshock/tick", "/foreshock/decision", "/foreshock/operator_reset"
VERSION = 1


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


def sample_digest(chain: hashlib._Hash, note: SampleNote, payload: bytes) -> None:
    """Add a sample to the chain."""
    chain.update(msgspec.msgpack.encode((*msgspec.structs.astuple(note), len(payload))))
    chain.update(payload)


assert OperatorReset.__struct_fields__ == ("stamp_ns", "who", "why", "dimension")  # noqa: S101 # RESET's record
