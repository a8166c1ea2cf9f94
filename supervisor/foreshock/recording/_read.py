"""Reads a journal file tick by tick, up to its end or to where it is torn."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from foreshock.errors import BadInputError, MissingExtraError, WireError
from foreshock.journal import OperatorReset
from foreshock.recording._format import DECISION, HEAD, RESET, TICK, Head, TickRecord, sample_digest
from foreshock.records import Sample
from foreshock.wire import BY_ROS, Codec

__all__ = ["JournalFile", "Tick", "is_journal", "records_of"]


T = TypeVar("T")


class Tick(msgspec.Struct, frozen=True):
    """What a tick was given, in order: resets since the tick before, then samples; and what it concluded.

    Attributes:
        record: of the tick.
        samples: decoded.
        resets: by operators, before this tick.
        intact: whether the samples are those that were written.
    """

    record: TickRecord
    samples: tuple[Sample, ...]
    resets: tuple[OperatorReset, ...]
    intact: bool


def records_of(path: Path) -> Iterator[Any]:
    """MCAP records of the data section, out of their chunks; ends without an error where the file is torn.

    Raises:
        BadInputError: it is no MCAP file, or not even its beginning is there.
        MissingExtraError: mcap is not installed.
    """
    try:
        from mcap.exceptions import EndOfFile
        from mcap.stream_reader import StreamReader
    except ImportError as e:
        hint = "; run: pip install 'foreshock[zenoh]'"
        raise MissingExtraError("journal", f"{e.name} is not installed", hint) from e
    if not path.is_file():
        raise BadInputError(str(path), "is no file")
    with path.open("rb") as file:
        reader = StreamReader(file, validate_crcs=True)
        count = 0
        try:
            for record in reader.records:
                count += 1
                yield record
        except EndOfFile:
            if not count:
                raise BadInputError(str(path), "ends before the first record of an MCAP file") from None
        except Exception as e:  # noqa: BLE001 # damaged bytes make the reader raise anything
            raise BadInputError(
                str(path), f"is no MCAP file, or damaged after record {count}: {type(e).__name__}: {e}"
            ) from None


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

    Args:
        path: of the file.

    Raises:
        BadInputError: it is not a journal of Foreshock.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.complete = False
        for record in records_of(path):
            if getattr(record, "name", "") == HEAD and hasattr(record, "metadata"):
                try:
                    self.head = msgspec.json.decode(record.metadata["head"], type=Head)
                except (KeyError, msgspec.MsgspecError) as e:
                    raise BadInputError(str(path), f"its head cannot be read: {e}") from None
                return
            if type(record).__name__ in ("Message", "Chunk"):
                break
        raise BadInputError(str(path), "is not a journal of Foreshock", "; a ROS 2 bag needs --config")

    def ticks(self) -> Iterator[Tick]:
        """Every whole tick.

        Raises:
            BadInputError: the file is damaged in its middle.
        """
        from mcap.records import Channel, DataEnd, Message, Schema

        schemas: dict[int, str] = {}
        channels: dict[int, tuple[str, str]] = {}
        codec = Codec()
        data = hashlib.sha256(b"foreshock samples 1")
        waiting: list[tuple[str, bytes]] = []
        resets: list[OperatorReset] = []
        tick = -1
        for record in records_of(self.path):
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
                    yield self._tick(noted, waiting, resets, data, codec)
                    waiting, resets = [], []
                elif topic == RESET:
                    resets.append(self._json(record.data, OperatorReset, tick))
                elif topic != DECISION:
                    waiting.append((schema, record.data))

    def _json(self, data: bytes, cls: type[T], tick: int) -> T:
        try:
            return msgspec.json.decode(data, type=cls)
        except msgspec.MsgspecError as e:
            raise BadInputError(str(self.path), f"a {cls.__name__} after tick {tick} cannot be read: {e}") from None

    def _tick(
        self,
        record: TickRecord,
        payloads: list[tuple[str, bytes]],
        resets: list[OperatorReset],
        data: hashlib._Hash,
        codec: Codec,
    ) -> Tick:
        if len(payloads) != len(record.samples):
            said = f"tick {record.tick} names {len(record.samples)} samples, {len(payloads)} are there"
            raise BadInputError(str(self.path), said)
        samples = []
        for note, (schema, payload) in zip(record.samples, payloads, strict=True):
            sample_digest(data, note, payload)
            try:
                value, _ = codec.decode(BY_ROS[schema], payload)
            except (WireError, KeyError) as e:
                raise BadInputError(f"{self.path}: tick {record.tick}: {note.channel}", str(e)) from None
            samples.append(Sample(note.stamp_ns, note.channel, value, note.seq, note.received_ns))
        return Tick(record, tuple(samples), tuple(resets), data.hexdigest() == record.data)
