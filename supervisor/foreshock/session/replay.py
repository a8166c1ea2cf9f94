"""Replay: the decisions are made again from what a journal holds, and compared."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import msgspec

from foreshock.config import Config, parse_config
from foreshock.errors import BadInputError
from foreshock.journal import DigestJournal, Journal
from foreshock.recording import JournalFile, Tick
from foreshock.records import Decision
from foreshock.registry import Registry
from foreshock.supervisor import Supervisor

__all__ = ["Replay", "replay"]


class Replay(msgspec.Struct, frozen=True):
    """What came of a replay.

    Attributes:
        journal: the file.
        ticks: that were made again.
        seconds: from the first to the last, on the supervisor's timeline.
        complete: whether the file was closed properly; if not, what is there was replayed.
        altered_at: first tick that is not as it was written; None if all are.
        differs_at: first tick whose decision differs from the recorded one; None if none does.
        recorded: digest of the decisions, as recorded.
        replayed: and as made again.
        levels: ticks at each protection level, as made again.
        foreign: the configuration is not the recorded one, so that decisions may well differ.
        altered: what is not as it was written.
        warning: what cannot be told of the file.
    """

    journal: str
    ticks: int
    seconds: float
    complete: bool
    altered_at: int | None
    differs_at: int | None
    recorded: str
    replayed: str
    levels: dict[str, int]
    foreign: bool = False
    altered: str = ""
    warning: str = ""

    @property
    def agrees(self) -> bool:
        """Whether nothing was altered and every decision is the recorded one."""
        return self.altered_at is None and self.differs_at is None


def replay(
    path: Path,
    registry: Registry | None = None,
    config: Config | None = None,
    base: Path | None = None,
    journals: Sequence[Journal] = (),
    done: Callable[[Decision], None] | None = None,
) -> Replay:
    """Make the decisions of a journal again.

    Args:
        path: the journal.
        registry: of plugins.
        config: another configuration: what would have happened; the recorded one if None.
        base: folder that the relative paths of config start from.
        journals: records of the replay.
        done: told of each decision.

    Raises:
        BadInputError: no journal, damaged, or a configuration that cannot be built here.
    """
    file = JournalFile(path)
    head = file.head
    if head.segment and config is None:
        problem = f"is segment {head.segment} of its run, and begins in the middle"
        raise BadInputError(str(path), problem, "; replay segment 0, or ask what would have happened with --config")
    mine = parse_config(head.config, f"{path}: config") if config is None else config
    supervisor = Supervisor(mine, Path(head.base) if config is None else base, registry)
    chain = DigestJournal()
    altered, altered_at, differs = "", None, None
    recorded, data, ticks, first_ns, last_ns = "", "", 0, 0, 0
    levels: dict[str, int] = {}
    try:
        supervisor.reset(head.seed, head.began_ns)
        for tick in file.ticks():
            for reset in tick.resets:
                supervisor.operator_reset(reset.who, reset.why, reset.stamp_ns, reset.dimension)
                for journal in (chain, *journals):
                    journal.operator_reset(reset)
            record = tick.record
            decision = supervisor.step(tick.samples, record.now_ns, record.verdicts if config is None else {})
            verdicts = supervisor.verdicts_of(decision)
            for journal in (chain, *journals):
                journal.tick(tick.samples, decision, verdicts)
            if done is not None:
                done(decision)
            if differs is None and chain.digest != record.decisions:
                differs = record.tick
            if not altered and (altered := _altered(tick, decision if differs is None else None)):
                altered_at = record.tick
            name = decision.level.name.lower().replace("_", "-")
            levels[name] = levels.get(name, 0) + 1
            recorded, ticks, last_ns = record.decisions, ticks + 1, record.now_ns
            first_ns, data = first_ns or record.now_ns, record.data
        for reset in file.resets:
            chain.operator_reset(reset)
        known = chain.digest if config is None and differs is None else None
        if not altered and (altered := _end(file, ticks, data, known)):
            altered_at = record.tick + 1 if ticks else 0
    finally:
        supervisor.close()
    return Replay(
        str(path),
        ticks,
        (last_ns - first_ns) / 1e9,
        file.complete,
        altered_at,
        differs,
        recorded,
        chain.digest,
        levels,
        config is not None,
        altered,
        _warning(file),
    )


def _altered(tick: Tick, decision: Decision | None) -> str:
    """What of a tick is not as it was written; the decision is what the recorded one must be, if that is known."""
    if not tick.intact:
        return "samples, or the times of messages, are not those that were recorded"
    if len(tick.decisions) != 1:
        return f"{len(tick.decisions)} decisions instead of one"
    if decision is None:
        return ""
    mine, theirs = msgspec.json.encode(decision), tick.decisions[0]
    if mine == theirs or _same(mine, theirs):
        return ""
    return "the decision is not the one that was recorded"


def _same(mine: bytes, theirs: bytes) -> bool:
    """As values: the order of keys says nothing."""
    try:
        return bool(msgspec.json.decode(mine) == msgspec.json.decode(theirs))
    except msgspec.DecodeError:
        return False


def _end(file: JournalFile, ticks: int, data: str, digest: str | None) -> str:
    """What of a file's end is not as it was written; digest is what that of all decisions must be, if it is known."""
    end = file.end
    if end is None:
        return "the file was closed, but its end record is missing" if file.complete and file.head.version >= 2 else ""
    if end.ticks != ticks:
        return f"{ticks} ticks, and {end.ticks} by the end record"
    if file.rest:
        return f"{file.rest} samples or decisions after the last tick"
    if end.head != file.head_digest:
        return "the head is not the one that was recorded"
    if ticks and end.data != data:
        return "the samples are not those of the end record"
    unknown = digest is None or (end.left_out and not end.decisions)
    if not unknown and digest != end.decisions:
        return "the decisions are not those of the end record"
    return ""


def _warning(file: JournalFile) -> str:
    if file.end is not None and file.end.left_out:
        return f"recovered: {file.end.left_out}"
    if not file.complete:
        return f"not closed: what is there was replayed, up to byte {file.records.at} of {file.records.size}"
    if file.end is None:
        return "no end record: whether ticks are missing at its end cannot be told"
    return ""
