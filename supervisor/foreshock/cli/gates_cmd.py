"""``foreshock gates``: what opens the gate, compared on the same seeds."""

from __future__ import annotations

import math
import os
from statistics import median

import click
import msgspec

from foreshock.cli._runs import ranges, runs_bar
from foreshock.cli.output import OK, console, emit, table
from foreshock.registry import Registry
from foreshock.session.gates import GATES, GateResult, compare_gates
from foreshock.session.scenario import find_scenario

__all__ = ["gates"]

FIRST_SEED = 20_000
"""Nothing was tuned on seeds from here."""


@click.command()
@click.argument("scenario", default="a1-fall-onto-human")
@click.option(
    "--nominal",
    multiple=True,
    default=("a1-fall-onto-human-nominal", "a1-fall-onto-human-nominal-standing"),
    show_default=True,
    help="Scenario in which nothing is wrong.",
)
@click.option("--seeds", type=click.IntRange(1), default=100, show_default=True, help="Runs per gate.")
@click.option("--nominal-hours", type=click.FloatRange(0.0), default=1.0, show_default=True, help="Per gate.")
@click.option("--first-seed", type=click.IntRange(0), default=FIRST_SEED, show_default=True, help="Seeds begin here.")
@click.option("--vary", multiple=True, callback=ranges, metavar="NAME=LOW:HIGH", help="Draw a parameter per seed.")
@click.option("--workers", type=click.IntRange(1), default=os.cpu_count() or 1, show_default=True, help="Processes.")
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def gates(
    scenario: str,
    nominal: tuple[str, ...],
    seeds: int,
    nominal_hours: float,
    first_seed: int,
    vary: dict[str, tuple[float, float]],
    workers: int,
    as_json: bool,
) -> int:
    """Compare what opens the gate: the independent LE, the correlated LE with cascade lift, two precursors of three.

    The same four protocols behind each gate, on the same seeds.
    """
    registry = Registry()
    found = find_scenario(scenario, registry)
    calm = [find_scenario(name, registry) for name in nominal]
    each_s = sum(s.duration_s for s in calm)
    rounds = math.ceil(3600.0 * nominal_hours / each_s) if each_s else 0
    total = (1 + len(GATES)) * seeds + len(GATES) * len(calm) * rounds
    with runs_bar("gates", total) as done:
        every = range(first_seed, first_seed + seeds)
        nominal_seeds = range(first_seed, first_seed + rounds)
        results = compare_gates(found, calm, every, nominal_seeds, vary, workers, done=done)
    if as_json:
        emit(
            [
                {**msgspec.to_builtins(r), "per_hour": (r.nominal.per_hour, r.nominal.low, r.nominal.high)}
                for r in results
            ]
        )
    else:
        _print(results, scenario, seeds)
    return OK


def _print(results: list[GateResult], scenario: str, seeds: int) -> None:
    rows = [
        (
            r.gate,
            str(r.fell),
            str(r.saved),
            str(r.caused),
            str(r.spared),
            f"{median(r.lead_s):.2f}" if r.lead_s else "–",
            str(r.nominal),
        )
        for r in results
    ]
    columns = ("fell", "saved", "caused", "false", "gate to fall (s)", "false per nominal hour")
    table(f"{scenario}, {seeds} seeds, 95% intervals", "gate", *columns, rows=rows, right=columns[:-1])
    if failures := sum(r.failures for r in results):
        console.print(f"[red]{failures} runs gave no result[/]")
