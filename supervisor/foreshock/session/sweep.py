"""Paired sweeps: the same seeds under several arms, counted with intervals.

A small forerunner of campaigns: cells of one varied parameter each, arms paired by seed.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import msgspec

from foreshock.records import ProtectionLevel
from foreshock.session.isolated import Failure, Job, run_all
from foreshock.session.rates import Rate, wilson
from foreshock.session.run import Arm, Run
from foreshock.session.scenario import Scenario

__all__ = ["ArmSpec", "Cell", "CellResult", "sweep"]

NOTHING = Rate(0, 0, 0.0, 1.0)
"""Of no runs."""


class ArmSpec(msgspec.Struct, frozen=True):
    """An arm: label, whether the supervisor acts, and by which policy."""

    label: str
    arm: Arm
    policy: str | None = None


class Cell(msgspec.Struct, frozen=True):
    """A point of the sweep: the factor that is varied, its value for people, parameter values, seeds."""

    factor: str
    label: str
    parameters: dict[str, float]
    seeds: tuple[int, ...]


class CellResult(msgspec.Struct, frozen=True):
    """What one arm did in one cell, paired with the first arm (unsupervised) by seed.

    Attributes:
        cell: where.
        arm: label of the arm.
        accidents: runs that ended in the scenario's accident.
        falls: runs in which anything happened in the plant at all (with or without a human struck).
        prevented: of the runs with an event unsupervised, those without one here.
        caused: runs with an event here but none unsupervised.
        false_interventions: of the runs unharmed unsupervised, those that reached the protective level here.
        lead_s: time from the protective gate to the unsupervised event, one per run that had both; negative: too late.
        failures: runs that gave no result.
        averted: of the runs with the accident unsupervised, those without it here.
        added: runs with an accident of any mode here and none unsupervised.
    """

    cell: Cell
    arm: str
    accidents: Rate
    falls: Rate
    prevented: Rate
    caused: int
    false_interventions: Rate
    lead_s: tuple[float, ...]
    failures: int
    averted: Rate = NOTHING
    added: int = 0


def sweep(
    scenario: Scenario,
    arms: Sequence[ArmSpec],
    cells: Sequence[Cell],
    workers: int,
    done: Callable[[int, Run | Failure], None] | None = None,
    timeout_s: float | None = None,
) -> list[CellResult]:
    """Run every cell under every arm on the cell's seeds; the first arm is the reference.

    Args:
        scenario: what to vary.
        arms: at least the unsupervised one, which comes first.
        cells: where to run it.
        workers: number of processes.
        done: told of each run as it ends.
        timeout_s: wall-clock limit of one run.
    """
    jobs: list[Job] = []
    slots: list[tuple[int, int]] = []
    for a, arm in enumerate(arms):
        for c, cell in enumerate(cells):
            varied = scenario.with_(cell.parameters, arm.policy)
            jobs += [Job(varied, arm.arm, seed, detail=False) for seed in cell.seeds]
            slots += [(c, a)] * len(cell.seeds)
    results: dict[tuple[int, int], dict[int, Run | Failure]] = {}
    for slot, job, result in zip(slots, jobs, run_all(jobs, workers, timeout_s, done), strict=True):
        results.setdefault(slot, {})[job.seed] = result
    return [
        _judge(cell, arm.label, results.get((c, a), {}), results.get((c, 0), {}))
        for c, cell in enumerate(cells)
        for a, arm in enumerate(arms)
    ]


def _judge(
    cell: Cell, arm: str, mine: Mapping[int, Run | Failure], reference: Mapping[int, Run | Failure]
) -> CellResult:
    runs = {seed: r for seed, r in mine.items() if isinstance(r, Run)}
    pairs = [(runs[s], ref) for s, ref in reference.items() if s in runs and isinstance(ref, Run)]
    hit = [r for r, ref in pairs if ref.accident]
    harmed = [(r, ref) for r, ref in pairs if ref.events]
    unharmed = [(r, ref) for r, ref in pairs if not ref.events]
    acted = sum(r.max_level >= ProtectionLevel.PROTECTIVE for r, _ in unharmed)
    leads = [ref.events[0].stamp_ns / 1e9 - r.gate_s["protective"] for r, ref in harmed if "protective" in r.gate_s]
    return CellResult(
        cell,
        arm,
        wilson(sum(r.accident for r in runs.values()), len(runs)),
        wilson(sum(bool(r.events) for r in runs.values()), len(runs)),
        wilson(sum(not r.events for r, _ in harmed), len(harmed)),
        sum(bool(r.events) for r, _ in unharmed),
        wilson(acted, len(unharmed)),
        tuple(leads),
        len(mine) - len(runs),
        wilson(sum(not r.accident for r in hit), len(hit)),
        sum(r.harmed and not ref.harmed for r, ref in pairs),
    )
