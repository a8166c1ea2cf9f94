"""Simulated runs as events: what the detectors saw of a run that nobody intervened in, and how it ended."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from foreshock.errors import BadInputError
from foreshock.events._observed import Observed, observe_all
from foreshock.events._template import deviation_of, relation_of, tasks_of
from foreshock.events.schema import NO_ACCIDENT, Event, EventPrecursor
from foreshock.session.isolated import Failure, Job
from foreshock.session.run import Run
from foreshock.session.scenario import Scenario
from foreshock.taxonomy import Taxonomy, builtin_taxonomy

__all__ = ["CODER", "SIMULATED", "episode", "jobs", "record"]

SIMULATED = "simulated"
"""The source of events that a simulator produced."""

CODER = "detectors"

STREAM = 1
"""Of the draws of parameters; other streams of the same seed belong to plants and sensors."""


def episode(
    run: Run,
    precursors: Sequence[EventPrecursor],
    *,
    task: str = "",
    platform: str = "",
    taxonomy: Taxonomy | None = None,
) -> Event:
    """A run as an event. The outcome is the first accident; what began after it announced nothing and is left out.

    Args:
        run: judged but not acted on (shadow).
        precursors: what its detectors saw, every stretch of presence with its highest severity.
        task: by default the most plausible one of the mode.
        platform: the robot.
        taxonomy: of the supervisor; the paper's if not given.

    Raises:
        BadInputError: the run was not judged: then nothing is known of its precursors.
        ConfigError: a kind that the taxonomy does not have.
    """
    if run.supervisor == "off":
        raise BadInputError(f"run {run.scenario}, seed {run.seed}", "was not judged", "; run it in shadow")
    accidents = [e for e in run.events if e.mode]
    outcome, outcome_s = (accidents[0].mode, accidents[0].stamp_ns / 1e9) if accidents else (NO_ACCIDENT, None)
    until = run.end_s if outcome_s is None else outcome_s
    before = tuple(p for p in precursors if p.onset_s <= until)
    task = task or tasks_of(run.mode)[0]
    values = ", ".join(f"{name}={value:g}" for name, value in sorted(run.parameters.items()))
    story = [(p.onset_s, f"{p.kind} {p.subject}".strip()) for p in before]
    story += [(e.stamp_ns / 1e9, e.id) for e in run.events if e.stamp_ns / 1e9 <= until]
    return Event(
        f"{run.scenario}-seed-{run.seed}",
        task,
        platform,
        f"{SIMULATED}{f' ({values})' if values else ''}",
        relation_of(task),
        deviation_of((p.kind for p in before), taxonomy or builtin_taxonomy()),
        before,
        ", then ".join(f"{what} at {t:.3f} s" for t, what in sorted(story)),
        outcome,
        outcome_s,
        run.end_s,
        CODER,
        source=SIMULATED,
    )


def jobs(
    scenarios: Sequence[Scenario], seeds: Sequence[int], vary: Mapping[str, tuple[float, float]] | None = None
) -> list[Job]:
    """One run in shadow per scenario and seed.

    Args:
        scenarios: with distinct ids.
        seeds: of plant, sensors and parameters.
        vary: parameters that are drawn uniformly from [low, high) for each seed, the same in all scenarios.

    Raises:
        BadInputError: two scenarios or seeds are the same, or low is above high.
    """
    for what, items in (("scenario", [s.id for s in scenarios]), ("seed", [str(seed) for seed in seeds])):
        if twice := sorted({i for i in items if items.count(i) > 1}):
            raise BadInputError("record", f"{what} {twice[0]} stands there twice")
    for name, (low, high) in (vary or {}).items():
        if not low <= high:
            raise BadInputError(f"vary {name}", f"{low:g} is above {high:g}")
    out = []
    for scenario in scenarios:
        for seed in seeds:
            rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(STREAM,)))
            drawn = {name: float(rng.uniform(low, high)) for name, (low, high) in sorted((vary or {}).items())}
            out.append(Job(scenario.with_(drawn), "shadow", seed, detail=False))
    return out


def record(
    scenarios: Sequence[Scenario],
    seeds: Sequence[int],
    vary: Mapping[str, tuple[float, float]] | None = None,
    *,
    workers: int = 1,
    timeout_s: float | None = None,
    done: Callable[[int, Run | Failure], None] | None = None,
    taxonomy: Taxonomy | None = None,
) -> list[Event]:
    """Run scenarios in shadow and give their events; a run that failed gives none, and done is told of it.

    Args:
        scenarios: what to run.
        seeds: each of them once per scenario.
        vary: see jobs.
        workers: number of processes.
        timeout_s: wall-clock limit of one run; see session.isolated.run_all.
        done: told of each run as it ends, with its index in jobs.
        taxonomy: with the kinds of the installed plugins; the paper's if not given.

    Raises:
        BadInputError: see jobs; or a scenario names something that does not exist.
    """
    todo = jobs(scenarios, seeds, vary)
    events = []
    for job, result in zip(todo, observe_all(todo, workers, timeout_s, done), strict=True):
        if isinstance(result, Observed):
            robot = job.scenario.supervisor().supervisor.robot
            events.append(episode(result.run, result.precursors, platform=robot, taxonomy=taxonomy))
    return events
