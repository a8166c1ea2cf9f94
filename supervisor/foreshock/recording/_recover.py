"""What a journal holds, and a whole file of a torn one."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import msgspec

from foreshock.recording._format import TICK, TickRecord
from foreshock.recording._read import JournalFile, records_of

__all__ = ["Summary", "recover", "summary"]


class Summary(msgspec.Struct, frozen=True):
    """Of a file: whole ticks, the time they span (s), messages by topic, digest of the decisions, whether closed."""

    ticks: int
    seconds: float
    messages: dict[str, int]
    digest: str
    complete: bool


def summary(path: Path) -> Summary:
    """What is in a journal.

    Raises:
        BadInputError: it is none.
    """
    JournalFile(path)
    return _walk(path, None)


def recover(path: Path, out: Path) -> Summary:
    """Copy everything up to the last whole tick to another file, with an index.

    Raises:
        BadInputError: path is no journal.
    """
    from mcap.writer import CompressionType, Writer

    JournalFile(path)
    with out.open("xb") as file:
        writer: Any = Writer(file, compression=CompressionType.ZSTD)
        writer.start("ros2", "foreshock journal recover")
        found = _walk(path, writer)
        writer.finish()
    return found


def _walk(path: Path, writer: Any) -> Summary:
    """Count the messages up to the last whole tick, and write them if there is a writer."""
    from mcap.records import Channel, DataEnd, Message, Metadata, Schema

    topics: dict[int, str] = {}
    schemas: dict[int, int] = {}
    channels: dict[int, int] = {}
    waiting: list[Any] = []
    messages: dict[str, int] = {}
    ticks, first_ns, last, complete = 0, 0, None, False
    for record in records_of(path):
        if isinstance(record, Schema) and record.id not in schemas:
            schemas[record.id] = writer.register_schema(record.name, record.encoding, record.data) if writer else 0
        elif isinstance(record, Channel) and record.id not in topics:
            topics[record.id] = record.topic
            if writer:
                schema = schemas.get(record.schema_id, 0)
                channels[record.id] = writer.register_channel(record.topic, record.message_encoding, schema)
        elif isinstance(record, Metadata) and writer:
            writer.add_metadata(record.name, record.metadata)
        elif isinstance(record, DataEnd):
            complete = True
        elif isinstance(record, Message):
            waiting.append(record)
            if topics[record.channel_id] != TICK:
                continue
            last = msgspec.json.decode(record.data, type=TickRecord)
            ticks, first_ns = ticks + 1, first_ns or last.now_ns
            for m in waiting:
                topic = topics[m.channel_id]
                messages[topic] = messages.get(topic, 0) + 1
                if writer:
                    writer.add_message(channels[m.channel_id], m.log_time, m.data, m.publish_time, m.sequence)
            waiting = []
    span = (last.now_ns - first_ns) / 1e9 if last is not None else 0.0
    return Summary(ticks, span, messages, last.decisions if last is not None else "", complete)
