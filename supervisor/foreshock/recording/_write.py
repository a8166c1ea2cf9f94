"""The journal as an MCAP file: samples as ROS 2 messages, ticks and decisions as JSON.

Foxglove and PlotJuggler read it. Chunks are small and go to the operating system at once, so that a killed process
loses at most the last one; :class:`foreshock.recording.JournalFile` reads a torn file up to where it is torn.
"""

from __future__ import annotations

import os
import platform
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from importlib.metadata import version
from pathlib import Path
from typing import Any, BinaryIO

import msgspec

from foreshock.errors import BadInputError, MissingExtraError
from foreshock.journal import NO_VERDICTS, DigestJournal, OperatorReset
from foreshock.recording._format import (
    DECISION,
    END,
    HEAD,
    RESET,
    TICK,
    End,
    Head,
    SampleNote,
    TickRecord,
    head_digest,
    sample_chain,
    sample_digest,
)
from foreshock.records import Decision, Sample
from foreshock.wire import ROS_NAMES, Codec, encode_reference, typestore

__all__ = ["McapJournal", "check_writable"]

CHUNK_BYTES = 16_384


class McapJournal:
    """Writes one file.

    Args:
        path: of the file; it must not exist yet.
        head: what a replay needs.
        sync_s: the file is forced to the disk (fsync) when so much time has passed on the supervisor's timeline; a
            killed process loses nothing without it, a power cut does.

    Raises:
        BadInputError: the file exists, or cannot be written: here, and in every method, as when the disk is full.
            Nothing more is written then, and what was can be recovered.
        MissingExtraError: mcap or rosbags is not installed.
    """

    def __init__(self, path: Path, head: Head, sync_s: float = 1.0) -> None:
        try:
            from mcap.writer import CompressionType, Writer
        except ImportError as e:
            hint = "; run: pip install 'foreshock[zenoh]'"
            raise MissingExtraError("journal", f"{e.name} is not installed", hint) from e
        self._file = _created(path)
        self.path, self._closed = path, False
        self._writer: Any = Writer(self._file, CHUNK_BYTES, CompressionType.ZSTD)
        head = msgspec.structs.replace(
            head, foreshock=version("foreshock"), python=f"{platform.python_version()} {platform.machine()}"
        )
        text = msgspec.json.encode(head).decode()
        with self._writes():
            self._writer.start("ros2", f"foreshock {version('foreshock')}")
            self._writer.add_metadata(HEAD, {"head": text})
            self._file.flush()
        self._codec = Codec()
        self._schemas: dict[str, int] = {}
        self._channels: dict[tuple[str, str], int] = {}
        self._json = {t: self._json_channel(t) for t in (TICK, DECISION, RESET, END)}
        self._chain = DigestJournal()
        self._data = sample_chain()
        self._ticks, self._now_ns, self._ended = 0, 0, (self._data.hexdigest(), head_digest(text))
        self._sync_ns, self._synced_ns = round(sync_s * 1e9), -1

    @property
    def digest(self) -> str:
        """Of all decisions so far."""
        return self._chain.digest

    def tick(self, samples: Sequence[Sample], decision: Decision, verdicts: Mapping[str, str] = NO_VERDICTS) -> None:
        """Write samples, tick and decision."""
        now_ns = decision.now_ns
        # all are encoded before any is written: one that cannot be leaves no half tick
        given = [self._sample(s) for s in samples]
        self._chain.tick(samples, decision, verdicts)
        data = self._data.hexdigest()
        notes = tuple([note for note, _, _ in given])
        record = TickRecord(now_ns, decision.tick, notes, dict(verdicts), self._chain.digest, data)
        with self._writes():
            for note, channel, payload in given:
                self._add(channel, now_ns, note.stamp_ns, payload, max(note.seq, 0) % (1 << 32))
            self._add(self._json[DECISION], now_ns, now_ns, msgspec.json.encode(decision), decision.tick)
            self._add(self._json[TICK], now_ns, now_ns, msgspec.json.encode(record), decision.tick)
            self._file.flush()
            if now_ns - self._synced_ns >= self._sync_ns:
                self._synced_ns = now_ns
                os.fsync(self._file.fileno())
        self._ticks, self._now_ns, self._ended = self._ticks + 1, now_ns, (data, self._ended[1])

    def operator_reset(self, record: OperatorReset) -> None:
        """Write an operator's reset."""
        self._chain.operator_reset(record)
        with self._writes():
            self._add(self._json[RESET], record.stamp_ns, record.stamp_ns, msgspec.json.encode(record), 0)

    def close(self) -> None:
        """Write the end record and finish the file; idempotent."""
        if not self._closed:
            self._closed = True
            end = End(self._ticks, self._chain.digest, *self._ended)
            with self._writes():
                self._add(self._json[END], self._now_ns, self._now_ns, msgspec.json.encode(end), 0)
                self._writer.finish()
                self._file.close()

    @contextmanager
    def _writes(self) -> Iterator[None]:
        try:
            yield
        except OSError as e:
            self._closed = True
            with suppress(OSError):
                self._file.close()
            hint = f"; what is there can be saved with: foreshock journal recover {self.path} OUT"
            raise BadInputError(str(self.path), f"cannot be written: {e.strerror or e}", hint) from None

    def _sample(self, sample: Sample) -> tuple[SampleNote, int, bytes]:
        note = SampleNote(sample.channel, sample.stamp_ns, sample.seq, sample.received_ns)
        value = sample.value
        # a stamp before 1970 fits no ROS header: the note has it
        stamp_ns = max(0, sample.stamp_ns)
        payload = self._codec.encode(value, stamp_ns) if sample.stamp_ns >= 0 else encode_reference(value, 0)
        sample_digest(self._data, note, payload)
        return note, self._ros_channel(sample.channel, ROS_NAMES[type(value)]), payload

    def _add(self, channel: int, log_ns: int, publish_ns: int, data: bytes, sequence: int) -> None:
        self._writer.add_message(channel, max(log_ns, 0), data, max(publish_ns, 0), sequence)

    def _ros_channel(self, channel: str, ros: str) -> int:
        key = (channel, ros)
        if key not in self._channels:
            if ros not in self._schemas:
                text, _ = typestore().generate_msgdef(ros, ros_version=2)
                self._schemas[ros] = self._writer.register_schema(ros, "ros2msg", text.encode())
            self._channels[key] = self._writer.register_channel(f"/{channel}", "cdr", self._schemas[ros])
        return self._channels[key]

    def _json_channel(self, topic: str) -> int:
        cls = {TICK: TickRecord, DECISION: Decision, RESET: OperatorReset, END: End}[topic]
        schema = msgspec.json.encode(_open(msgspec.json.schema(cls)))
        found: int = self._writer.register_channel(
            topic, "json", self._writer.register_schema(cls.__name__, "jsonschema", schema)
        )
        return found


def check_writable(path: Path) -> None:
    """Whether a journal can be made here later; its folder is made now.

    Raises:
        BadInputError: it cannot.
    """
    _created(path).close()
    path.unlink()


def _created(path: Path) -> BinaryIO:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        return path.open("xb")
    except FileExistsError as e:
        if e.filename != str(path):
            raise BadInputError(str(path), f"cannot be made: {e.filename} is no folder") from None
        raise BadInputError(str(path), "exists; a journal is never overwritten", "; choose another name") from None
    except OSError as e:
        raise BadInputError(str(path), f"cannot be made: {e.strerror or e}") from None


def _open(schema: dict[str, Any]) -> dict[str, Any]:
    """A JSON schema whose root is an object, as readers of MCAP want it."""
    root = dict(schema)
    if "$ref" in root:
        name = root.pop("$ref").rsplit("/", 1)[-1]
        root = {**root["$defs"][name], **root}
    return root
