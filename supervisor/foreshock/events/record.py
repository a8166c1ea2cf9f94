"""Simulated runs as events: what the detectors saw of a run that nobody intervened in, and how it ended."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from foreshock.errors import BadInputError
from foreshock.events._template import deviation_of, relation_of, tasks_of
from foreshock.events.schema import NO_ACCIDENT, Event, EventPrecursor
from foreshock.evidence import Window
from foreshock.session.isolated import Failure, Job, run_all
from foreshock.session.run import Run
from foreshock.session.scenario import Scenario
from foreshock.taxonomy import Taxonomy, builtin_taxonomy

__all__ = ["CODER", "SIMULATED", "episode", "jobs", "record"]

SIMULATED = "simulated"
"""The source of events that a simulator produced."""

CODER = "detectors"

BATCH = 16
"""Runs per worker that are held at a time: a run keeps all its series."""

STREAM = 1
"""Of the draws of parameters; other streams of the same seed belong to plants and sensors."""


def episode(
    run: Run,
    *,
    task: str = "",
    platform: str = "",
    window: Window | None = None,
    taxonomy: Taxonomy | None = None,
) -> Event:
    """A run as an event.

    A run's timeline tells which precursors of its scenario's mode are within the window. An onset is when one enters
    it; one that comes back while it is still there has no onset of its own. It is over one window before it leaves,
    and lasts to the end if it never does. Severity is not in the timeline and is 1. The outcome is the first accident.

    Args:
        run: judged but not acted on (shadow), with its timeline (detail).
        task: by default the most plausible one of the mode.
        platform: the robot.
        window: of the supervisor that judged; the default one if not given.
        taxonomy: of the supervisor; the paper's if not given.

    Raises:
        BadInputError: the run was not judged, or has no timeline: then nothing is known of its precursors.
        ConfigError: a kind that the taxonomy does not have.
    """
    if run.supervisor == "off" or not run.timeline:
        lacks = "was not judged" if run.supervisor == "off" else "has no timeline"
        raise BadInputError(f"run {run.scenario}, seed {run.seed}", lacks, "; run it in shadow, with detail")
    accidents = [e for e in run.events if e.mode]
    outcome, outcome_s = (accidents[0].mode, accidents[0].stamp_ns / 1e9) if accidents else (NO_ACCIDENT, None)
    until = run.end_s if outcome_s is None else outcome_s
    precursors = tuple(p for p in _precursors(run, window or Window()) if p.onset_s <= until)
    task = task or tasks_of(run.mode)[0]
    values = ", ".join(f"{name}={value:g}" for name, value in sorted(run.parameters.items()))
    story = [(p.onset_s, f"{p.kind} {p.subject}".strip()) for p in precursors]
    story += [(e.stamp_ns / 1e9, e.id) for e in run.events if e.stamp_ns / 1e9 <= until]
    return Event(
        f"{run.scenario}-seed-{run.seed}",
        task,
        platform,
        f"{SIMULATED}{f' ({values})' if values else ''}",
        relation_of(task),
        deviation_of((p.kind for p in precursors), taxonomy or builtin_taxonomy()),
        precursors,
        ", then ".join(f"{what} at {t:.3f} s" for t, what in sorted(story)),
        outcome,
        outcome_s,
        run.end_s,
        CODER,
        source=SIMULATED,
    )


def _precursors(run: Run, window: Window) -> list[EventPrecursor]:
    lag = window.length_s * (5 if window.kernel == "exponential" else 1)
    begun: dict[str, float] = {}
    found = []
    for row in run.timeline:
        inside = {name.removeprefix("+") for name in row.precursors}
        for name in sorted(begun.keys() - inside):
            onset = begun.pop(name)
            found.append(_precursor(name, onset, max(onset, round(row.t_s - lag, 6))))
        begun |= dict.fromkeys(inside - begun.keys(), row.t_s)
    found += [_precursor(name, onset, None) for name, onset in begun.items()]
    return sorted(found, key=lambda p: (p.onset_s, p.kind, p.subject))


def _precursor(name: str, onset_s: float, end_s: float | None) -> EventPrecursor:
    kind, _, subject = name.partition("@")
    return EventPrecursor(kind, onset_s, end_s, 1.0, subject)


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
            out.append(Job(scenario.with_(drawn), "shadow", seed))
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
    for start in range(0, len(todo), BATCH * workers):
        batch = todo[start : start + BATCH * workers]

        def told(k: int, result: Run | Failure, start: int = start) -> None:
            if done is not None:
                done(start + k, result)

        for job, result in zip(batch, run_all(batch, workers, timeout_s, told), strict=True):
            if isinstance(result, Run):
                config = job.scenario.supervisor()
                events.append(
                    episode(result, platform=config.supervisor.robot, window=config.window, taxonomy=taxonomy)
                )
    return events
