"""``foreshock scenarios verify``."""

from __future__ import annotations

import os

import click
import msgspec

from foreshock.cli._runs import runs_bar
from foreshock.cli.output import FAILED, NEGATIVE, OK, console, emit, left_out, table
from foreshock.registry import Registry
from foreshock.session.scenario import broken_scenarios, scenario_ids
from foreshock.session.verify import ModeResult, plan_of, verify
from foreshock.taxonomy import builtin_taxonomy

__all__ = ["verify_command"]

FIRST_SEED = 30_000
"""Nothing was tuned on seeds from here."""


@click.command("verify")
@click.argument("mode", nargs=-1)
@click.option("--seeds", type=click.IntRange(1), default=100, show_default=True, help="Runs per arm and mode.")
@click.option("--hours", type=click.FloatRange(0.0), default=3.0, show_default=True, help="Harmless, per mode.")
@click.option("--first-seed", type=click.IntRange(0), default=FIRST_SEED, show_default=True, help="Seeds begin here.")
@click.option("--workers", type=click.IntRange(1), default=os.cpu_count() or 1, show_default=True, help="Processes.")
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def verify_command(
    mode: tuple[str, ...], seeds: int, hours: float, first_seed: int, workers: int, as_json: bool
) -> int:
    """Run the scenarios of accident MODEs (all by default), unsupervised and supervised, and count.

    Exit code 1 if a mode misses one of its aims.
    """
    registry = Registry()
    known = scenario_ids(registry)
    taxonomy = builtin_taxonomy()
    codes = [taxonomy.mode(m, "MODE").code for m in mode] or list(taxonomy.codes)
    left_out((*registry.load_all(), *broken_scenarios(registry)))
    plans = {code: plan_of(code, known) for code in codes}
    found = [plan for plan in plans.values() if plan is not None]
    with runs_bar("scenarios", sum(p.runs(seeds, hours) for p in found)) as done:
        results = verify(found, seeds, first_seed, hours, workers, done)
    missing = [code for code, plan in plans.items() if plan is None]
    if as_json:
        emit([{**msgspec.to_builtins(r), "misses": r.missed()} for r in results])
    else:
        _print(results, missing, seeds)
    if any(r.failures for r in results):
        return FAILED
    return NEGATIVE if missing or any(r.missed() or r.harmed for r in results) else OK


def _print(results: list[ModeResult], missing: list[str], seeds: int) -> None:
    taxonomy = builtin_taxonomy()
    names = {r.mode: f"{r.mode} {taxonomy.mode(r.mode).title}" for r in results}
    arms = ("unsupervised", "supervised", "at random", "always on")
    rows = [
        (names[r.mode], *(str(rate) for rate in (r.unsupervised, r.supervised, r.at_random, r.always))) for r in results
    ]
    table(f"Runs with the accident, of {seeds} seeds (95% Wilson intervals)", "mode", *arms, rows=rows, right=arms)
    columns = ("cascade found", "in order", "T < 0.3 before", "lead (s)", "false per harmless hour")
    rows = [
        (
            names[r.mode],
            str(r.cascade.found),
            str(r.cascade.ordered),
            str(r.cascade.gated),
            f"{r.cascade.lead_s[1]:.2f}" if r.cascade.lead_s is not None else "–",
            str(r.false),
        )
        for r in results
    ]
    table("Unsupervised accidents, and false interventions", "mode", *columns, rows=rows, right=columns)
    for r in results:
        notes = [*r.missed()]
        if r.harmed:
            notes.append(f"{r.harmed} accidents in harmless scenarios")
        if r.caused:
            notes.append(f"{r.caused} accidents that happen only supervised")
        if r.failures:
            notes.append(f"{r.failures} runs gave no result")
        console.print(f"{r.mode}: " + ("; ".join(notes) if notes else "holds its aims"), markup=False)
    for code in missing:
        console.print(f"{code}: no scenario with the accident", markup=False)
