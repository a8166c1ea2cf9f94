"""The ledger of a campaign: one durable row per finished run in a SQLite file, kept under the run's key.

A row is committed before the next result is looked at, so that a campaign that is killed at any moment loses only the
runs that were under way.
"""

from __future__ import annotations

import fcntl
import os
import sqlite3
import zlib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal, TypeVar

import msgspec

from foreshock.campaign.plan import Case
from foreshock.clock import ns, seconds
from foreshock.errors import BadInputError, ConfigError
from foreshock.records import Intervention
from foreshock.session.isolated import Failure
from foreshock.session.run import Run
from foreshock.session.scripted import acts_of

__all__ = ["LEDGER", "Ledger", "Row", "locked"]

T = TypeVar("T")
LEDGER = "ledger.sqlite"


class Row(msgspec.Struct, frozen=True):
    """What one run came to.

    Attributes:
        key: hash of all that the result depends on.
        scenario: id.
        mode: its accident mode.
        arm: id.
        point: number of the point.
        replicate: number of the seed at this point.
        seed: of the run.
        parameters: values of the factors.
        fault: id of what was injected; empty for nothing.
        status: ``ok``, or what failed: ``error``, ``discard``, ``nan``, ``hang``, ``crash``, ``bad-input``, or
            ``source`` where the run whose interventions it takes gave no result.
        detail: what was said of a failure.
        log: the last words of its process.
        accident: whether the scenario's accident happened.
        outcome: the first accident's id, else the first event's, else ``none``.
        accident_s: when the accident happened.
        event_s: when anything first happened in the plant.
        end_s: simulated time at the end.
        level: highest protection level of the mode, or minimal risk.
        caution_s: when the caution level was first reached.
        protective_s: when the protective level was.
        acted_s: when an action of the mode, other than slowing down and announcing, first began, or the minimal risk
            condition.
        peak_p: highest P of the mode before the accident.
        first_s: first time of each precursor kind of the mode.
        policy: what acted, or would have.
        safe_s: since when the mode's control-level trust has been at its caution gate or above until the end; None if
            it was not at the end, the accident happened, or nobody judged.
        reduced_s: how long any action held, or would have in shadow, that the twin understands and that is more than
            announcing: time at reduced speed, or standing; None in ledgers from before it was recorded.
        wall_s: wall time of the run; the one column that is not the same when it is run again.
    """

    key: str
    scenario: str
    mode: str
    arm: str
    point: int
    replicate: int
    seed: int
    parameters: dict[str, float]
    fault: str = ""
    status: str = "ok"
    detail: str = ""
    log: str = ""
    accident: bool | None = None
    outcome: str = ""
    accident_s: float | None = None
    event_s: float | None = None
    end_s: float | None = None
    level: int | None = None
    caution_s: float | None = None
    protective_s: float | None = None
    acted_s: float | None = None
    peak_p: float | None = None
    first_s: dict[str, float] = {}
    policy: str = ""
    wall_s: float | None = None
    safe_s: float | None = None
    reduced_s: float | None = None

    @property
    def ok(self) -> bool:
        """Whether there is a result."""
        return self.status == "ok"


def row_of(case: Case, result: Run | Failure, wall_s: float, scripted: tuple[Intervention, ...]) -> Row:
    """The row of a run that has ended."""
    where = (case.key, case.scenario, case.mode, case.arm, case.point, case.replicate, case.seed)
    at = (*where, case.parameters, case.fault)
    if isinstance(result, Failure):
        return Row(*at, status=result.kind, detail=result.detail, log=result.log)
    changes = result.interventions or scripted
    acts = [i.stamp_ns for i in acts_of(changes, case.mode)]
    return Row(
        *at,
        accident=result.accident,
        outcome=result.outcome,
        accident_s=next((e.stamp_ns / 1e9 for e in result.events if e.mode == case.mode), None),
        event_s=result.events[0].stamp_ns / 1e9 if result.events else None,
        end_s=result.end_s,
        level=result.max_level,
        caution_s=result.gate_s.get("caution"),
        protective_s=result.gate_s.get("protective"),
        acted_s=min(acts) / 1e9 if acts else None,
        peak_p=result.peak_p,
        first_s=result.first_s,
        policy=result.policy,
        wall_s=wall_s,
        safe_s=result.safe_s,
        reduced_s=_held_s([i for i in changes if i.action not in result.ignored], result.end_s),
    )


def _held_s(changes: Iterable[Intervention], end_s: float) -> float:
    """How long some action other than announcing held until the end."""
    active: set[str] = set()
    since_ns, held_ns, end_ns = 0, 0, ns(end_s)
    for change in sorted(changes, key=lambda i: i.stamp_ns):
        if change.action == "announce" or change.stamp_ns >= end_ns:
            continue
        if active:
            held_ns += change.stamp_ns - since_ns
        since_ns = change.stamp_ns
        (active.add if change.strength > 0.0 else active.discard)(change.action)
    return seconds(held_ns + (end_ns - since_ns if active else 0))


_SCHEMA = """
create table if not exists meta (name text primary key, value blob not null) without rowid;
create table if not exists runs (
    key text primary key, scenario text not null, arm text not null, seed integer not null, status text not null,
    row blob not null, changes blob not null
) without rowid;
"""


class Ledger:
    """The file; close it, or use it as a context.

    Args:
        folder: of the campaign.
        new: make one; else there must be one.

    Raises:
        ConfigError: there is none, or there is one already.
    """

    def __init__(self, folder: Path, *, new: bool = False) -> None:
        self._folder, path = folder, folder / LEDGER
        if not new and not path.exists():
            raise ConfigError(str(folder), f"holds no campaign: there is no {LEDGER}")
        folder.mkdir(parents=True, exist_ok=True)
        self._db = sqlite3.connect(path, isolation_level=None)
        try:
            self._db.execute("pragma journal_mode = wal")
            self._db.execute("pragma synchronous = full")  # a row that was reported survives a power cut
            self._db.executescript(_SCHEMA)
        except sqlite3.DatabaseError as e:
            self._db.close()
            raise BadInputError(str(path), f"is no ledger: {e}") from None
        # one that was killed before it kept anything is no campaign yet
        if new and self._db.execute("select 1 from meta limit 1").fetchone():
            try:
                self.expect("campaign")
            finally:
                self._db.close()
            hint = f"; continue it with: foreshock campaign resume {folder}"
            raise ConfigError(str(folder), "holds a campaign already", hint)

    def __enter__(self) -> Ledger:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the file."""
        self._db.close()

    def expect(self, kind: Literal["campaign", "search"]) -> None:
        """Refuse a folder that holds the other kind.

        Raises:
            ConfigError: it does.
        """
        mark, other = ("falsify", "search of foreshock falsify") if kind == "campaign" else ("spec", "campaign")
        if self.known(mark, dict[str, Any]) is not None:
            raise ConfigError(str(self._folder), f"holds a {other}, and no {kind}", "; take another folder")

    def put_meta(self, **values: Any) -> None:
        """Keep facts about the campaign."""
        with self._db:
            self._db.execute("begin")
            self._db.executemany(
                "insert or replace into meta values (?, ?)", [(k, msgspec.json.encode(v)) for k, v in values.items()]
            )

    def meta(self, name: str, to: type[T]) -> T:
        """A fact about the campaign."""
        found = self.known(name, to)
        if found is None:
            raise ConfigError(LEDGER, f"{name} is missing: the campaign was never begun")
        return found

    def known(self, name: str, to: type[T]) -> T | None:
        """A fact, or None if it was never kept."""
        found = self._db.execute("select value from meta where name = ?", (name,)).fetchone()
        return None if found is None else msgspec.json.decode(found[0], type=to)

    def put(self, row: Row, changes: tuple[Intervention, ...] = ()) -> None:
        """Keep a result, and the interventions of the run for those that take them."""
        packed = zlib.compress(msgspec.msgpack.encode(changes)) if changes else b""
        self._db.execute(
            "insert or replace into runs values (?, ?, ?, ?, ?, ?, ?)",
            (row.key, row.scenario, row.arm, row.seed, row.status, msgspec.json.encode(row), packed),
        )

    def rows(self, cases: Iterable[Case]) -> list[Row]:
        """What is there of these runs, in their order."""
        return self.recorded(c.key for c in cases)

    def recorded(self, keys: Iterable[str]) -> list[Row]:
        """What is there under these keys, in their order."""
        found: dict[str, bytes] = dict(self._db.execute("select key, row from runs"))
        return [msgspec.json.decode(found[key], type=Row) for key in keys if key in found]

    def statuses(self) -> dict[str, str]:
        """Status by key."""
        return dict(self._db.execute("select key, status from runs"))

    def forget(self, status: str = "") -> None:
        """Forget the runs that gave no result: those of one status, or all."""
        self._db.execute("delete from runs where status != 'ok' and (? = '' or status = ?)", (status, status))

    def forget_unbegun(self) -> None:
        """Forget a campaign of which there is no row."""
        self._db.execute("delete from meta where not exists (select 1 from runs)")

    def changes(self, key: str) -> tuple[Intervention, ...]:
        """The interventions of a run."""
        packed = self._db.execute("select changes from runs where key = ?", (key,)).fetchone()[0]
        return msgspec.msgpack.decode(zlib.decompress(packed), type=tuple[Intervention, ...]) if packed else ()


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Hold a campaign's folder for this process alone; the lock ends with the process, however that comes about.

    Raises:
        BadInputError: another process holds it.
    """
    folder.mkdir(parents=True, exist_ok=True)
    fd = os.open(folder / "lock", os.O_CREAT | os.O_RDWR | os.O_CLOEXEC)
    try:
        fcntl.flock(fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(fd)
        raise BadInputError(str(folder), "another process runs this campaign") from None
    try:
        yield
    finally:
        os.close(fd)
