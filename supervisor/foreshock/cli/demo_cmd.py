"""``foreshock demo``: the paper's case study A1 without the supervisor, with its gate alone, and with the ladder."""

from __future__ import annotations

import os
from pathlib import Path
from statistics import median

import click
import msgspec

from foreshock.cli._runs import runs_bar
from foreshock.cli.output import NEGATIVE, OK, console, emit, table
from foreshock.cli.simulate_cmd import summary, timeline
from foreshock.errors import BadInputError, TwinError
from foreshock.registry import Registry
from foreshock.session.isolated import Failure, Job, run_all
from foreshock.session.rates import Rate
from foreshock.session.run import Run
from foreshock.session.scenario import Scenario, find_scenario
from foreshock.session.sweep import ArmSpec, Cell, CellResult, sweep

__all__ = ["demo"]

SCENARIO = "a1-fall-onto-human"
ARMS = (
    ArmSpec("unsupervised", "off"),
    ArmSpec("the paper's gate alone", "on", "paper-gate"),
    ArmSpec("ladder", "on", "ladder"),
)
SHORT = ("unsupervised", "paper's gate", "ladder")
"""The arms in the heads of the sweep table, which is to fit into 120 columns."""
SHOWN = (ArmSpec("unsupervised (shadow)", "shadow", "ladder"), *ARMS[1:])
"""The first run is judged but not acted on, so that its P and T can be shown too."""

NOTES = (
    "The paper's case study A1, “fall onto human”, in closed loop on a frontal-plane plant of TALOS packaged as an "
    "FMU: while stepping in place one foot meets a patch of low friction. Slip, torso spike and the deviation of the "
    "centre of mass are found by the detectors in noisy sensor streams; nothing of the cascade is scripted.",
    "P is Eq. 1 of the paper on the precursors tied to A1, and T = 1 − P. The paper's gate acts at T < 0.3, which "
    "waits for the third precursor; the ladder suppresses the next step at a caution gate of T < 0.6 and takes all "
    "four protocols at T < 0.3. Plant, thresholds and gates were chosen on seeds below 10000; all figures here are on "
    "seeds from 10000 on.",
)


FIRST_SEED = 10_000
"""Plant, thresholds and gates were chosen on seeds below; what is reported is on seeds from here."""


def cells(seeds: int, per_cell: int) -> list[Cell]:
    """The sweep: the default point on all seeds, severities on fewer."""
    every = tuple(range(FIRST_SEED, FIRST_SEED + seeds))
    some = every[:per_cell]
    points = [Cell("default", "default", {}, every)]
    points += [Cell("friction", f"μ {v:g}", {"drop_mu": v}, some) for v in (0.03, 0.048, 0.052, 0.06)]
    points += [Cell("duration", f"{v:g} s", {"drop_duration": v}, some) for v in (0.1, 0.2, 0.3, 1.0)]
    points += [
        Cell("push, no ice", f"{v:g} N s", {"drop_duration": 0.0, "push_impulse": v}, some)
        for v in (4.0, 8.0, 12.0, 30.0)
    ]
    return points


@click.command()
@click.option(
    "--out",
    type=click.Path(path_type=Path, file_okay=False),
    default=Path("out/demo"),
    show_default=True,
    help="Folder for report and pictures.",
)
@click.option(
    "--seed", type=click.IntRange(0), default=FIRST_SEED, show_default=True, help="Of the three runs that are shown."
)
@click.option(
    "--seeds", type=click.IntRange(1), default=50, show_default=True, help="Runs per arm at default parameters."
)
@click.option("--per-cell", type=click.IntRange(1), default=10, show_default=True, help="Runs per arm and severity.")
@click.option("--workers", type=click.IntRange(1), default=os.cpu_count() or 1, show_default=True, help="Processes.")
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def demo(out: Path, seed: int, seeds: int, per_cell: int, workers: int, as_json: bool) -> int:
    """Run the paper's case study three ways, count how often each happens, and write a report."""
    try:
        from foreshock.report import runs_figure, sweep_figure, write_report
    except ImportError as e:
        raise BadInputError("demo", f"the report needs {e.name}", "; run: pip install 'foreshock[report]'") from e
    out.mkdir(parents=True, exist_ok=True)
    scenario = find_scenario(SCENARIO, Registry())
    shown = _three(scenario, seed)
    if not as_json:
        for label, run in shown:
            timeline(run, label)
            console.print(summary(run) + "\n", soft_wrap=True)
    points = cells(seeds, min(per_cell, seeds))
    with runs_bar("sweep", len(ARMS) * sum(len(c.seeds) for c in points)) as done:
        results = sweep(scenario, ARMS, points, workers, done)
    command = f"foreshock demo --seed {seed} --seeds {seeds} --per-cell {per_cell}"
    write_report(out / "report.html", "A1: fall onto human", shown, results, NOTES, command)
    runs_figure(shown).savefig(out / "runs.png", dpi=110)
    sweep_figure(results).savefig(out / "sweep.png", dpi=110)
    files = [str(out / name) for name in ("report.html", "runs.png", "sweep.png")]
    if as_json:
        runs = {label: msgspec.structs.replace(run, series={}) for label, run in shown}
        emit({"runs": runs, "sweep": results, "files": files})
    else:
        _print_sweep(results)
        console.print("report: " + files[0])
    saved = shown[0][1].accident and not shown[-1][1].events
    return OK if saved else NEGATIVE


def _three(scenario: Scenario, seed: int) -> list[tuple[str, Run]]:
    jobs = [Job(scenario.with_(policy=a.policy), a.arm, seed) for a in SHOWN]
    shown = []
    for arm, result in zip(SHOWN, run_all(jobs, workers=1), strict=True):
        if isinstance(result, Failure):
            raise TwinError(result.kind, result.detail, result.log)
        shown.append((arm.label, result))
    return shown


def _print_sweep(results: list[CellResult]) -> None:
    """One row per severity: how many fell under each arm, and what the supervisor did otherwise."""
    rows = []
    for k in range(0, len(results), len(ARMS)):
        mine = results[k : k + len(ARMS)]
        cell = mine[0].cell
        acting = mine[1:]
        rows.append(
            (
                cell.label if cell.factor == cell.label else f"{cell.factor} {cell.label}",
                *(str(r.falls) for r in mine),
                ", ".join(str(r.caused) for r in acting),
                ", ".join(_fraction(r.false_interventions) for r in acting),
                ", ".join(f"{median(r.lead_s):.2f}" if r.lead_s else "–" for r in acting),
            )
        )
    falls = [f"fell:\n{a}" for a in SHORT]
    columns = (*falls, "caused", "false", "lead (s)")
    title = "Sweep: 95% Wilson intervals, arms paired by seed; caused, false and lead: paper's gate, ladder"
    table(title, "severity", *columns, rows=rows, right=columns)
    if failed := sum(r.failures for r in results):
        console.print(f"[red]{failed} runs gave no result[/]")


def _fraction(rate: Rate) -> str:
    return f"{rate.k}/{rate.n}" if rate.n else "–"
