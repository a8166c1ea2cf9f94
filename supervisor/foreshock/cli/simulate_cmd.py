"""``foreshock simulate``."""

from __future__ import annotations

from pathlib import Path
from typing import get_args

import click
import msgspec
from rich.progress import Progress

from foreshock.cli.output import OK, console, emit, notes, table
from foreshock.errors import BadInputError
from foreshock.registry import Registry
from foreshock.session.isolated import Job, run_one
from foreshock.session.run import Arm, Run
from foreshock.session.scenario import find_scenario

__all__ = ["simulate", "timeline"]


def _values(_: click.Context, __: click.Parameter, given: tuple[str, ...]) -> dict[str, float]:
    values = {}
    for item in given:
        name, equals, number = item.partition("=")
        try:
            values[name] = float(number)
        except ValueError:
            equals = ""
        if not equals:
            raise click.BadParameter(f"{item!r} is not NAME=NUMBER")
    return values


@click.command()
@click.argument("scenario")
@click.option("--twin", help="Kind of twin to run it on; the scenario's own by default.")
@click.option(
    "--supervisor",
    "arm",
    type=click.Choice(get_args(Arm)),
    default="on",
    show_default=True,
    help="Judges and acts, judges only, or off.",
)
@click.option("--policy", help="Use this policy instead of the scenario's.")
@click.option("--seed", type=int, default=0, show_default=True, help="Of all randomness.")
@click.option(
    "--set", "parameters", multiple=True, callback=_values, metavar="NAME=NUMBER", help="Set a parameter of the twin."
)
@click.option("--duration", type=float, help="Simulated time in s; the scenario's own by default.")
@click.option("--timeout", type=float, default=120.0, show_default=True, help="Wall-clock limit in s.")
@click.option("--report", type=click.Path(path_type=Path, dir_okay=False), help="Write an HTML report here.")
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def simulate(
    scenario: str,
    twin: str | None,
    arm: Arm,
    policy: str | None,
    seed: int,
    parameters: dict[str, float],
    duration: float | None,
    timeout: float,
    report: Path | None,
    as_json: bool,
) -> int:
    """Run a scenario (an id, or a TOML file) and say what happened.

    The run takes place in a watched process: an FMU that hangs or crashes ends in a message, not in this program.
    """
    registry = Registry()
    found = find_scenario(scenario, registry).with_(parameters, policy)
    if twin is not None and twin != found.twin["kind"]:
        registry.twin(twin, "--twin")
        found = msgspec.structs.replace(found, twin={"kind": twin})
    if duration is not None:
        found = msgspec.structs.replace(found, duration_s=duration)
    with Progress(console=notes, transient=True, disable=as_json) as progress:
        progress.add_task(f"{found.id} ({found.duration_s:g} s)", total=None)
        run = run_one(Job(found, arm, seed), timeout)
    if report is not None:
        try:
            from foreshock.report import write_report
        except ImportError as e:
            raise BadInputError("--report", f"needs {e.name}", "; run: pip install 'foreshock[report]'") from e
        write_report(report, f"{found.title}", [(f"supervisor {arm}", run)])
    if as_json:
        emit(msgspec.structs.replace(run, series={}))
        return OK
    timeline(run)
    console.print(summary(run))
    if report is not None:
        console.print(f"report: {report}")
    return OK


def timeline(run: Run, title: str = "") -> None:
    """Print the timeline of a run, as in Table 4."""
    rows = [
        (
            f"{r.t_s:.3f}",
            ", ".join(r.precursors),
            f"{r.m:g}",
            f"{r.q:g}",
            f"{r.probability:.3f}",
            f"{r.trust:.3f}",
            r.level,
            "; ".join((*(f"» {e}" for e in r.events), *r.interventions)),
        )
        for r in run.timeline
    ]
    columns = ("t (s)", "precursors", "m", "q", "P", "T", "level", "interventions, » events")
    name = title or f"{run.scenario}: supervisor {run.supervisor}" + (f" ({run.policy})" if run.policy else "")
    table(name, *columns, rows=rows, right=("t (s)", "m", "q", "P", "T"))


def summary(run: Run) -> str:
    """One line on the outcome."""
    colour = "red" if run.accident else "green"
    what = "; ".join(
        f"{e.id} at {e.stamp_ns / 1e9:.3f} s" + (f" with {e.value:.0f} {e.unit} (limit {e.limit:g})" if e.limit else "")
        for e in run.events
    )
    return f"[{colour}]outcome: {run.outcome}[/]" + (f": {what}" if what else " happened") + f"; seed {run.seed}"
