"""Replay: the decisions are made again from what a journal holds, and compared."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import msgspec

from foreshock.config import Config, parse_config
from foreshock.errors import BadInputError
from foreshock.journal import DigestJournal, Journal
from foreshock.recording import JournalFile
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
        altered_at: first tick whose samples are not those that were written; None if all are.
        differs_at: first tick whose decision differs from the recorded one; None if none does.
        recorded: digest of the decisions, as recorded.
        replayed: and as made again.
        levels: ticks at each protection level, as made again.
        foreign: the configuration is not the recorded one, so that decisions may well differ.
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
    altered = differs = None
    recorded, ticks, first_ns, last_ns = "", 0, 0, 0
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
            if altered is None and not tick.intact:
                altered = record.tick
            if differs is None and chain.digest != record.decisions:
                differs = record.tick
            name = decision.level.name.lower().replace("_", "-")
            levels[name] = levels.get(name, 0) + 1
            recorded, ticks, last_ns = record.decisions, ticks + 1, record.now_ns
            first_ns = first_ns or record.now_ns
    finally:
        supervisor.close()
    return Replay(
        str(path),
        ticks,
        (last_ns - first_ns) / 1e9,
        file.complete,
        altered,
        differs,
        recorded,
        chain.digest,
        levels,
        config is not None,
    )
