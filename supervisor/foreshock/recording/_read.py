"""Reads a journal file tick by tick, up to its end or to where it is torn."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from foreshock.errors import BadInputError, WireError
from foreshock.journal import OperatorReset
from foreshock.recording._format import (
    DECISION,
    END,
    HEAD,
    RESET,
    TICK,
    End,
    Head,
    TickRecord,
    head_digest,
    sample_chain,
    sample_digest,
)
from foreshock.recording._records import DamagedError, Records
from foreshock.records import Sample
from foreshock.wire import BY_ROS, Codec

__all__ = ["JournalFile", "Tick", "is_journal"]


T = TypeVar("T")


class Tick(msgspec.Struct, frozen=True):
    """What a tick was given, in order: resets since the tick before, then samples; and what it concluded.

    Attributes:
        record: of the tick.
        samples: decoded.
        resets: by operators, before this tick.
        intact: whether the samples are those that were written, under their topics and times.
        decisions: those that stand before it, as JSON: one, in a file as it was written.
    """

    record: TickRecord
    samples: tuple[Sample, ...]
    resets: tuple[OperatorReset, ...]
    intact: bool
    decisions: tuple[bytes, ...]


def is_journal(path: Path) -> bool:
    """Whether a file is a journal of Foreshock."""
    try:
        JournalFile(path)
    except BadInputError:
        # one that cannot be read at all is told of by whoever opens it as a journal: it is no folder and no bag
        return path.is_file() and path.suffix == ".mcap" and not _is_mcap(path)
    return True


def _is_mcap(path: Path) -> bool:
    with path.open("rb") as file:
        return file.read(8) == b"\x89MCAP0\r\n"


class JournalFile:
    """A journal, opened for reading.

    Attributes:
        path: of the file.
        head: what a replay needs.
        complete: whether it was closed; this and what follows is known when all ticks were read.
        end: its end record; None if there is none.
        resets: by operators, after the last tick.
        rest: samples and decisions after the last tick, as a closed file never has them.
        records: of the file, with the number of bytes that could be read.

    Args:
        path: of the file.

    Raises:
        BadInputError: it is not a journal of Foreshock.
    """

    def __init__(self, path: Path) -> None:
        self.path, self.records = path, Records(path)
        self.complete, self.rest = False, 0
        self.resets: tuple[OperatorReset, ...] = ()
        self.end: End | None = None
        for record in self.records:
            if getattr(record, "name", "") == HEAD and hasattr(record, "metadata"):
                try:
                    self.head = msgspec.json.decode(record.metadata["head"], type=Head)
                    self.head_digest = head_digest(record.metadata["head"])
                except (KeyError, msgspec.MsgspecError) as e:
                    raise BadInputError(str(path), f"its head cannot be read: {e}") from None
                return
            if type(record).__name__ in ("Message", "Chunk"):
                break
        raise BadInputError(str(path), "is not a journal of Foreshock", "; a ROS 2 bag needs --config")

    def ticks(self) -> Iterator[Tick]:
        """Every whole tick.

        Raises:
            DamagedError: the file is damaged in its middle.
        """
        from mcap.records import Channel, DataEnd, Message, Schema

        schemas: dict[int, str] = {}
        channels: dict[int, tuple[str, str]] = {}
        codec = Codec()
        data = sample_chain()
        waiting: list[tuple[str, str, Any]] = []
        resets: list[OperatorReset] = []
        decisions: list[Any] = []
        tick = -1
        for record in self.records:
            if isinstance(record, Schema):
                schemas[record.id] = record.name
            elif isinstance(record, Channel):
                channels[record.id] = (record.topic, schemas.get(record.schema_id, ""))
            elif isinstance(record, DataEnd):
                self.complete = True
            elif isinstance(record, Message):
                topic, schema = channels.get(record.channel_id, ("", ""))
                if topic == TICK:
                    noted = self._json(record.data, TickRecord, tick)
                    tick = noted.tick
                    yield self._tick(noted, waiting, resets, decisions, data, codec)
                    waiting, resets, decisions = [], [], []
                elif topic == RESET:
                    resets.append(self._json(record.data, OperatorReset, tick))
                elif topic == DECISION:
                    decisions.append(record)
                elif topic == END:
                    self.end = self._json(record.data, End, tick)
                else:
                    waiting.append((topic, schema, record))
        self.resets, self.rest = tuple(resets), len(waiting) + len(decisions)

    def _json(self, data: bytes, cls: type[T], tick: int) -> T:
        try:
            return msgspec.json.decode(data, type=cls)
        except msgspec.MsgspecError as e:
            raise DamagedError(self.path, f"has a {cls.__name__} after tick {tick} that cannot be read: {e}") from None

    def _tick(
        self,
        record: TickRecord,
        given: Sequence[tuple[str, str, Any]],
        resets: Sequence[OperatorReset],
        decisions: Sequence[Any],
        data: hashlib._Hash,
        codec: Codec,
    ) -> Tick:
        if len(given) != len(record.samples):
            said = f"has {len(given)} samples of tick {record.tick}, which names {len(record.samples)}"
            raise DamagedError(self.path, said)
        samples, log_ns = [], max(record.now_ns, 0)
        intact = all(d.log_time == log_ns == d.publish_time for d in decisions)
        for note, (topic, schema, message) in zip(record.samples, given, strict=True):
            sample_digest(data, note, message.data)
            try:
                value, _ = codec.decode(BY_ROS[schema], message.data)
            except (WireError, KeyError) as e:
                raise BadInputError(f"{self.path}: tick {record.tick}: {note.channel}", str(e)) from None
            intact &= topic == f"/{note.channel}"
            intact &= (message.log_time, message.publish_time) == (log_ns, max(note.stamp_ns, 0))
            samples.append(Sample(note.stamp_ns, note.channel, value, note.seq, note.received_ns))
        intact &= data.hexdigest() == record.data
        return Tick(record, tuple(samples), tuple(resets), intact, tuple(d.data for d in decisions))
