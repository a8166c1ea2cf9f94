"""``foreshock simulate``."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, get_args

import click
import msgspec
from rich.markup import escape
from rich.progress import Progress

from foreshock.cli._link import STEPPED_ENDPOINT, Joining, link_option
from foreshock.cli.output import OK, console, emit, notes, table, warn
from foreshock.errors import BadInputError, ConfigError
from foreshock.registry import Registry
from foreshock.session.isolated import Job, run_one
from foreshock.session.run import Arm, Run
from foreshock.session.scenario import find_scenario

__all__ = ["simulate", "summary", "timeline", "values"]


def values(_: click.Context, __: click.Parameter, given: tuple[str, ...]) -> dict[str, float]:
    """NAME=NUMBER by name."""
    found = {}
    for item in given:
        name, equals, number = item.partition("=")
        try:
            found[name] = float(number)
        except ValueError:
            equals = ""
        if not equals:
            raise click.BadParameter(f"{item!r} is not NAME=NUMBER")
    return found


@click.command()
@click.argument("scenario")
@click.option(
    "--twin", help="Kind of twin, or KIND:ENDPOINT; the scenario's variant on it if there is one; its own by default."
)
@link_option
@click.option(
    "--supervisor",
    "arm",
    type=click.Choice(get_args(Arm)),
    default="on",
    show_default=True,
    help="Judges and acts, judges only, or off.",
)
@click.option("--policy", help="Use this policy instead of the scenario's.")
@click.option("--seed", type=click.IntRange(0), help="Of all randomness; the scenario's own (0) by default.")
@click.option(
    "--set", "parameters", multiple=True, callback=values, metavar="NAME=NUMBER", help="Set a parameter of the twin."
)
@click.option("--duration", type=float, help="Simulated time in s; the scenario's own by default.")
@click.option(
    "--timeout",
    type=click.FloatRange(0.0, min_open=True),
    help="Wall-clock limit in s; 60 s and ten times the duration by default.",
)
@click.option("--report", type=click.Path(path_type=Path, dir_okay=False), help="Write an HTML report here.")
@click.option("--journal", type=click.Path(path_type=Path, dir_okay=False), help="Record the run in this MCAP file.")
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def simulate(
    scenario: str,
    twin: str | None,
    link: Path | None,
    arm: Arm,
    policy: str | None,
    seed: int | None,
    parameters: dict[str, float],
    duration: float | None,
    timeout: float | None,
    report: Path | None,
    journal: Path | None,
    as_json: bool,
) -> int:
    """Run a scenario (an id, or a TOML file) and say what happened.

    The run takes place in a watched process: an FMU that hangs or crashes ends in a message, not in this program.
    """
    registry = Registry()
    kind, _, endpoint = (twin or "").partition(":")
    found = find_scenario(scenario, registry, kind).with_(parameters, policy)
    if twin is not None and twin != found.twin["kind"]:
        registry.twin(kind, "--twin")
        found = msgspec.structs.replace(found, twin={"kind": kind, **({"endpoint": endpoint} if endpoint else {})})
    if link is not None or endpoint:
        found = msgspec.structs.replace(found, twin=_joined(found.twin, Joining(link, endpoint)))
    if duration is not None:
        found = msgspec.structs.replace(found, duration_s=duration)
    if journal is not None and arm == "off":
        raise BadInputError("--journal", "nothing decides with --supervisor off", "; take shadow")
    job = Job(
        found, arm, found.seed if seed is None else seed, journal="" if journal is None else str(journal.resolve())
    )
    with Progress(console=notes, transient=True, disable=as_json) as progress:
        progress.add_task(f"{found.id} ({found.duration_s:g} s)", total=None)
        run = run_one(job, timeout)
    if report is not None:
        try:
            from foreshock.report import write_report
        except ImportError as e:
            raise BadInputError("--report", f"needs {e.name}", "; run: pip install 'foreshock[report]'") from e
        write_report(report, f"{found.title}", [(f"supervisor {arm}", run)])
    if as_json:
        emit(msgspec.structs.replace(run, series={}))
        return OK
    warn(run.warnings)
    timeline(run)
    console.print(summary(run), soft_wrap=True)
    for what, path in (("report", report), ("journal", journal)):
        if path is not None:
            console.print(f"{what}: {path}", markup=False)
    return OK


def _joined(twin: dict[str, Any], join: Joining) -> dict[str, Any]:
    """A twin behind Zenoh that is joined as --twin and --link say."""
    if twin["kind"] != "zenoh":
        place = "--twin" if join.file is None else "--link"
        raise BadInputError(place, f"a twin of kind {twin['kind']!r} runs here", "; zenoh:ENDPOINT is one elsewhere")
    try:
        link = join.settings("client", twin.get("endpoint", STEPPED_ENDPOINT))
    except ConfigError as e:
        raise ConfigError("--twin" if join.file is None else e.place, e.problem, e.hint) from None
    return {**twin, "endpoint": link.connect[0], "remote": link.remote, "tls": msgspec.to_builtins(link.tls)}


def timeline(run: Run, title: str = "") -> None:
    """Print the timeline of a run, as in Table 4."""
    rows = [
        (
            f"{r.t_s:.3f}",
            ", ".join(r.precursors),
            *(_number(x) for x in (r.m, r.q)),
            *(_number(x, 3) for x in (r.probability, r.trust, r.control_trust)),
            r.level,
            "; ".join((*(f"» {e}" for e in r.events), *r.interventions)),
        )
        for r in run.timeline
    ]
    columns = ("t (s)", "precursors", "m", "q", "P", "T", "control", "level", "interventions, » events")
    name = title or f"{run.scenario}: supervisor {run.supervisor}" + (f" ({run.policy})" if run.policy else "")
    table(name, *columns, rows=rows, right=("t (s)", "m", "q", "P", "T", "control"))


def _number(x: float, digits: int | None = None) -> str:
    """A number, or nothing where there is none: without a supervisor there is no P."""
    return "" if math.isnan(x) else f"{x:g}" if digits is None else f"{x:.{digits}f}"


def summary(run: Run) -> str:
    """What happened, what was not observed, and what the twin ignored; with markup."""
    colour = "red" if run.accident else "yellow" if run.events else "green"
    what = "; ".join(
        f"{e.id} at {e.stamp_ns / 1e9:.3f} s" + (f" with {e.value:.0f} {e.unit} (limit {e.limit:g})" if e.mode else "")
        for e in run.events
    )
    outcome = f"[{colour}]outcome: {escape(run.outcome)}[/]"
    lines = [f"{outcome}{escape(': ' + what if what else ', nothing happened')}; seed {run.seed}"]
    # streams that have not begun in the first 0.1 s are no loss
    lost = [h for h in run.health if h.state not in ("ok", "warm-up") and h.stamp_ns > 100_000_000]
    lines += [f"[yellow]{escape(f'{h.source} {h.state} at {h.stamp_ns / 1e9:.3f} s: {h.reason}')}[/]" for h in lost[:8]]
    if len(lost) > 8:
        lines.append(f"[yellow]and {len(lost) - 8} more changes of health; see --json[/]")
    if run.ignored:
        lines.append(f"[dim]the twin has no input for: {escape(', '.join(run.ignored))}[/]")
    return "\n".join(lines)
