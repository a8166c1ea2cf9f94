"""Runs in watched child processes: a hang, a crash or an error of one run is classified and costs no other run.

Plant and supervisor run together in one worker (a pipe per step would cost more than the step), which keeps both and
reuses them by reset. Everything temporary lies in one scratch folder that the parent removes.
"""

from __future__ import annotations

import gc
import math
import os
import signal
import sys
import tempfile
import threading
from collections.abc import Callable, Hashable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, wait
from concurrent.futures import TimeoutError as FutureTimeout
from contextlib import closing, contextmanager, suppress
from multiprocessing import get_context
from pathlib import Path
from typing import Any, Protocol, TypeVar

import msgspec
from pebble import ProcessExpired, ProcessPool

from foreshock._strict import convert
from foreshock.clock import monotonic_ns, seconds
from foreshock.errors import BadInputError, ForeshockError, TwinError
from foreshock.journal import Journal
from foreshock.records import Intervention
from foreshock.registry import Registry
from foreshock.session.run import Arm, Run
from foreshock.session.scenario import Scenario
from foreshock.session.simulate import simulate
from foreshock.supervisor import Supervisor
from foreshock.twin import Recorder, Twin

__all__ = ["Failure", "Job", "Source", "Workers", "build_twin", "placed", "run_all", "run_one", "run_stream"]

K = TypeVar("K", bound=Hashable)


class Job(msgspec.Struct, frozen=True):
    """One run to do.

    scripted interventions are decided by nobody; journal is the file to record it in, or empty; poses is the file for
    what moved, or empty.
    """

    scenario: Scenario
    arm: Arm
    seed: int
    detail: bool = True
    scripted: tuple[Intervention, ...] = ()
    journal: str = ""
    poses: str = ""


class Failure(msgspec.Struct, frozen=True):
    """A run that gave no result: kind as in TwinError, and what was said."""

    job: Job
    kind: str
    detail: str
    log: str = ""


def build_twin(scenario: Scenario, registry: Registry, scratch: Path) -> Twin:
    """The twin that a scenario names, with its files in scratch."""
    place = f"{scenario.id}: twin"
    spec = registry.twin(scenario.twin["kind"], f"{place}.kind")
    table = placed({k: v for k, v in scenario.twin.items() if k != "kind"}, Path(scenario.folder))
    scratch.mkdir(parents=True, exist_ok=True)
    return spec.build(convert(table, spec.config, place), scenario.supervisor().supervisor.robot, scratch)


POSES_HZ = 50.0
"""Twice the rate of a film."""

_BENCH: dict[bytes, Any] = {}
"""Twins and supervisors that this worker has built, by what they were built from; the last used come last."""
_ROOM = 24
"""So many of them are kept: the arms of one scenario fit many times over."""


def placed(table: dict[str, Any], folder: Path) -> dict[str, Any]:
    """A twin's table with its paths starting from a folder, those of its parts and of its robot as well."""
    result = dict(table)
    for key in ("fmu", "binding", "plant", "model", "srdf"):
        value = table.get(key)
        if isinstance(value, str) and value and (key != "plant" or "/" in value):
            result[key] = str(folder / value)
    if isinstance(robot := table.get("robot"), dict):
        result["robot"] = placed(robot, folder)
    parts = table.get("parts")
    if isinstance(parts, dict):
        result["parts"] = {k: placed(v, folder) if isinstance(v, dict) else v for k, v in parts.items()}
    return result


def _work(job: Job, scratch: str) -> Run:
    """In the worker: do one run, reusing what was built for the same twin and configuration."""
    return _timed(job, scratch)[0]


def _timed(job: Job, scratch: str) -> tuple[Run, float]:
    """In the worker: one run, and its wall time in s without what was built for it."""
    if b"registry" not in _BENCH:
        _BENCH[b"registry"] = Registry()  # reads every package's entry points: as long as many a run
    registry: Registry = _BENCH[b"registry"]
    twin_key = msgspec.json.encode(("twin", job.scenario.twin, job.scenario.folder), order="sorted")
    if twin_key not in _BENCH:
        folder = Path(scratch) / f"worker-{os.getpid()}-{monotonic_ns()}"
        _BENCH[twin_key] = build_twin(job.scenario, registry, folder)
    twin = _BENCH[twin_key] = _BENCH.pop(twin_key)
    judge: Supervisor | None = None
    if job.arm != "off":
        key = msgspec.json.encode(("supervisor", job.scenario.config, job.scenario.folder), order="sorted")
        if key not in _BENCH:
            _BENCH[key] = Supervisor(job.scenario.supervisor(), Path(job.scenario.folder), registry)
        gc.freeze()  # a full collection would walk through all that set-up made, in the middle of a tick
        judge = _BENCH[key] = _BENCH.pop(key)
    _make_room()
    if isinstance(twin, Recorder):
        twin.record(POSES_HZ if job.poses else 0.0)
    elif job.poses:
        raise BadInputError(f"{job.scenario.id}: twin", f"{job.scenario.twin['kind']!r} keeps no poses for pictures")
    try:
        with closing_all(_journals(job)) as journals:
            begin_ns = monotonic_ns()
            run = simulate(
                job.scenario,
                twin,
                judge,
                job.arm,
                job.seed,
                detail=job.detail,
                scripted=job.scripted,
                journals=journals,
            )
            wall_s = seconds(monotonic_ns() - begin_ns)
            if isinstance(twin, Recorder) and job.poses:
                twin.save(Path(job.poses))
            return run, wall_s
    except Exception:  # whatever ended this run, the next one must not begin with what it left behind
        _BENCH.pop(twin_key).close()
        raise


def _make_room() -> None:
    """Close what was not used for longest; never the registry, nor what the run at hand needs, which comes last."""
    while len(_BENCH) > _ROOM:
        oldest = next(key for key in _BENCH if key != b"registry")
        _BENCH.pop(oldest).close()


def _journals(job: Job) -> list[Journal]:
    if not job.journal:
        return []
    from foreshock.recording import Head, McapJournal

    return [McapJournal(Path(job.journal), Head(job.scenario.config, job.scenario.folder, job.seed, 0))]


@contextmanager
def closing_all(journals: list[Journal]) -> Iterator[list[Journal]]:
    """Closes them, however the run ends: what was recorded must be readable."""
    try:
        yield journals
    finally:
        for journal in journals:
            journal.close()


def _die_with(parent: int) -> None:
    """End this process when its parent has ended, however that came about; a native hang lets this thread run."""
    never = threading.Event()
    while os.getppid() == parent:
        never.wait(0.5)
    os.kill(os.getpid(), signal.SIGKILL)


def _quiet(scratch: str) -> None:
    """Worker start: it dies with its pool, and what native code prints goes to a file, not into the results."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_die_with, args=[os.getppid()], daemon=True).start()
    sys.stdout.flush()
    fd = os.open(Path(scratch) / f"output-{os.getpid()}.log", os.O_CREAT | os.O_WRONLY | os.O_APPEND)
    os.dup2(fd, 1)
    os.dup2(fd, 2)
    os.close(fd)


@contextmanager
def _scratch(folder: Path | None = None) -> Iterator[Path]:
    with tempfile.TemporaryDirectory(prefix="foreshock-", dir=folder, ignore_cleanup_errors=True) as name:
        yield Path(name)


@contextmanager
def _pool(workers: int, scratch: Path) -> Iterator[ProcessPool]:
    pool = ProcessPool(max_workers=workers, context=get_context("spawn"), initializer=_quiet, initargs=[str(scratch)])
    try:
        yield pool
        pool.close()  # type: ignore[no-untyped-call]  # pebble has no types
    finally:
        pool.stop()  # type: ignore[no-untyped-call]  # as above
        pool.join()


def _limit_s(job: Job, timeout_s: float | None) -> float:
    return 60.0 + 10.0 * job.scenario.duration_s if timeout_s is None else timeout_s


def run_all(
    jobs: Sequence[Job],
    workers: int = 1,
    timeout_s: float | None = None,
    done: Callable[[int, Run | Failure], None] | None = None,
) -> list[Run | Failure]:
    """Do all jobs; results in their order.

    Args:
        jobs: what to run.
        workers: number of processes.
        timeout_s: wall-clock limit of one run, beyond which its worker is killed; by default 60 s and ten times the
            simulated time.
        done: told of each result as it comes, with its index.

    Raises:
        BadInputError: a job names something that does not exist: every job of its kind would fail.
    """
    results: list[Run | Failure] = []
    with _scratch() as scratch, _pool(workers, scratch) as pool:
        limits = [_limit_s(job, timeout_s) for job in jobs]
        futures = [
            pool.schedule(_work, args=[job, str(scratch)], timeout=limit)
            for job, limit in zip(jobs, limits, strict=True)
        ]
        for k, (job, future, limit) in enumerate(zip(jobs, futures, limits, strict=True)):
            result = _result(job, future, limit, scratch)
            results.append(result)
            if done is not None:
                done(k, result)
    return results


class Source(Protocol[K]):
    """What a stream of runs takes its jobs from and gives its results to; both may depend on each other."""

    def next(self) -> tuple[K, Job] | None:
        """The next job and a key to know it by; None if there is none now: asked again after each result."""

    def done(self, key: K, result: Run | Failure, wall_s: float) -> None:
        """A result, as soon as it is there; its wall time is NaN where it failed."""


class Workers:
    """Watched worker processes that stay until they are closed: jobs in, results out, from any thread.

    Args:
        count: number of processes.
        scratch: a folder for what is temporary; its owner removes it.
    """

    def __init__(self, count: int, scratch: Path) -> None:
        self._scratch = scratch
        self._pool = ProcessPool(
            max_workers=count, context=get_context("spawn"), initializer=_quiet, initargs=[str(scratch)]
        )

    def begin(self, job: Job, timeout_s: float | None = None) -> Any:
        """A future of the job, for result."""
        return self._pool.schedule(_timed, args=[job, str(self._scratch)], timeout=_limit_s(job, timeout_s))

    def result(self, job: Job, future: Any, timeout_s: float | None = None) -> tuple[Run | Failure, float]:
        """Wait for a result; with its wall time in s, which is NaN where it failed.

        Unlike run_all, a job that names something which does not exist fails alone, as ``bad-input``.
        """
        try:
            found = _result(job, future, _limit_s(job, timeout_s), self._scratch)
        except BadInputError as e:
            found = Failure(job, "bad-input", str(e))
        except ForeshockError as e:
            found = Failure(job, "error", f"{type(e).__name__}: {e}")
        return found if isinstance(found, tuple) else (found, math.nan)

    def close(self) -> None:
        """End the processes, and what they do."""
        self._pool.stop()  # type: ignore[no-untyped-call]  # pebble has no types
        self._pool.join()


def run_stream(source: Source[K], workers: int = 1, timeout_s: float | None = None, folder: Path | None = None) -> None:
    """Do jobs until there is none left and none runs; results in the order in which they come.

    Args:
        source: gives jobs and takes results.
        workers: number of processes.
        timeout_s: as in run_all.
        folder: where the scratch folder is made; the system's place for temporary files by default.
    """
    with _scratch(folder) as scratch, closing(Workers(workers, scratch)) as pool:
        running: dict[Any, tuple[K, Job]] = {}
        while True:
            # one more than there are workers: none waits for this process to write its result down
            while len(running) <= workers and (given := source.next()) is not None:
                running[pool.begin(given[1], timeout_s)] = given
            if not running:
                return
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                key, job = running.pop(future)
                source.done(key, *pool.result(job, future, timeout_s))


def _result(job: Job, future: Any, timeout_s: float, scratch: Path) -> Any:
    """What the worker gave, or a Failure."""
    try:
        return future.result()
    except FutureTimeout:
        late = f"no result within {timeout_s:g} s: hung, or slow (then raise the limit); killed"
        return Failure(job, "hang", late, _last_words(scratch))
    except ProcessExpired as e:
        code = e.exitcode
        how = signal.Signals(-code).name if isinstance(code, int) and code < 0 else f"exit code {code}"
        return Failure(job, "crash", f"the process of the twin ended by {how}", _last_words(scratch))
    except TwinError as e:
        return Failure(job, e.kind, e.detail, e.log)
    except ForeshockError:
        raise
    except Exception as e:  # noqa: BLE001 # whatever ends one run must not end the others
        return Failure(job, "error", f"{type(e).__name__}: {e}", _last_words(scratch))


def _last_words(scratch: Path, most: int = 4000) -> str:
    """The end of the newest logs in scratch."""
    found: list[tuple[float, Path]] = []
    for path in scratch.rglob("*.log"):
        with suppress(FileNotFoundError):  # another worker has just closed its twin; below likewise
            found.append((path.stat().st_mtime, path))
    words = []
    for _, path in sorted(found)[-3:]:
        with suppress(FileNotFoundError):
            words.append(path.read_text(errors="replace")[-most:].strip())
    return "\n".join(filter(None, words))


def run_one(job: Job, timeout_s: float | None = None) -> Run:
    """Do one job in a watched process.

    Raises:
        TwinError: the run gave no result, classified.
    """
    result = run_all([job], 1, timeout_s)[0]
    if isinstance(result, Failure):
        raise TwinError(result.kind, result.detail, result.log)
    return result
