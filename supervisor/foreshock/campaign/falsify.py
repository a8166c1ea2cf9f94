"""Falsification: a search for parameters with which the supervised system still has the accident.

A point of the parameter space is run on several seeds. The search minimises the median over them of the robustness of
an STL formula over the plant's probes, which says how near the accident is; what an accident is, the referee decides.
A point where more than half of the seeds have it is a candidate, and is a case if that is so on fresh seeds, too: noise
is not taken for a weakness.
"""

from __future__ import annotations

import math
import statistics
from collections import Counter, deque
from collections.abc import Callable, Generator, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias

import msgspec
import tomli_w

from foreshock._strict import within
from foreshock.campaign.engine import refuse_changes, scratch_in
from foreshock.campaign.identity import changes, digest
from foreshock.campaign.ledger import LEDGER, Ledger, locked
from foreshock.campaign.optimiser import Optimiser, OptimiserKind, support
from foreshock.campaign.plan import Plan, plan_of, under
from foreshock.campaign.robustness import Robustness
from foreshock.campaign.spec import ArmEntry, CampaignSpec, ScenarioEntry
from foreshock.errors import BadInputError, ConfigError
from foreshock.registry import Registry
from foreshock.session.isolated import Failure, Job, run_stream
from foreshock.session.rates import Rate, wilson
from foreshock.session.run import Run
from foreshock.session.scenario import Distribution, Scenario

__all__ = ["Falsified", "Found", "Search", "falsify"]

BATCH = 4
"""Points that are asked for at a time, whatever the number of workers: what is found does not depend on that."""
FRESH = 10
"""Seeds on which a candidate is tried again, supervised and not."""


class Search(msgspec.Struct, frozen=True):
    """What is searched.

    Attributes:
        scenario: an id or a scenario file.
        bounds: parameters that are searched, and between what; empty searches all that the scenario draws. Others are
            drawn anew by each seed, as ever.
        formula: what must hold; empty takes the scenario's own (``safe``).
        runs: budget; a candidate is still decided, which takes at most 2 * FRESH of them.
        seeds: runs per point.
        cases: it ends when so many are found; after each it begins anew.
        seed: of the search, and the first of the runs.
        kind: of search.
        policy: replaces the scenario's policies.
    """

    scenario: str
    bounds: dict[str, tuple[float, float]] = {}
    formula: str = ""
    runs: int = 300
    seeds: int = 5
    cases: int = 1
    seed: int = 0
    kind: OptimiserKind = "tpe"
    policy: str | None = None

    def __post_init__(self) -> None:
        within("seeds", self.seeds, 1)
        within("runs", self.runs, self.seeds)
        within("cases", self.cases, 1)
        within("seed", self.seed, 0)
        for name, (low, high) in self.bounds.items():
            if not (math.isfinite(low) and math.isfinite(high) and low < high):
                raise ConfigError(f"bounds.{name}", f"{low!r}:{high!r} is not a finite low below a finite high")


class Falsified(msgspec.Struct, frozen=True):
    """Parameters with which the supervised system has the accident.

    Attributes:
        file: a scenario that has it.
        parameters: that were searched.
        robustness: median over the seeds of the search.
        supervised: share of the fresh seeds with the accident, with the 95% Wilson interval.
        unsupervised: the same without a supervisor.
        seed: a fresh one with the accident; the file's own.
        accident: what happened with it.
        after_runs: runs until then, those on fresh seeds included.
    """

    file: str
    parameters: dict[str, float]
    robustness: float
    supervised: Rate
    unsupervised: Rate
    seed: int
    accident: str
    after_runs: int


class Found(msgspec.Struct, frozen=True):
    """What a search has come to.

    Attributes:
        scenario: id.
        formula: what should hold.
        searched: support of each parameter: low and high, or the values of a choice.
        runs: that have ended.
        known: of these, what the ledger had from before.
        failed: runs without a result, by status; they are no accident.
        best: the point with the least robustness.
        robustness: of that; None if no run gave a result.
        candidates: points with the accident on more than half of the search's seeds.
        cases: those with it on more than half of the fresh seeds.
    """

    scenario: str
    formula: str
    searched: dict[str, tuple[float, ...]]
    runs: int = 0
    known: int = 0
    failed: dict[str, int] = {}
    best: dict[str, float] = {}
    robustness: float | None = None
    candidates: int = 0
    cases: tuple[Falsified, ...] = ()


class _Wanted(msgspec.Struct, frozen=True):
    parameters: dict[str, float]
    seed: int
    supervised: bool = True


class _Outcome(msgspec.Struct, frozen=True):
    """Of a run: status as in a campaign's row, what was said of a failure; robustness; the accident, or nothing."""

    status: str
    detail: str = ""
    robustness: float | None = None
    accident: str = ""


_Steps: TypeAlias = Generator[list[_Wanted], list[_Outcome], None]


def falsify(
    search: Search,
    folder: Path,
    registry: Registry,
    workers: int,
    timeout_s: float | None = None,
    told: Callable[[Found], None] | None = None,
) -> Found:
    """Search, in isolated processes. Every run is written down: the same call on the same folder goes on after a break.

    Args:
        search: what, and for how long.
        folder: of ledger and cases.
        registry: of plugins.
        workers: number of processes; the result does not depend on it.
        timeout_s: wall-clock limit of one run.
        told: told how far it is after each run.

    Raises:
        BadInputError: something in it is wrong, what the folder holds depends on what has changed, or is a campaign.
        MissingExtraError: optuna or rtamt is not installed.
    """
    arms = (ArmEntry("on", "on", policy=search.policy), ArmEntry("none", "none"))
    plan = plan_of(CampaignSpec("falsify", (ScenarioEntry(search.scenario),), arms), Path.cwd(), registry)
    source = _Source(search, plan, folder, told)
    with locked(folder), Ledger(folder, new=not (folder / LEDGER).exists()) as ledger, scratch_in(folder) as scratch:
        ledger.expect("search")
        before = ledger.known("falsify", dict[str, Any])
        if before is not None:
            refuse_changes(folder, changes(before, source.facts), "\ntake another folder")
        source.ledger = ledger
        run_stream(source, workers, timeout_s, scratch)
    return source.found


class _Source:
    """Gives the runs that the search asks for, unless the ledger has them."""

    ledger: Ledger

    def __init__(self, search: Search, plan: Plan, folder: Path, told: Callable[[Found], None] | None) -> None:
        if len(plan.scenarios) != 1:
            raise ConfigError("scenario", f"{search.scenario!r} is {len(plan.scenarios)} scenarios; expected one")
        (self._base,) = plan.scenarios.values()
        formula = search.formula or self._base.safe
        if not formula:
            raise ConfigError(self._base.id, "has no `safe`, the formula that must hold", "; give one")
        self._search, self._folder, self._told = search, folder, told
        self._supervised = under(self._base, plan.spec.arm("on"))
        self._robustness = Robustness(formula, self._supervised.supervisor().supervisor.period_s)
        self._space = {n: Distribution(uniform=b) for n, b in search.bounds.items()} or self._base.distributions
        if not self._space:
            raise ConfigError(self._base.id, "draws no parameter", "; name bounds")
        self._identity = digest([plan.identity, formula])
        # as it will be read from the ledger; a longer search goes on from a shorter one
        settings = msgspec.json.decode(msgspec.json.encode(search))
        self.facts = {**plan.identity, "search": {k: v for k, v in settings.items() if k not in ("runs", "cases")}}
        self._kept = False
        self._failed: Counter[str] = Counter()
        self.found = Found(self._base.id, formula, {n: support(d) for n, d in self._space.items()})
        self._steps = self._search_steps()
        self._asked: list[str] = []
        self._queue: deque[tuple[str, _Wanted]] = deque()
        self._outcomes: dict[str, _Outcome] = {}
        self._over = False

    def next(self) -> tuple[str, Job] | None:
        """The next run; None while one is out on whose result the next depends, and at the end."""
        while not self._queue:
            if self._over or len(self._outcomes) < len(self._asked):
                return None
            results = [self._outcomes[key] for key in self._asked]
            try:
                self._ask(self._steps.send(results) if self._asked else next(self._steps))
            except StopIteration:
                self._over = True
        key, wanted = self._queue.popleft()
        scenario = (self._supervised if wanted.supervised else self._base).with_(wanted.parameters)
        return key, Job(scenario, "on" if wanted.supervised else "off", wanted.seed, detail=wanted.supervised)

    def done(self, key: str, result: Run | Failure, wall_s: float) -> None:  # noqa: ARG002 # the source of a stream
        """Write a result down."""
        outcome = self._outcome(result)
        # what it depends on is kept with the first result: a search that never got that far binds nobody
        self.ledger.put_meta(**{key: outcome}, **({} if self._kept else {"falsify": self.facts}))
        self._kept = True
        self._take(key, outcome)

    def _ask(self, wanted: Sequence[_Wanted]) -> None:
        keyed = [(digest([self._identity, w]), w) for w in wanted]
        self._asked, self._outcomes = [key for key, _ in keyed], {}
        for key, w in keyed:
            known = self.ledger.known(key, _Outcome)
            if known is None:
                self._queue.append((key, w))
            else:
                self._note(known=self.found.known + 1)
                self._take(key, known)

    def _take(self, key: str, outcome: _Outcome) -> None:
        self._outcomes[key] = outcome
        self._note(runs=self.found.runs + 1)
        if outcome.status != "ok":
            self._failed[outcome.status] += 1
            self._note(failed=dict(self._failed))
        if self._told is not None:
            self._told(self.found)

    def _note(self, **changed: Any) -> None:
        self.found = msgspec.structs.replace(self.found, **changed)

    def _outcome(self, result: Run | Failure) -> _Outcome:
        if isinstance(result, Failure):
            if result.kind == "bad-input":
                raise BadInputError(self._base.id, result.detail)
            return _Outcome(result.kind, result.detail)
        hit = next((e for e in result.events if e.mode == result.mode), None)
        said = (
            f"{hit.id} at {hit.stamp_ns / 1e9:.3f} s, {hit.value:.4g} {hit.unit} (limit {hit.limit:g})" if hit else ""
        )
        if not result.series:  # nobody judged
            return _Outcome("ok", accident=said)
        value = self._robustness.of(result.series)
        if math.isnan(value):
            return _Outcome("nan", f"the robustness of {self._robustness.formula!r} is not a number")
        return _Outcome("ok", robustness=value, accident=said)

    def _search_steps(self) -> _Steps:
        """The search: gives the runs that it wants, is sent their outcomes."""
        search, seeds = self._search, range(self._search.seed, self._search.seed + self._search.seeds)
        optimiser = Optimiser(self._space, search.kind, search.seed)
        while (count := min(BATCH, (search.runs - self.found.runs) // search.seeds)) > 0:
            points = [optimiser.ask() for _ in range(count)]
            outcomes = yield [_Wanted(values, seed) for _, values in points for seed in seeds]
            before = len(self.found.cases)
            candidates: list[tuple[float, dict[str, float]]] = []
            for k, (trial, values) in enumerate(points):
                mine = outcomes[k * search.seeds : (k + 1) * search.seeds]
                seen = [o.robustness for o in mine if o.robustness is not None]
                value = statistics.median(seen) if seen else None
                optimiser.tell(trial, value)
                if value is None:
                    continue
                if self.found.robustness is None or value < self.found.robustness:
                    self._note(best=values, robustness=value)
                if 2 * sum(bool(o.accident) for o in mine) > search.seeds:
                    candidates.append((value, values))
            for value, values in sorted(candidates, key=lambda c: c[0]):
                self._note(candidates=self.found.candidates + 1)
                yield from self._confirm(value, values)
                if len(self.found.cases) > before:
                    break  # what is near a case is no second one
            if len(self.found.cases) == search.cases:
                return
            if len(self.found.cases) > before:
                optimiser = Optimiser(self._space, search.kind, search.seed + len(self.found.cases))

    def _confirm(self, value: float, values: dict[str, float]) -> _Steps:
        """Try a candidate on fresh seeds."""
        first = self._search.seed + self._search.seeds
        fresh = range(first, first + FRESH)
        on = yield [_Wanted(values, seed) for seed in fresh]
        hit = [seed for seed, o in zip(fresh, on, strict=True) if o.accident]
        if 2 * len(hit) <= FRESH:
            return
        unsupervised = _share((yield [_Wanted(values, seed, supervised=False) for seed in fresh]))
        file = self._folder / f"case-{len(self.found.cases) + 1}.toml"
        case = Falsified(
            str(file), values, value, _share(on), unsupervised, hit[0], on[hit[0] - first].accident, self.found.runs
        )
        file.write_text(_scenario_text(self._supervised, case))
        self._note(cases=(*self.found.cases, case))


def _share(outcomes: Sequence[_Outcome]) -> Rate:
    ran = [o for o in outcomes if o.status == "ok"]
    return wilson(sum(bool(o.accident) for o in ran), len(ran))


def _scenario_text(scenario: Scenario, case: Falsified) -> str:
    """A scenario file of a case."""
    on, off = case.supervised, case.unsupervised
    fixed = msgspec.structs.replace(
        scenario.with_(case.parameters),
        id=f"{scenario.id}-{Path(case.file).stem}",
        title=f"{scenario.title}: the supervised accident happens",
        expect="accident" if 2 * off.k > off.n else "open",
        severity=None,
        seed=case.seed,
    )
    note = (
        f"# Found by foreshock falsify {scenario.id}: with these parameters the accident happens under the supervisor\n"
        f"# in {on.k} of {on.n} fresh seeds, and without one in {off.k} of {off.n}. With this file's seed:\n"
        f"# {case.accident}.\n"
        f"# Replay: foreshock simulate {Path(case.file).name}\n\n"
    )
    tables = {k: v for k, v in msgspec.to_builtins(fixed).items() if v not in ({}, (), [], "")}
    return note + tomli_w.dumps(_without_none(tables))


def _without_none(value: Any) -> Any:
    """Tables without None, which TOML cannot say."""
    if isinstance(value, Mapping):
        return {k: _without_none(v) for k, v in value.items() if v is not None}
    if isinstance(value, (list, tuple)):
        return [_without_none(v) for v in value]
    return value
