"""Runs in shadow in watched child processes, each with the stretches that its detectors saw."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple, cast

import msgspec

from foreshock.clock import seconds
from foreshock.errors import TwinError
from foreshock.events._stretches import Stretches
from foreshock.events.schema import EventPrecursor
from foreshock.registry import Registry
from foreshock.session.isolated import Failure, Job, _limit_s, _pool, _result, _scratch, build_twin
from foreshock.session.run import Run
from foreshock.session.simulate import simulate
from foreshock.supervisor import Supervisor

__all__ = ["Observed", "observe_all"]


class Observed(NamedTuple):
    """A run, and every stretch of a precursor of its scenario's mode that began before the first accident, if any."""

    run: Run
    precursors: tuple[EventPrecursor, ...]


_BENCH: dict[bytes, Any] = {}
"""Twins and supervisors that this worker has built, by what they were built from."""


def _observe(job: Job, scratch: str) -> Observed:
    """In the worker: do one run, reusing what was built for the same twin and configuration."""
    registry: Registry = _BENCH.setdefault(b"registry", Registry())
    scenario = job.scenario
    twin_key = msgspec.json.encode(("twin", scenario.twin, scenario.folder), order="sorted")
    if twin_key not in _BENCH:
        _BENCH[twin_key] = build_twin(scenario, registry, Path(scratch) / f"worker-{os.getpid()}-{len(_BENCH)}")
    key = msgspec.json.encode(("supervisor", scenario.config), order="sorted")
    if key not in _BENCH:
        _BENCH[key] = Supervisor(scenario.supervisor(), Path(scenario.folder), registry)
    judge: Supervisor = _BENCH[key]
    kept = Stretches(judge.taxonomy.kinds_of(scenario.mode))
    try:
        run = simulate(scenario, _BENCH[twin_key], judge, "shadow", job.seed, detail=False, journals=[kept])
    except TwinError:
        _BENCH.pop(twin_key).close()
        raise
    until_s = min([seconds(e.stamp_ns) for e in run.events if e.mode], default=run.end_s)
    return Observed(run, kept.found(until_s))


def observe_all(
    jobs: Sequence[Job],
    workers: int = 1,
    timeout_s: float | None = None,
    done: Callable[[int, Run | Failure], None] | None = None,
) -> list[Observed | Failure]:
    """Do all jobs as session.isolated.run_all does, without series but with what was seen; results in their order.

    Args:
        jobs: in shadow.
        workers: number of processes.
        timeout_s: wall-clock limit of one run; by default 60 s and ten times the simulated time.
        done: told of each result as it comes, with its index.

    Raises:
        BadInputError: a job names something that does not exist: every job of its kind would fail.
    """
    results: list[Observed | Failure] = []
    with _scratch() as scratch, _pool(workers, scratch) as pool:
        limits = [_limit_s(job, timeout_s) for job in jobs]
        futures = [
            pool.schedule(_observe, args=[job, str(scratch)], timeout=limit)
            for job, limit in zip(jobs, limits, strict=True)
        ]
        for k, (job, future, limit) in enumerate(zip(jobs, futures, limits, strict=True)):
            result = cast("Observed | Failure", _result(job, future, limit, scratch))
            results.append(result)
            if done is not None:
                done(k, result if isinstance(result, Failure) else result.run)
    return results
