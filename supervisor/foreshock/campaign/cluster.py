"""The same campaign on a Dask cluster: chunks of runs go to its workers, which have watched processes of their own.

A worker's machine has the same Foreshock, plugins and files; that is checked before the first run.
"""

from __future__ import annotations

import math
import multiprocessing
import shutil
import tempfile
import threading
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from foreshock.campaign.engine import Runner
from foreshock.campaign.identity import changes, twin_files, versions
from foreshock.campaign.plan import Plan, files_of
from foreshock.campaign.spec import CampaignSpec
from foreshock.errors import BadInputError, MissingExtraError
from foreshock.registry import Registry
from foreshock.session.isolated import Failure, Job, Source, Workers
from foreshock.session.run import Run
from foreshock.session.scenario import Scenario

__all__ = ["dask_runner"]

CHUNK_S = 1.0
"""Work per chunk: a cluster needs some 0.2 s to make up for sending it."""
MOST = 32
"""Runs per chunk at most; they are lost together if a worker's machine is."""


def dask_runner(address: str, plan: Plan) -> Runner:
    """What does the runs of a campaign on the cluster at this address; the number of workers is the cluster's own.

    Raises:
        MissingExtraError: distributed is not installed.
    """
    try:
        import distributed
    except ImportError as e:
        raise MissingExtraError("--dask", f"needs {e.name}", "; run: pip install 'foreshock[dask]'") from e

    make: Any = distributed.Client  # its types are partial

    def run(source: Source[str], workers: int, timeout_s: float | None, folder: Path) -> None:  # noqa: ARG001 # as said
        try:
            client = make(address, timeout=10.0)
        except (OSError, ValueError) as e:
            raise BadInputError("--dask", f"no scheduler at {address!r}: {e}") from None
        with client:
            _check(client, plan)
            try:
                _run(distributed, client, source, timeout_s)
            finally:
                client.run(_close)

    return run


def _check(client: Any, plan: Plan) -> None:
    """Refuse a cluster without workers, and a worker that would run something else."""
    found = client.run(_identity, plan.spec, plan.scenarios, tuple(plan.identity["plugins"]), plan.folder)
    if not found:
        raise BadInputError("--dask", "the cluster has no worker")
    here = {k: plan.identity[k] for k in ("code", "twins", "files")}
    for worker, there in sorted(found.items()):
        if differs := changes(here, there):
            raise BadInputError(f"--dask: worker {worker}", "runs something else:\n  " + "\n  ".join(differs))


def _identity(
    spec: CampaignSpec, scenarios: Mapping[str, Scenario], plugins: Sequence[str], folder: str
) -> dict[str, Any]:
    """On a worker: what its results would depend on."""
    registry = Registry()
    twins = {id_: twin_files(s, registry) for id_, s in scenarios.items()}
    return {"code": versions(plugins), "twins": twins, "files": files_of(spec, scenarios, Path(folder))}


def _run(distributed: Any, client: Any, source: Source[str], timeout_s: float | None) -> None:
    # two chunks for each thread: none waits for its next one to be sent
    room = 2 * max(sum(client.nthreads().values()), 1)
    running: dict[Any, list[tuple[str, Job]]] = {}
    spent_s, count = 0.0, 0
    while True:
        size = 1 if not spent_s else max(1, min(MOST, round(CHUNK_S * count / spent_s)))
        while len(running) < room:
            chunk: list[tuple[str, Job]] = []
            while len(chunk) < size and (given := source.next()) is not None:
                chunk.append(given)
            if not chunk:
                break
            future = client.submit(_chunk, [job for _, job in chunk], timeout_s, pure=False)
            running[future] = chunk
        if not running:
            return
        for future in distributed.wait(list(running), return_when="FIRST_COMPLETED").done:
            chunk = running.pop(future)
            for (key, _), (result, wall_s) in zip(chunk, _gathered(future, chunk), strict=True):
                if not math.isnan(wall_s):
                    spent_s, count = spent_s + wall_s, count + 1
                source.done(key, result, wall_s)
            future.release()


def _gathered(future: Any, chunk: Sequence[tuple[str, Job]]) -> list[tuple[Run | Failure, float]]:
    try:
        results: list[tuple[Run | Failure, float]] = future.result()
    except Exception as e:  # noqa: BLE001 # a machine that is lost must not end the others
        lost = f"the cluster lost it: {type(e).__name__}: {e}"
        return [(Failure(job, "crash", lost), math.nan) for _, job in chunk]
    return results


_LOCK = threading.Lock()
_OWN: list[tuple[Workers, Path]] = []
"""On a worker of the cluster: its watched processes, which stay from chunk to chunk."""


def _chunk(jobs: Sequence[Job], timeout_s: float | None) -> list[tuple[Run | Failure, float]]:
    """On a worker: do these runs in watched processes."""
    workers = _workers()
    futures = [workers.begin(job, timeout_s) for job in jobs]
    return [workers.result(job, future, timeout_s) for job, future in zip(jobs, futures, strict=True)]


def _workers() -> Workers:
    import distributed

    with _LOCK:
        if not _OWN:
            # Dask's nanny starts workers as daemons, which multiprocessing forbids to have children for fear that they
            # outlive them; ours end with their parent by themselves
            multiprocessing.current_process()._config["daemon"] = False  # type: ignore[attr-defined]  # not public
            scratch = Path(tempfile.mkdtemp(prefix="foreshock-", dir=distributed.get_worker().local_directory))
            _OWN.append((Workers(distributed.get_worker().state.nthreads, scratch), scratch))
        return _OWN[0][0]


def _close() -> None:
    """On a worker: end its watched processes."""
    with _LOCK:
        while _OWN:
            workers, scratch = _OWN.pop()
            workers.close()
            shutil.rmtree(scratch, ignore_errors=True)
