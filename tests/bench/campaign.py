"""A campaign of 2,000 short A1 runs beside the same runs in a bare FMPy loop that does the stepping and no more."""

from __future__ import annotations

import contextlib
import resource
import statistics
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from distributed import LocalCluster

from foreshock.campaign import Campaign, Progress, begin, execute, parse_campaign
from foreshock.campaign.cluster import dask_runner
from foreshock.campaign.engine import Runner
from foreshock.campaign.ledger import Ledger
from foreshock.containment import Contained
from foreshock.registry import Registry
from foreshock.session import isolated
from foreshock.session.isolated import Source, run_stream
from foreshock.supervisor import Supervisor
from foreshock_twins.fmi._twin import FmuTwin
from tests.bench.fmu_step import STEP_S, bare_slave
from tests.bench.rows import Row

__all__ = ["rows"]

RUNS, DURATION_S = 2000, 0.25
ROUNDS = 3
PARTS: tuple[tuple[str, type, str], ...] = (
    ("plant", FmuTwin, "reset"),
    ("plant", FmuTwin, "advance"),
    ("detectors", Contained, "tick"),
    ("reset", Supervisor, "reset"),
    ("supervisor", Supervisor, "step"),
    ("ledger", Ledger, "put"),
)


@contextmanager
def campaign(runs: int) -> Iterator[Campaign]:
    """So many supervised runs, in a folder that goes away."""
    text = {
        "id": "bench",
        "replicates": runs,
        "scenarios": [{"use": "a1-fall-onto-human", "duration_s": DURATION_S}],
        "arms": [{"id": "on", "kind": "on"}],
    }
    with tempfile.TemporaryDirectory() as folder:
        yield begin(parse_campaign(text, "bench"), Path(folder), Path(folder) / "out", Registry())


def spent_s() -> float:
    """CPU time of this process and of the children that have ended."""
    both = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(u.ru_utime + u.ru_stime for u in both)


def bare_ms(runs: int) -> float:
    """CPU time of a run that only steps."""
    with bare_slave() as (slave, _):
        begun = time.process_time_ns()
        for _ in range(runs):
            slave.reset()
            slave.enterInitializationMode()
            slave.exitInitializationMode()
            for k in range(round(DURATION_S / STEP_S)):
                slave.doStep(k * STEP_S, STEP_S)
        return (time.process_time_ns() - begun) / runs / 1e6


def whole_ms(runs: int) -> float:
    """CPU time of a run of a campaign, all processes and their start included."""
    with campaign(runs) as found:
        begun = spent_s()
        assert execute(found, 1)
        spent = spent_s() - begun
        assert [r.status for r in found.rows()] == ["ok"] * runs
    return spent / runs * 1e3


def parts_ms(runs: int) -> dict[str, float]:
    """CPU time of a run by part, with everything in this process."""
    spent = dict.fromkeys((name for name, _, _ in PARTS), 0)

    def timed(name: str, call: Callable[..., Any]) -> Callable[..., Any]:
        def wrapper(*args: Any, **kwargs: Any) -> Any:
            begun = time.thread_time_ns()
            try:
                return call(*args, **kwargs)
            finally:
                spent[name] += time.thread_time_ns() - begun

        return wrapper

    def here(source: Source[str], workers: int, timeout_s: float | None, folder: Path) -> None:
        while (given := source.next()) is not None:
            source.done(given[0], *isolated._timed(given[1], str(folder)))
            if not total:  # the first has built twin and detectors
                total.append(time.thread_time_ns())
                spent.update(dict.fromkeys(spent, 0))
        total.append(time.thread_time_ns())

    total: list[int] = []
    with contextlib.ExitStack() as stack:
        for name, owner, method in PARTS:
            original = getattr(owner, method)
            setattr(owner, method, timed(name, original))
            stack.callback(setattr, owner, method, original)
        found = stack.enter_context(campaign(runs + 1))
        assert execute(found, 1, runner=here)
    spent["model"] = spent.pop("supervisor") - spent["detectors"]
    spent["detectors"] += spent.pop("reset")
    spent["run"] = total[1] - total[0] - sum(spent.values())
    return {name: ns / runs / 1e6 for name, ns in spent.items()}


def pace_hz(runs: int, workers: int, runner: Callable[[Campaign], Runner]) -> float:
    """Runs per second of wall time, from the tenth part on: until then processes start and build."""
    at: list[tuple[int, float]] = []

    def told(p: Progress) -> None:
        if p.done >= runs // 10:
            at.append((p.done, time.perf_counter()))

    with campaign(runs) as found:
        assert execute(found, workers, runner=runner(found), told=told)
    return (at[-1][0] - at[0][0]) / (at[-1][1] - at[0][1])


def rows() -> list[Row]:
    """What a run costs beside the bare loop, by part; two workers beside one; a cluster beside the local engine."""
    bare, some = bare_ms(RUNS), max(RUNS // 10, 40)
    # the machine's pace changes: the parts before and after the whole
    before, whole, after = parts_ms(some), whole_ms(RUNS), parts_ms(some)
    parts = {name: (before[name] + after[name]) / 2.0 for name in before}
    parts["processes"] = max(whole - sum(parts.values()), 0.0)
    other = whole - parts["plant"] - parts["detectors"]
    named = ", ".join(f"{name} {ms:.2f}" for name, ms in parts.items())
    share = other / whole
    paces: list[tuple[float, float, float]] = []
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        for _ in range(ROUNDS):
            one, two = (pace_hz(some, n, lambda _: run_stream) for n in (1, 2))
            dask = pace_hz(some, 2, lambda c: dask_runner(cluster.scheduler_address, c.plan))
            paces.append((one, two, dask))
    one, two, dask = (statistics.median(column) for column in zip(*paces, strict=True))
    workers = statistics.median(b / a for a, b, _ in paces)
    on_dask = statistics.median(b / c for _, b, c in paces)
    run = f"run of {DURATION_S:g} s of A1"
    return [
        Row(
            f"{run}: {RUNS} in a campaign ({named})", whole, "ms CPU", bare, "bare FMPy doStep", whole / bare, "-", True
        ),
        Row(f"{run}: all but plant and detectors", other, "ms CPU", whole, "the whole", share, "< 0.20", share < 0.2),
        Row(f"{run}: two workers", two, "runs/s", one, "one worker", workers, "> 1.8 x", workers > 1.8),
        Row(f"{run}: two workers", two, "runs/s", dask, "Dask, two workers", on_dask, "< 1.3 x", on_dask < 1.3),
    ]
