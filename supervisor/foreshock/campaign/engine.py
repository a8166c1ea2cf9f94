"""Runs a campaign: isolated processes with a deadline, one durable row per finished run, and a resume that goes on."""

from __future__ import annotations

import math
import shutil
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import msgspec

from foreshock.campaign.early import first_tick, place_of, refuse_arms, to_try
from foreshock.campaign.identity import changes, digest
from foreshock.campaign.ledger import Ledger, Row, locked, row_of
from foreshock.campaign.plan import Case, Plan, declared, plan_of, under
from foreshock.campaign.spec import CampaignSpec, load_campaign, shipped
from foreshock.clock import monotonic_ns, seconds
from foreshock.errors import BadInputError, ConfigError
from foreshock.records import Intervention
from foreshock.registry import Registry
from foreshock.session.isolated import Failure, Job, Source, run_stream
from foreshock.session.run import Run

__all__ = ["Campaign", "Estimate", "Progress", "Runner", "begin", "execute", "reopen"]

SCRATCH = "scratch"
Runner = Callable[[Source[str], int, "float | None", Path], None]
"""Does the jobs of a source: run_stream, or the same on a cluster."""


class Campaign(msgspec.Struct, frozen=True):
    """A campaign in its folder.

    Attributes:
        folder: of its ledger and results.
        plan: its runs.
        note: what is to be said of its file; empty for nothing.
    """

    folder: Path
    plan: Plan
    note: str = ""

    def rows(self) -> list[Row]:
        """What was run, in the plan's order, whatever has changed since then."""
        with Ledger(self.folder) as ledger:
            return ledger.recorded(ledger.known("keys", list[str]) or ())

    def aside(self) -> int:
        """How many rows the ledger keeps that are no part of the campaign any more."""
        with Ledger(self.folder) as ledger:
            return len(ledger.statuses().keys() - set(ledger.known("keys", list[str]) or ()))


class Estimate(msgspec.Struct, frozen=True):
    """What is to be done.

    Attributes:
        runs: how many runs are left.
        simulated_s: their simulated time, at most.
        wall_s: how long they will take, by what one run of each scenario took; NaN before anything ran.
    """

    runs: int
    simulated_s: float
    wall_s: float


class Progress(msgspec.Struct, frozen=True):
    """How far it is: runs that are done and planned, those of them that failed, runs per second in this call."""

    done: int
    total: int
    failed: int
    rate_hz: float


def begin(spec: CampaignSpec, origin: Path, folder: Path, registry: Registry, source: str = "") -> Campaign:
    """A new campaign in a folder; nothing runs yet.

    Args:
        spec: the campaign.
        origin: folder that its paths start from.
        folder: where ledger and results are kept.
        registry: of plugins.
        source: the file that it was read from, or the id of a ready one, to be read again when it is reopened; empty
            for none.

    Raises:
        BadInputError: something in it is wrong, or the folder holds a campaign.
    """
    plan = plan_of(spec, origin, registry)
    refuse_arms(plan, registry)
    with locked(folder), Ledger(folder, new=True) as ledger:
        lasting = str(Path(source).absolute()) if source.endswith(".toml") else source
        ledger.put_meta(source=lasting, **_facts(plan, origin))
    return Campaign(folder, plan)


def reopen(folder: Path, registry: Registry, *, accept: bool = False) -> tuple[Campaign, list[str]]:
    """A campaign that was begun, and what has changed since then, its file included.

    Args:
        folder: of the campaign.
        registry: of plugins.
        accept: go on with what there is now: runs whose key has changed are to be done again. Else the campaign is as
            it was begun, but for what of its file no result depends on.

    Raises:
        BadInputError: there is none, or it can be planned no longer; with accept, its file is wrong.
    """
    with Ledger(folder) as ledger:
        ledger.expect("campaign")
        before = ledger.meta("identity", dict[str, Any])
        given, note, found = None, "", []
        try:
            given, note = _of_file(ledger)
        except BadInputError as e:
            if accept:
                raise
            found = [f"its file cannot be used: {e}"]
        if given is not None and not accept:
            found = changes(before["campaign"], declared(given[0]), "campaign")
        if given is None or found:
            given = ledger.meta("spec", CampaignSpec), Path(ledger.meta("origin", str))
        try:
            plan = plan_of(*given, registry)
        except BadInputError as e:
            if found:
                refuse_changes(folder, [*found, str(e)])
            raise
        found += changes(before, plan.identity)
        if found and accept:
            refuse_arms(plan, registry)
            ledger.put_meta(**_facts(plan, given[1]))
    return Campaign(folder, plan, note), found


def _of_file(ledger: Ledger) -> tuple[tuple[CampaignSpec, Path] | None, str]:
    """The campaign as its file has it now, if there is one, and what is to be said of that."""
    source = ledger.known("source", str)
    if not source:
        return None, ""
    if Path(source).is_file() if source.endswith(".toml") else source in shipped():
        return load_campaign(source), ""
    return None, f"{source} is gone; the campaign is what the ledger keeps of it"


def _facts(plan: Plan, origin: Path) -> dict[str, Any]:
    """What is kept of a plan: the campaign, what it depends on, its scenarios, and its runs and their keys."""
    kept = {"spec": plan.spec, "origin": str(origin), "identity": plan.identity, "scenarios": plan.scenarios}
    return {**kept, "cases": plan.cases, "keys": [c.key for c in plan.cases]}


def refuse_changes(
    folder: Path, found: Sequence[str], hint: str = "\nwith --accept what depends on it is run again"
) -> None:
    """Say what has changed.

    Raises:
        ConfigError: anything has.
    """
    if found:
        raise ConfigError(str(folder), "is not what it was when it was begun:\n  " + "\n  ".join(found), hint)


class _Feed:
    """Gives the runs that are left, each after the run whose interventions it takes, and writes results down.

    First comes the first tick of what no other run tries, then of each scenario a run with a supervisor and one
    without: they find bad input before it costs much, and the runs say how long the rest takes.
    """

    def __init__(
        self,
        campaign: Campaign,
        ledger: Ledger,
        workers: int,
        estimated: Callable[[Estimate], None] | None,
        told: Callable[[Progress], None] | None,
    ) -> None:
        self._plan, self._ledger, self._workers = campaign.plan, ledger, workers
        self._estimated, self._told = estimated, told
        self._cases = {c.key: c for c in campaign.plan.cases}
        self._status = {k: s for k, s in ledger.statuses().items() if k in self._cases}
        self._failed = sum(s != "ok" for s in self._status.values())
        self._scripted: dict[str, tuple[Intervention, ...]] = {}
        self._configs: dict[tuple[str, str], str] = {}
        self._waiting: dict[str, list[Case]] = {}
        self._begin_ns, self._new = monotonic_ns(), 0
        hours = campaign.plan.spec.budget.hours
        self._until_ns = None if hours is None else self._begin_ns + round(hours * 3600e9)
        self._ready: deque[Case] = deque(self._first())
        self._pilots = {c.key: math.nan for c in self._ready}
        self._trials = {f"trial {c.key}": c for c in to_try(campaign.plan, self.left(), self._ready)}
        self._untried = deque(self._trials)
        self.exhausted = False
        if not self._ready:
            self._go_on()

    def _first(self) -> list[Case]:
        """Of each scenario that has any left a run with a supervisor, and one without, which costs less."""
        first: dict[tuple[str, bool], Case] = {}
        for case in self.left():
            if not case.source:
                first.setdefault((case.scenario, self._judged(case)), case)
        return list(first.values())

    def _judged(self, case: Case) -> bool:
        return self._plan.spec.arm(case.arm).judged

    def _go_on(self) -> None:
        """Say how long the rest takes, and let it begin."""
        left = self.left()
        if self._estimated is not None:
            self._estimated(self._estimate(left))
        for case in left:
            if case.source and case.source not in self._status:
                self._waiting.setdefault(case.source, []).append(case)
            else:
                self._ready.append(case)

    def _estimate(self, left: Sequence[Case]) -> Estimate:
        """By the pace of the first runs, and the time spent around them: each further configuration sets up anew."""
        duration_s = {id_: s.duration_s for id_, s in self._plan.scenarios.items()}
        pilots = {k: w for k, w in self._pilots.items() if not math.isnan(w)}
        pace = {(c.scenario, self._judged(c)): pilots[c.key] for c in map(self._cases.__getitem__, pilots)}
        if not left or not pace:
            return Estimate(len(left), self._plan.simulated_s(left), math.nan if left else 0.0)
        mean = sum(pace.values()) / len(pace)
        ran_s = sum(duration_s[id_] * w for (id_, _), w in pace.items())
        set_up_s = max(seconds(monotonic_ns() - self._begin_ns) - ran_s / self._workers, 0.0) / len(pace)
        wall_s = 0.0
        for case in left:
            of_judged = pace.get((case.scenario, True), mean)
            wall_s += duration_s[case.scenario] * pace.get((case.scenario, self._judged(case)), of_judged)
        built = {self._set_up(self._cases[k]) for k in self._pilots}
        further = {self._set_up(c) for c in left if self._judged(c)} - built
        return Estimate(len(left), self._plan.simulated_s(left), wall_s / self._workers + len(further) * set_up_s)

    def _set_up(self, case: Case) -> tuple[str, str]:
        """What a worker builds for a run and keeps: runs of the same share it."""
        key = case.scenario, case.arm
        if key not in self._configs:
            self._configs[key] = digest(
                under(self._plan.scenarios[case.scenario], self._plan.spec.arm(case.arm)).config
            )
        return case.scenario, self._configs[key]

    def next(self) -> tuple[str, Job] | None:
        """The next run."""
        while self._untried or self._ready:
            if self._until_ns is not None and monotonic_ns() >= self._until_ns:
                self.exhausted = True
                return None
            if self._untried:
                key = self._untried.popleft()
                return key, first_tick(self._plan.job(self._trials[key]))
            if self._trials:  # bad input that they find leaves no row behind
                return None
            case = self._ready.popleft()
            if not case.source:
                return case.key, self._plan.job(case)
            if self._status[case.source] == "ok":
                job = self._plan.job(case, self._ledger.changes(case.source))
                self._scripted[case.key] = job.scripted
                return case.key, job
            lost = f"run {case.source}, whose interventions it takes, gave no result"
            self.done(case.key, Failure(self._plan.job(case), "source", lost), math.nan)
        return None

    def done(self, key: str, result: Run | Failure, wall_s: float) -> None:
        """Write a result down."""
        if key in self._trials:
            self._tried(self._trials.pop(key), result)
            return
        case = self._cases[key]
        row = row_of(case, result, wall_s, self._scripted.pop(key, ()))
        self._ledger.put(row, result.interventions if isinstance(result, Run) else ())
        self._status[key] = row.status
        self._failed += not row.ok
        self._new += 1
        self._ready.extendleft(reversed(self._waiting.pop(key, [])))
        if key in self._pilots:
            if row.status == "bad-input":
                self._ledger.forget("bad-input")
                raise BadInputError(place_of(case), row.detail)
            self._pilots[key] = wall_s / row.end_s if row.end_s else math.nan
            self._go_on_after_first()
        if self._told is not None:
            self._told(self.progress())

    def _tried(self, case: Case, result: Run | Failure) -> None:
        """A first tick tells of bad input only: what fails otherwise will do so in its run."""
        if isinstance(result, Failure) and result.kind == "bad-input":
            raise BadInputError(place_of(case), result.detail)
        self._go_on_after_first()

    def _go_on_after_first(self) -> None:
        if not self._trials and all(k in self._status for k in self._pilots):
            self._go_on()

    def progress(self) -> Progress:
        """How far it is."""
        elapsed_s = seconds(monotonic_ns() - self._begin_ns)
        return Progress(len(self._status), len(self._cases), self._failed, self._new / elapsed_s if elapsed_s else 0.0)

    def left(self) -> list[Case]:
        """Runs that are not done."""
        return [c for c in self._plan.cases if c.key not in self._status]


def execute(
    campaign: Campaign,
    workers: int,
    *,
    runner: Runner = run_stream,
    estimated: Callable[[Estimate], None] | None = None,
    told: Callable[[Progress], None] | None = None,
    retry: bool = False,
) -> bool:
    """Do what is left of a campaign; the result is the same however often it was broken off.

    Args:
        campaign: what to run.
        workers: number of processes.
        runner: what does the runs.
        estimated: told what is left once one run of each scenario is done.
        told: told of every result.
        retry: runs that gave no result are done again.

    Returns:
        Whether everything is done; False if the budget of wall time was used up.

    Raises:
        BadInputError: one of the first runs names something that does not exist, or another process runs it. A
            campaign of which nothing was run is then forgotten: it can be begun anew.
    """
    with locked(campaign.folder), Ledger(campaign.folder) as ledger, scratch_in(campaign.folder) as scratch:
        if retry:
            ledger.forget()
        feed = _Feed(campaign, ledger, workers, estimated, told)
        try:
            runner(feed, workers, campaign.plan.spec.timeout_s, scratch)
        except BadInputError:
            ledger.forget_unbegun()
            raise
        return not feed.exhausted


@contextmanager
def scratch_in(folder: Path) -> Iterator[Path]:
    """A folder for what is temporary, inside the campaign's: what a killed one left there is removed."""
    scratch = folder / SCRATCH
    shutil.rmtree(scratch, ignore_errors=True)
    scratch.mkdir()
    try:
        yield scratch.resolve()
    finally:
        shutil.rmtree(scratch, ignore_errors=True)
