"""``foreshock falsify``."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import get_args

import click
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from foreshock.campaign.falsify import FRESH, Falsified, Found, Search
from foreshock.campaign.falsify import falsify as search_for
from foreshock.campaign.optimiser import OptimiserKind
from foreshock.cli._runs import ranges
from foreshock.cli.output import FAILED, NEGATIVE, OK, console, emit, notes, table
from foreshock.registry import Registry

__all__ = ["falsify"]


@click.command()
@click.argument("scenario")
@click.option(
    "--out", type=click.Path(path_type=Path, file_okay=False), required=True, help="Folder of the ledger and the cases."
)
@click.option(
    "--vary",
    multiple=True,
    callback=ranges,
    metavar="NAME=LOW:HIGH",
    help="Search this parameter; without any, all that the scenario draws.",
)
@click.option(
    "--formula", default="", help="STL over the plant's probes that must hold; the scenario's own by default."
)
@click.option("--runs", type=click.IntRange(1), default=300, show_default=True, help="Budget of the search.")
@click.option("--seeds", type=click.IntRange(1), default=5, show_default=True, help="Runs per point.")
@click.option("--cases", type=click.IntRange(1), default=1, show_default=True, help="End when so many are found.")
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="Of all randomness.")
@click.option(
    "--search",
    "kind",
    type=click.Choice(get_args(OptimiserKind)),
    default="tpe",
    show_default=True,
    help="How points are chosen.",
)
@click.option("--policy", help="Use this policy instead of the scenario's.")
@click.option("--workers", type=click.IntRange(1), default=os.cpu_count() or 1, show_default=True, help="Processes.")
@click.option(
    "--timeout",
    type=click.FloatRange(0.0, min_open=True),
    help="Wall-clock limit of a run in s; 60 s and ten times its duration by default.",
)
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def falsify(
    scenario: str,
    out: Path,
    vary: dict[str, tuple[float, float]],
    formula: str,
    runs: int,
    seeds: int,
    cases: int,
    seed: int,
    kind: OptimiserKind,
    policy: str | None,
    workers: int,
    timeout: float | None,
    as_json: bool,
) -> int:
    """Search for parameters with which SCENARIO has its accident although it is supervised.

    A case is confirmed on fresh seeds and saved in the folder as a scenario that replays it. A search that was broken
    off goes on where it was if it is called again.

    Exit code 1 if a case was found; 3 if none was and a run gave no result.
    """
    search = Search(scenario, vary, formula, runs, seeds, cases, seed, kind, policy)
    with _bar(search, as_json) as told:
        found = search_for(search, out, Registry(), workers, timeout, told)
    if as_json:
        emit(found)
    else:
        _print(found, search)
    return NEGATIVE if found.cases else FAILED if found.failed else OK


@contextmanager
def _bar(search: Search, quiet: bool) -> Iterator[Callable[[Found], None]]:
    with Progress(
        TextColumn("{task.description}"),
        BarColumn(None),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
        TextColumn("left, least {task.fields[least]}, {task.fields[cases]} found, {task.fields[failed]} failed"),
        console=notes,
        transient=True,
        disable=quiet,
    ) as bar:
        task = bar.add_task("falsify", total=search.runs, least="–", cases=0, failed=0)

        def told(found: Found) -> None:
            least = "–" if found.robustness is None else f"{found.robustness:.3g}"
            failed = sum(found.failed.values())
            bar.update(task, completed=found.runs, least=least, cases=len(found.cases), failed=failed)

        yield told


def _print(found: Found, search: Search) -> None:
    for case in found.cases:
        _print_case(case)
    failed = ", ".join(f"{n} {kind}" for kind, n in sorted(found.failed.items())) or "none failed"
    least = "–" if found.robustness is None else f"{found.robustness:.3g}"
    lines = [
        f"{found.scenario}: {found.runs} runs, {found.known} of them known from before; the budget of the search is "
        f"{search.runs}; {failed}",
        f"least robustness {least} of {found.formula}: {_values(found.best)}",
        f"{len(found.cases)} found; {found.candidates - len(found.cases)} more did not stand {FRESH} fresh seeds",
    ]
    for line in lines:
        console.print(line, markup=False, soft_wrap=True)


def _print_case(case: Falsified) -> None:
    rows = [
        ("parameters", _values(case.parameters)),
        ("supervised, fresh seeds", str(case.supervised)),
        ("unsupervised, fresh seeds", str(case.unsupervised)),
        ("found after", f"{case.after_runs} runs, median robustness {case.robustness:.3g}"),
        ("accident", f"{case.accident}; seed {case.seed}"),
        ("replay", f"foreshock simulate {case.file}"),
    ]
    table("The supervised accident happens", "", "", rows=rows)


def _values(parameters: dict[str, float]) -> str:
    return ", ".join(f"{name}={value:.4g}" for name, value in sorted(parameters.items()))
