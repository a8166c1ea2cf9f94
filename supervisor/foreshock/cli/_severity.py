"""``foreshock scenarios severity``."""

from __future__ import annotations

import os

import click

from foreshock.cli._runs import runs_bar
from foreshock.cli.output import FAILED, OK, emit, table
from foreshock.errors import BadInputError
from foreshock.registry import Registry
from foreshock.session.scenario import Scenario, find_scenario, scenario_ids
from foreshock.session.sweep import ArmSpec, Cell, CellResult, sweep

__all__ = ["severity_command"]


@click.command("severity")
@click.argument("scenario", nargs=-1)
@click.option("--seeds", type=click.IntRange(1), default=20, show_default=True, help="Runs per value and arm.")
@click.option("--first-seed", type=click.IntRange(0), default=30_000, show_default=True, help="Seeds begin here.")
@click.option("--workers", type=click.IntRange(1), default=os.cpu_count() or 1, show_default=True, help="Processes.")
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def severity_command(scenario: tuple[str, ...], seeds: int, first_seed: int, workers: int, as_json: bool) -> int:
    """Vary how severe the cause is: what needs no action, what the supervisor saves, what nothing saves.

    SCENARIOs with a [severity] table; all of them by default.
    """
    registry = Registry()
    found = [find_scenario(name, registry) for name in scenario]
    if not found:
        found = [s for s in scenario_ids(registry).values() if s.severity is not None]
    every = tuple(range(first_seed, first_seed + seeds))
    cells = {s.id: _cells(s, every) for s in found}
    arms = [ArmSpec("unsupervised", "off"), ArmSpec("supervised", "on")]
    results: dict[str, list[CellResult]] = {}
    with runs_bar("severity", len(arms) * seeds * sum(len(c) for c in cells.values())) as done:
        for s in found:
            results[s.id] = sweep(s, arms, cells[s.id], workers, done)
    if as_json:
        emit(results)
    else:
        for name, rows in results.items():
            _print(name, rows, seeds)
    return FAILED if any(r.failures for rows in results.values() for r in rows) else OK


def _cells(scenario: Scenario, seeds: tuple[int, ...]) -> list[Cell]:
    severity = scenario.severity
    if severity is None:
        raise BadInputError(f"{scenario.id}: severity", "missing", '; expected { parameter = "...", values = [...] }')
    name = severity.parameter
    return [Cell(name, f"{value:g}", {name: value}, seeds) for value in severity.values]


def _print(name: str, results: list[CellResult], seeds: int) -> None:
    pairs = list(zip(results[::2], results[1::2], strict=True))
    columns = ("unsupervised", "supervised", "averted", "caused")
    rows = [(a.cell.label, str(a.accidents), str(b.accidents), str(b.averted), str(b.added)) for a, b in pairs]
    table(f"{name}: accidents of {seeds} seeds", pairs[0][0].cell.factor, *columns, rows=rows, right=columns)
