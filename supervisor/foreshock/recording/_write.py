"""The journal as an MCAP file: samples as ROS 2 messages, ticks and decisions as JSON.

Foxglove and PlotJuggler read it. Chunks are small and go to the operating system at once, so that a killed process
loses at most the last one; :func:`foreshock.recording.read_journal` reads a torn file up to where it is torn.
"""

from __future__ import annotations

import hashlib
import os
import platform
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

import msgspec

from foreshock.errors import BadInputError, MissingExtraError
from foreshock.journal import NO_VERDICTS, DigestJournal, OperatorReset
from foreshock.recording._format import DECISION, HEAD, RESET, TICK, Head, SampleNote, TickRecord, sample_digest
from foreshock.records import Decision, Sample
from foreshock.wire import ROS_NAMES, Codec, encode_reference, typestore

__all__ = ["McapJournal"]

CHUNK_BYTES = 16_384


class McapJournal:
    """Writes one file.

    Args:
        path: of the file; it must not exist yet.
        head: what a replay needs.
        sync_s: the file is forced to the disk (fsync) when so much time has passed on the supervisor's timeline; a
            killed process loses nothing without it, a power cut does.

    Raises:
        BadInputError: the file exists, or cannot be written.
        MissingExtraError: mcap or rosbags is not installed.
    """

    def __init__(self, path: Path, head: Head, sync_s: float = 1.0) -> None:
        try:
            from mcap.writer import CompressionType, Writer
        except ImportError as e:
            hint = "; run: pip install 'foreshock[zenoh]'"
            raise MissingExtraError("journal", f"{e.name} is not installed", hint) from e
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            self._file = path.open("xb")
        except FileExistsError:
            raise BadInputError(str(path), "exists; a journal is never overwritten", "; choose another name") from None
        self.path = path
        self._writer: Any = Writer(self._file, CHUNK_BYTES, CompressionType.ZSTD)
        self._writer.start("ros2", f"foreshock {version('foreshock')}")
        head = msgspec.structs.replace(
            head, foreshock=version("foreshock"), python=f"{platform.python_version()} {platform.machine()}"
        )
        self._writer.add_metadata(HEAD, {"head": msgspec.json.encode(head).decode()})
        self._codec = Codec()
        self._schemas: dict[str, int] = {}
        self._channels: dict[tuple[str, str], int] = {}
        self._json = {t: self._json_channel(t) for t in (TICK, DECISION, RESET)}
        self._chain = DigestJournal()
        self._data = hashlib.sha256(b"foreshock samples 1")
        self._sync_ns, self._synced_ns = round(sync_s * 1e9), -1
        self._closed = False

    @property
    def digest(self) -> str:
        """Of all decisions so far."""
        return self._chain.digest

    def tick(self, samples: Sequence[Sample], decision: Decision, verdicts: Mapping[str, str] = NO_VERDICTS) -> None:
        """Write samples, tick and decision."""
        now_ns = decision.now_ns
        notes = tuple([self._sample(s, now_ns) for s in samples])
        self._chain.tick(samples, decision, verdicts)
        record = TickRecord(now_ns, decision.tick, notes, dict(verdicts), self._chain.digest, self._data.hexdigest())
        self._add(self._json[DECISION], now_ns, now_ns, msgspec.json.encode(decision), decision.tick)
        self._add(self._json[TICK], now_ns, now_ns, msgspec.json.encode(record), decision.tick)
        self._file.flush()
        if now_ns - self._synced_ns >= self._sync_ns:
            self._synced_ns = now_ns
            os.fsync(self._file.fileno())

    def operator_reset(self, record: OperatorReset) -> None:
        """Write an operator's reset."""
        self._chain.operator_reset(record)
        self._add(self._json[RESET], record.stamp_ns, record.stamp_ns, msgspec.json.encode(record), 0)

    def close(self) -> None:
        """Finish the file; idempotent."""
        if not self._closed:
            self._closed = True
            self._writer.finish()
            self._file.close()

    def _sample(self, sample: Sample, now_ns: int) -> SampleNote:
        note = SampleNote(sample.channel, sample.stamp_ns, sample.seq, sample.received_ns)
        value = sample.value
        # a stamp before 1970 fits no ROS header: the note has it
        stamp_ns = max(0, sample.stamp_ns)
        payload = self._codec.encode(value, stamp_ns) if sample.stamp_ns >= 0 else encode_reference(value, 0)
        sample_digest(self._data, note, payload)
        channel = self._ros_channel(sample.channel, ROS_NAMES[type(value)])
        self._add(channel, max(now_ns, 0), stamp_ns, payload, max(sample.seq, 0) % (1 << 32))
        return note

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
        cls = {TICK: TickRecord, DECISION: Decision, RESET: OperatorReset}[topic]
        schema = msgspec.json.encode(_open(msgspec.json.schema(cls)))
        found: int = self._writer.register_channel(
            topic, "json", self._writer.register_schema(cls.__name__, "jsonschema", schema)
        )
        return found


def _open(schema: dict[str, Any]) -> dict[str, Any]:
    """A JSON schema whose root is an object, as readers of MCAP want it."""
    root = dict(schema)
    if "$ref" in root:
        name = root.pop("$ref").rsplit("/", 1)[-1]
        root = {**root["$defs"][name], **root}
    return root
