"""What a journal holds, and a whole file of a torn or damaged one."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import Any

import msgspec

from foreshock.errors import BadInputError
from foreshock.journal import DigestJournal, OperatorReset
from foreshock.recording._format import END, RESET, TICK, VERSION, End, TickRecord, sample_chain
from foreshock.recording._read import JournalFile
from foreshock.recording._records import DamagedError, Records

__all__ = ["Summary", "recover", "summary"]


class Summary(msgspec.Struct, frozen=True):
    """What is in a file.

    Attributes:
        ticks: whole ones.
        seconds: that they span.
        messages: by topic.
        digest: of the decisions.
        complete: whether the file was closed.
        left_out: what could not be saved, of a file that was recovered: where it ends and how much follows.
    """

    ticks: int
    seconds: float
    messages: dict[str, int]
    digest: str
    complete: bool
    left_out: str = ""


def summary(path: Path) -> Summary:
    """What is in a journal.

    Raises:
        BadInputError: it is none.
        DamagedError: it is damaged in its middle.
    """
    JournalFile(path)
    walk = _Walk(Records(path), None)
    walk.run()
    return walk.summary(walk.end.left_out if walk.end is not None else "")


def recover(path: Path, out: Path) -> Summary:
    """Copy everything up to the last whole tick before the first damage to another file, with index and end record.

    What operators did after that tick is copied, too.

    Raises:
        BadInputError: path is no journal, or out exists or cannot be written; no out is left then.
    """
    from mcap.writer import CompressionType, Writer

    file = JournalFile(path)
    why = "was not closed"
    try:
        with out.open("xb") as target:
            try:
                writer: Any = Writer(target, compression=CompressionType.ZSTD)
                writer.start("ros2", "foreshock journal recover")
                walk = _Walk(Records(path), writer)
                try:
                    walk.run()
                except DamagedError as e:
                    why = e.problem
                left_out = walk.left_out(why, must_end=file.head.version >= VERSION)
                if walk.end is not None or file.head.version >= VERSION:
                    walk.write_end(file.head_digest, left_out)
                writer.finish()
                target.flush()
            except BaseException:
                out.unlink()
                raise
    except FileExistsError:
        raise BadInputError("OUT", f"{out} exists; nothing is overwritten") from None
    except OSError as e:
        raise BadInputError("OUT", f"{out} cannot be written: {e.strerror or e}") from None
    return walk.summary(left_out)


class _Walk:
    """Counts the messages up to the last whole tick, and writes them if there is a writer."""

    def __init__(self, records: Records, writer: Any) -> None:
        self.records, self._writer = records, writer
        self.ticks, self._first_ns, self._at = 0, 0, 0
        self.last: TickRecord | None = None
        self.end: End | None = None
        self.complete = False
        self._waiting: list[Any] = []
        self._messages: dict[str, int] = {}
        self._topics: dict[int, str] = {}
        self._schemas: dict[int, int] = {}
        self._channels: dict[int, int] = {}

    def run(self) -> None:
        """Take all records.

        Raises:
            DamagedError: the file is damaged; what comes before was taken.
        """
        from mcap.records import Channel, DataEnd, Message, Metadata, Schema

        writer = self._writer
        for r in self.records:
            if isinstance(r, Schema) and r.id not in self._schemas:
                self._schemas[r.id] = writer.register_schema(r.name, r.encoding, r.data) if writer else 0
            elif isinstance(r, Channel) and r.id not in self._topics:
                self._topics[r.id] = r.topic
                if writer:
                    schema = self._schemas.get(r.schema_id, 0)
                    self._channels[r.id] = writer.register_channel(r.topic, r.message_encoding, schema)
            elif isinstance(r, Metadata) and writer:
                writer.add_metadata(r.name, r.metadata)
            elif isinstance(r, DataEnd):
                self.complete = True
            elif isinstance(r, Message):
                topic = self._topics.get(r.channel_id, "")
                if not topic:
                    raise DamagedError(self.records.path, f"has a message of no topic {self._after()}")
                self._waiting.append(r)
                if topic == TICK:
                    self._tick(self._json(r.data, TickRecord))
                elif topic == END:
                    self.end = self._json(r.data, End)
                if topic in (TICK, END):
                    self._take(self._waiting)
                    self._waiting = []

    def write_end(self, head: str, left_out: str) -> None:
        """The end record: the file's own, or that of a file that was closed after the last whole tick."""
        end = self.end
        if end is None:
            resets = self._resets_after()
            self._take(resets)
            digest = DigestJournal().digest if self.last is None else self.last.decisions
            if resets:
                digest = ""
            data = sample_chain().hexdigest() if self.last is None else self.last.data
            end = End(self.ticks, digest, data, head)
        end = msgspec.structs.replace(end, left_out=left_out)
        now_ns = 0 if self.last is None else max(self.last.now_ns, 0)
        known = [self._channels[k] for k, topic in self._topics.items() if topic == END]
        channel = known[0] if known else self._writer.register_channel(END, "json", 0)
        self._writer.add_message(channel, now_ns, msgspec.json.encode(end), now_ns, 0)

    def _resets_after(self) -> list[Any]:
        """Of operators, after the last whole tick; none if what follows is a tick that is not the next."""
        if any(self._topics[m.channel_id] == TICK for m in self._waiting):
            return []
        found = []
        for m in self._waiting:
            if self._topics[m.channel_id] == RESET:
                with suppress(DamagedError):
                    self._json(m.data, OperatorReset)
                    found.append(m)
        return found

    def left_out(self, why: str, *, must_end: bool) -> str:
        """What comes after the last whole tick, for people; empty of a whole file."""
        if self.complete and self.end is None and must_end:
            return "the file was closed without an end record: ticks at its end may be missing"
        if self.complete:
            return self.end.left_out if self.end is not None else ""
        rest = self.records.size - self._at
        return f"the file {why}; {rest} of its {self.records.size} bytes, from byte {self._at} on, are left out"

    def summary(self, left_out: str) -> Summary:
        """Of all that was taken."""
        span = (self.last.now_ns - self._first_ns) / 1e9 if self.last is not None else 0.0
        digest = self.last.decisions if self.last is not None else ""
        return Summary(self.ticks, span, self._messages, digest, self.complete, left_out)

    def _tick(self, record: TickRecord) -> None:
        if self.last is not None and record.tick != self.last.tick + 1:
            raise DamagedError(self.records.path, f"lacks ticks {self.last.tick + 1} to {record.tick - 1}")
        self.ticks, self.last, self._at = self.ticks + 1, record, self.records.at
        self._first_ns = self._first_ns or record.now_ns

    def _take(self, messages: list[Any]) -> None:
        for m in messages:
            topic = self._topics[m.channel_id]
            if topic == END and self._writer:
                continue
            self._messages[topic] = self._messages.get(topic, 0) + 1
            if self._writer:
                channel = self._channels[m.channel_id]
                self._writer.add_message(channel, m.log_time, m.data, m.publish_time, m.sequence)

    def _json(self, data: bytes, cls: Any) -> Any:
        try:
            return msgspec.json.decode(data, type=cls)
        except msgspec.MsgspecError as e:
            raise DamagedError(
                self.records.path, f"has a {cls.__name__} that cannot be read {self._after()}: {e}"
            ) from None

    def _after(self) -> str:
        return "before its first tick" if self.last is None else f"after tick {self.last.tick}"
