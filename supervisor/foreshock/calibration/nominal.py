"""Nominal statistics: what the detectors measure while nothing is wrong, over time, run by run."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from foreshock.errors import BadInputError
from foreshock.journal import NO_VERDICTS, OperatorReset
from foreshock.records import Decision, Sample
from foreshock.registry import Registry
from foreshock.session.isolated import build_twin
from foreshock.session.scenario import Scenario
from foreshock.session.simulate import simulate
from foreshock.supervisor import Supervisor

__all__ = ["nominal_runs", "read_nominal", "write_nominal"]

Run = dict[str, list[float]]
"""Statistic over threshold of each kind, over time; the largest over its subjects."""


class _Statistics:
    """A journal that keeps what the detectors said, now and then."""

    def __init__(self, every_s: float, after_s: float) -> None:
        self._every_ns, self._next_ns = round(every_s * 1e9), round(after_s * 1e9)
        self.rows: list[dict[str, float]] = []

    def tick(self, samples: Sequence[Sample], decision: Decision, verdicts: Mapping[str, str] = NO_VERDICTS) -> None:  # noqa: ARG002 # a journal is given them
        """Keep the statistics of a tick that is due."""
        if decision.now_ns < self._next_ns:
            return
        self._next_ns += self._every_ns
        row: dict[str, float] = {}
        for i in decision.indications:
            if i.threshold:
                value = i.statistic / i.threshold
                row[i.kind] = max(value, row.get(i.kind, value))
        self.rows.append(row)

    def operator_reset(self, record: OperatorReset) -> None:
        """Nothing to keep."""

    def close(self) -> None:
        """Nothing to close."""


def nominal_runs(
    scenario: Scenario,
    seeds: Sequence[int],
    every_s: float = 0.05,
    after_s: float = 1.0,
    done: Callable[[int], None] | None = None,
) -> list[Run]:
    """Judge a nominal scenario and keep the statistics.

    Args:
        scenario: in which nothing is wrong.
        seeds: one run each.
        every_s: sampling time.
        after_s: what is left out at the start, while filters settle.
        done: told of each run that ended.

    Raises:
        BadInputError: a run came to harm: it was not nominal.
    """
    runs = []
    registry = Registry()
    with tempfile.TemporaryDirectory(prefix="foreshock-", ignore_cleanup_errors=True) as scratch:
        twin = build_twin(scenario, registry, Path(scratch))
        judge = Supervisor(scenario.supervisor(), Path(scenario.folder), registry)
        try:
            for k, seed in enumerate(seeds):
                kept = _Statistics(every_s, after_s)
                run = simulate(scenario, twin, judge, "shadow", seed, detail=False, journals=[kept])
                if run.events:
                    raise BadInputError(scenario.id, f"seed {seed} ended in {run.outcome}: it is not nominal")
                kinds = sorted({kind for row in kept.rows for kind in row})
                runs.append({kind: [row.get(kind, np.nan) for row in kept.rows] for kind in kinds})
                if done is not None:
                    done(k)
        finally:
            judge.close()
            twin.close()
    return runs


def write_nominal(path: Path, runs: Sequence[Run]) -> None:
    """Write them to Parquet: a row per run and time, a column per kind."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    kinds = sorted({kind for run in runs for kind in run})
    columns: dict[str, list[float]] = {"run": [], **{kind: [] for kind in kinds}}
    for k, run in enumerate(runs):
        n = max((len(v) for v in run.values()), default=0)
        columns["run"] += [float(k)] * n
        for kind in kinds:
            columns[kind] += run.get(kind, [np.nan] * n)
    path.parent.mkdir(parents=True, exist_ok=True)
    pq.write_table(pa.table(columns), path)


def read_nominal(path: Path) -> list[Run]:
    """Read what write_nominal wrote.

    Raises:
        BadInputError: it is no such file.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        table = pq.read_table(path)
    except (OSError, pa.ArrowException) as e:
        raise BadInputError(str(path), f"cannot be read as Parquet: {e}") from None
    if "run" not in table.column_names:
        raise BadInputError(str(path), "no column 'run'", "; expected a file made by: foreshock calibrate nominal")
    data = {name: np.asarray(table.column(name), float) for name in table.column_names}
    number = data.pop("run")
    return [{kind: v[number == k].tolist() for kind, v in data.items()} for k in np.unique(number)]
