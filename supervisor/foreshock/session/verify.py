"""What a supervisor is worth per accident mode: paired runs of the mode's scenarios, counted with intervals.

Arms, paired by seed: *shadow* (judges, does not act: the unsupervised rate, and when the precursors came), *on*, and
two that tell whether the moment matters: the very interventions of the supervised run begun at another moment
(*random*, uniform over the scenario's time), and all of its actions held from the start (*always*).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from statistics import quantiles

import msgspec
import numpy as np

from foreshock.records import Intervention, ProtectionLevel
from foreshock.session.isolated import Failure, Job, run_all
from foreshock.session.rates import Frequency, Rate, per_hour, wilson
from foreshock.session.run import Run
from foreshock.session.scenario import Scenario
from foreshock.session.scripted import held, moved
from foreshock.taxonomy import builtin_taxonomy

__all__ = ["AIMS", "Cascade", "ModeResult", "Plan", "plan_of", "verify"]

Done = Callable[[int, Run | Failure], None]


class Plan(msgspec.Struct, frozen=True):
    """What is run for one mode: the scenario with the accident, and those in which nobody comes to harm."""

    mode: str
    accident: Scenario
    harmless: tuple[Scenario, ...]

    def rounds(self, hours: float) -> int:
        """How many seeds of every harmless scenario make up so many hours."""
        each_s = sum(s.duration_s for s in self.harmless)
        return math.ceil(3600.0 * hours / each_s) if each_s else 0

    def runs(self, seeds: int, hours: float) -> int:
        """How many runs this is, but for those that look into false interventions."""
        return 4 * seeds + len(self.harmless) * self.rounds(hours)


class Cascade(msgspec.Struct, frozen=True):
    """How unsupervised accidents announced themselves.

    Attributes:
        found: those before which all precursors of Table 3 were found.
        ordered: of the found, those in Table 3's order (two in one tick count as ordered).
        first_s: median time from the first of the precursors to each, over the found.
        gated: those before which T fell below the protective gate.
        lead_s: quartiles of the time from there to the accident.
    """

    found: Rate
    ordered: Rate
    first_s: dict[str, float]
    gated: Rate
    lead_s: tuple[float, float, float] | None


class ModeResult(msgspec.Struct, frozen=True):
    """What was found for one mode.

    Attributes:
        mode: its code.
        scenario: id of the scenario with the accident.
        unsupervised: shadow runs that ended in the accident.
        supervised: supervised ones.
        caused: runs with an accident of any mode supervised and none unsupervised: letting go may drop what is held.
        cascade: how the unsupervised accidents announced themselves.
        false: runs of harmless scenarios that reached the protective level and whose paired shadow run came to no harm.
        harmed: runs of harmless scenarios, supervised, with an accident of any mode.
        at_random: accidents with the same interventions begun at a random time.
        always: accidents with all of the actions held from the start.
        failures: runs that gave no result.
    """

    mode: str
    scenario: str
    unsupervised: Rate
    supervised: Rate
    caused: int
    cascade: Cascade
    false: Frequency
    harmed: int
    at_random: Rate
    always: Rate
    failures: int

    def missed(self) -> tuple[str, ...]:
        """The aims that this result misses, in words; nothing was run is a miss."""
        lead = self.cascade.lead_s[1] if self.cascade.lead_s is not None else math.nan
        values = {
            "unsupervised": _share(self.unsupervised),
            "supervised": _share(self.supervised),
            "cascade": _share(self.cascade.found),
            "lead": lead,
            "false": self.false.per_hour,
        }
        return tuple(
            f"{name} {values[name]:.2f} (aim {'at least' if least else 'at most'} {aim:g})"
            for name, (aim, least) in AIMS.items()
            if not (values[name] >= aim if least else values[name] <= aim)
        )


AIMS: Mapping[str, tuple[float, bool]] = {
    "unsupervised": (0.9, True),
    "supervised": (0.1, False),
    "cascade": (0.9, True),
    "lead": (0.5, True),
    "false": (1.0, False),
}
"""Per mode: the aim, and whether more is better."""


def _share(rate: Rate) -> float:
    return rate.k / rate.n if rate.n else math.nan


def plan_of(mode: str, scenarios: Mapping[str, Scenario]) -> Plan | None:
    """The first scenario of the mode with the accident, and all harmless ones; None if there is none with it."""
    mine = [s for _, s in sorted(scenarios.items()) if s.mode == mode]
    accident = next((s for s in mine if s.expect == "accident"), None)
    return None if accident is None else Plan(mode, accident, tuple(s for s in mine if s.expect == "none"))


def verify(
    plans: Sequence[Plan], seeds: int, first_seed: int, hours: float, workers: int = 1, done: Done | None = None
) -> list[ModeResult]:
    """Run the scenarios of modes and count.

    Args:
        plans: what to run.
        seeds: runs of each arm of the scenarios with an accident.
        first_seed: seeds begin here.
        hours: of harmless operation per mode, supervised; rounded up to whole runs.
        workers: number of processes.
        done: told of each run as it ends.
    """
    every = range(first_seed, first_seed + seeds)
    jobs: list[Job] = []
    spans: list[slice] = []
    for plan in plans:
        first = len(jobs)
        jobs += [Job(plan.accident, arm, s, detail=False) for arm in ("shadow", "on") for s in every]
        rounds = range(first_seed, first_seed + plan.rounds(hours))
        jobs += [Job(scenario, "on", s, detail=False) for scenario in plan.harmless for s in rounds]
        spans.append(slice(first, len(jobs)))
    results = run_all(jobs, workers, None, done)
    later_jobs: list[Job] = []
    later_spans: list[slice] = []
    for plan, span in zip(plans, spans, strict=True):
        first = len(later_jobs)
        later_jobs += _after(plan, every, jobs[span], results[span])
        later_spans.append(slice(first, len(later_jobs)))
    later = run_all(later_jobs, workers, None, done)
    return [_judged(plan, seeds, results[a], later[b]) for plan, a, b in zip(plans, spans, later_spans, strict=True)]


def _after(plan: Plan, every: Sequence[int], jobs: Sequence[Job], results: Sequence[Run | Failure]) -> list[Job]:
    """Runs that follow from the supervised ones: their actions at random and always; what protective levels averted."""
    n = len(every)
    on = results[n : 2 * n]
    pairs = [(s, _changes(r)) for s, r in zip(every, on, strict=True)]
    duration_s = plan.accident.duration_s
    after = [Job(plan.accident, "off", s, False, moved(changes, duration_s, s)) for s, changes in pairs]
    after += [Job(plan.accident, "off", s, False, held(changes)) for s, changes in pairs]
    after += [
        Job(job.scenario, "off", job.seed, detail=False)
        for job, run in zip(jobs[2 * n :], results[2 * n :], strict=True)
        if isinstance(run, Run) and run.max_level >= ProtectionLevel.PROTECTIVE
    ]
    return after


def _judged(plan: Plan, n: int, results: Sequence[Run | Failure], later: Sequence[Run | Failure]) -> ModeResult:
    shadow, on = results[:n], results[n : 2 * n]
    pairs = [(a, b) for a, b in zip(shadow, on, strict=True) if isinstance(a, Run) and isinstance(b, Run)]
    harmless = [r for r in results[2 * n :] if isinstance(r, Run)]
    return ModeResult(
        plan.mode,
        plan.accident.id,
        unsupervised=_accidents(shadow),
        supervised=_accidents(on),
        caused=sum(b.harmed and not a.harmed for a, b in pairs),
        cascade=_cascade(plan.mode, [r for r in shadow if isinstance(r, Run) and r.accident]),
        false=per_hour(
            sum(isinstance(r, Run) and not r.events for r in later[2 * n :]), sum(r.end_s for r in harmless) / 3600.0
        ),
        harmed=sum(r.harmed for r in harmless),
        at_random=_accidents(later[:n]),
        always=_accidents(later[n : 2 * n]),
        failures=sum(isinstance(r, Failure) for r in (*results, *later)),
    )


def _accidents(results: Sequence[Run | Failure]) -> Rate:
    runs = [r for r in results if isinstance(r, Run)]
    return wilson(sum(r.accident for r in runs), len(runs))


def _cascade(mode: str, fell: Sequence[Run]) -> Cascade:
    taxonomy = builtin_taxonomy()
    kinds = [taxonomy.kind(k).id for k in taxonomy.mode(mode).cascade]
    found, ordered, leads = 0, 0, []
    times: dict[str, list[float]] = {k: [] for k in kinds}
    for run in fell:
        at_s = min(e.stamp_ns for e in run.events if e.mode == mode) / 1e9
        seen = {k: run.first_s[k] for k in kinds if run.first_s.get(k, math.inf) < at_s}
        if len(seen) == len(kinds):
            found += 1
            ordered += list(seen.values()) == sorted(seen.values())
            for k in kinds:
                times[k].append(seen[k] - min(seen.values()))
        gate_s = run.gate_s.get("protective", math.inf)
        if gate_s < at_s:
            leads.append(at_s - gate_s)
    return Cascade(
        wilson(found, len(fell)),
        wilson(ordered, found),
        {k: float(np.median(t)) for k, t in times.items() if t},
        wilson(len(leads), len(fell)),
        _quartiles(leads),
    )


def _quartiles(values: Sequence[float]) -> tuple[float, float, float] | None:
    if not values:
        return None
    low, middle, high = quantiles(values, n=4, method="inclusive") if len(values) > 1 else (values[0],) * 3
    return low, middle, high


def _changes(result: Run | Failure) -> tuple[Intervention, ...]:
    return () if isinstance(result, Failure) else result.interventions
