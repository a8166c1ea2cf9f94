"""``foreshock calibrate``: the risk model's parameters from labelled events and nominal runs."""

from __future__ import annotations

import hashlib
import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import click
import msgspec
from rich.progress import Progress

from foreshock.cli.output import OK, console, emit, notes, table
from foreshock.clock import today
from foreshock.errors import BadInputError
from foreshock.events import SYNTHETIC, Event, read_events
from foreshock.registry import Registry
from foreshock.risk import Pair, Provenance, RiskParameters, save_parameters
from foreshock.session.scenario import find_scenario
from foreshock.taxonomy import builtin_taxonomy

if TYPE_CHECKING:
    from foreshock.calibration import Fitted, Score

__all__ = ["calibrate"]

FILE = click.Path(path_type=Path, dir_okay=False)


@click.group()
def calibrate() -> None:
    """Fit the risk model to labelled events; P becomes the probability of the accident within a stated horizon."""


@calibrate.command()
@click.argument("scenario", nargs=-1, required=True)
@click.option("--seeds", type=click.IntRange(2), default=20, show_default=True, help="Runs of each scenario.")
@click.option("--first-seed", type=click.IntRange(0), default=0, show_default=True, help="Seeds begin here.")
@click.option("--out", type=FILE, required=True, help="A .parquet file.")
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def nominal(scenario: tuple[str, ...], seeds: int, first_seed: int, out: Path, as_json: bool) -> int:
    """Record the detectors' statistics in nominal scenarios, which R is estimated from."""
    from foreshock.calibration.nominal import nominal_runs, write_nominal

    registry = Registry()
    found = [find_scenario(name, registry) for name in scenario]
    runs = []
    with Progress(console=notes, transient=True, disable=as_json) as bar:
        task = bar.add_task("nominal runs", total=len(found) * seeds)
        for one in found:
            every = range(first_seed, first_seed + seeds)
            runs += nominal_runs(one, every, done=lambda _: bar.update(task, advance=1))
    write_nominal(out, runs)
    kinds = sorted({kind for run in runs for kind in run})
    if as_json:
        emit({"file": str(out), "runs": len(runs), "kinds": kinds})
    else:
        console.print(f"{len(runs)} runs, {len(kinds)} kinds: {out}", markup=False)
    return OK


@calibrate.command()
@click.argument("events", nargs=-1, required=True, type=FILE)
@click.option("--nominal", "nominal_file", type=FILE, help="Statistics of nominal runs, for R; without it R is I.")
@click.option("--mode", default="", help="Accident mode that is predicted, e.g. A1; any by default.")
@click.option("--horizon", type=click.FloatRange(0.0, min_open=True), default=1.0, show_default=True, help="In s.")
@click.option(
    "--window",
    "windows",
    type=click.FloatRange(0.0, min_open=True),
    multiple=True,
    help="Window in s: one fixes it, of several the likeliest is taken; by default it is fitted, 0.5 to 3 s.",
)
@click.option("--folds", type=click.IntRange(2), default=5, show_default=True, help="Of the cross-validation.")
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="Of the bootstraps.")
@click.option("--coder", default="", help="Whose coding counts where an event has several; the first by default.")
@click.option("--out", type=FILE, required=True, help="The parameter file, .toml.")
@click.option("--report", type=FILE, help="Write an HTML report here.")
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def fit(
    events: tuple[Path, ...],
    nominal_file: Path | None,
    mode: str,
    horizon: float,
    windows: tuple[float, ...],
    folds: int,
    seed: int,
    coder: str,
    out: Path,
    report: Path | None,
    as_json: bool,
) -> int:
    """Fit the risk model to events and nominal runs, and compare it with others, out of fold.

    a, b, c and kappa by maximum likelihood; window, the scale of R and presence by profile likelihood; J from the order
    of precursors before accidents; R from nominal runs.
    """
    try:
        from foreshock.calibration import Moments, compare, correlation, lifts, reliability, scaled
        from foreshock.calibration import calibrate as calibrated
        from foreshock.calibration.nominal import read_nominal
    except ImportError as e:
        hint = "; run: pip install 'foreshock[analysis]'"
        raise BadInputError("calibrate", f"needs {e.name}, which is not installed", hint) from e
    taxonomy = builtin_taxonomy()
    if mode:
        mode = taxonomy.mode(mode, "--mode").code
    if out.suffix != ".toml":
        raise BadInputError("--out", f"{str(out)!r} is no .toml file")
    found, problems = _once_each(events, coder)
    pairs: tuple[Pair, ...] = correlation(read_nominal(nominal_file), seed) if nominal_file is not None else ()
    links = lifts(found, seed)
    moments = Moments(found, horizon, mode, {pair.kinds: pair.r for pair in pairs})
    if len(moments.groups) < folds:
        raise BadInputError("--folds", f"{folds} folds of {len(moments.groups)} groups")
    best = calibrated(moments, {(k.first, k.then): k.lift for k in links}, windows)
    intervals = best.fitted.intervals | {name: (p.low, p.high) for name, p in best.profiles.items()}

    def lifts_of(known: frozenset[str]) -> dict[tuple[str, str], float]:
        return {(k.first, k.then): k.lift for k in lifts([e for e in found if e.group in known], seed, draws=2)}

    scores, predicted, y = compare(moments, lifts_of, folds, seed, windows)
    parameters = RiskParameters(
        name=out.stem,
        provenance=Provenance(
            source=f"{len(found)} events, {sum(e.accident for e in found)} accidents, mode {mode or 'any'}",
            created=today(),
            command=shlex.join(["foreshock", *sys.argv[1:]]),
            data=tuple(_digest(path) for path in (*events, *([nominal_file] if nominal_file else []))),
            synthetic=any(e.source == SYNTHETIC for e in found),
        ),
        a=best.fitted.a,
        b=best.fitted.b,
        c=best.fitted.c,
        kappa=best.fitted.kappa,
        presence=best.presence,
        rho=best.rho,
        window_s=best.window_s,
        horizon_s=horizon,
        intervals=intervals,
        correlation=scaled(pairs, best.rho, *intervals.get("rho", (best.rho, best.rho))),
        cascade=links,
    )
    save_parameters(out, parameters)
    bins = {name: reliability(p, y) for name, p in predicted.items()}
    if report is not None:
        from foreshock.calibration.report import write_calibration_report

        write_calibration_report(report, parameters, scores, bins, len(y), list(best.profiles.values()))
    if as_json:
        profiles = list(best.profiles.values())
        emit(
            {
                "parameters": parameters,
                "profiles": profiles,
                "scores": scores,
                "reliability": bins,
                "moments": len(y),
                "with_evidence": best.fitted.n,
            }
        )
    else:
        _print(parameters, scores, len(y), best.fitted)
        console.print(f"parameters: {out}" + (f"; report: {report}" if report else ""), markup=False)
    for p in best.profiles.values():
        if p.name == "window_s" and not windows and p.best in (p.curve[0][0], p.curve[-1][0]):
            other = "longer" if p.best == p.curve[-1][0] else "shorter"
            notes.print(
                f"[yellow]window {p.best:g} s is at the end of what was tried: the events ask for a {other} one[/]"
            )
    if problems:
        notes.print(f"[yellow]{problems} malformed rows were left out; see: foreshock events check[/]")
    return OK


def _once_each(files: tuple[Path, ...], coder: str) -> tuple[list[Event], int]:
    """The events of all files, each as one coder saw it, and the number of malformed rows."""
    found: dict[str, Event] = {}
    problems = 0
    for path in files:
        read = read_events(path, builtin_taxonomy())
        problems += len(read.problems)
        for event in read.events:
            if event.id not in found or (coder and event.coder == coder):
                found[event.id] = event
    if not found:
        raise BadInputError(", ".join(map(str, files)), "no event can be read", "; see: foreshock events check")
    return list(found.values()), problems


def _digest(path: Path) -> str:
    return f"{path.name} sha256:{hashlib.sha256(path.read_bytes()).hexdigest()}"


def _print(p: RiskParameters, scores: list[Score], moments: int, fitted: Fitted) -> None:
    if p.provenance.synthetic:
        console.print("[bold red]SYNTHETIC: some or all of the events were never observed.[/]")
    values = msgspec.to_builtins(p)
    rows = [
        (
            name,
            f"{values[name]:.3f}",
            "{:.3f} to {:.3f}".format(*p.intervals[name]) if name in p.intervals else "not fitted",
        )
        for name in ("a", "b", "c", "kappa", "window_s", "rho", "presence")
    ]
    what = f"P within {p.horizon_s:g} s, window {p.window_s:g} s; {moments} moments, {fitted.n} of them with evidence"
    what += f", {fitted.events} of these before an accident"
    console.print(what, markup=False)
    table("Fitted to all of them", "parameter", "value", "95% interval", rows=rows, right=("value", "95% interval"))
    scored = [
        (
            s.model,
            f"{s.brier:.4f}",
            f"{s.log_loss:.4f}",
            f"{s.difference:+.4f} ({s.low:+.4f} to {s.high:+.4f})" if s.low or s.high else "reference",
        )
        for s in scores
    ]
    columns = ("Brier", "log loss", "Brier difference")
    table("Out of fold; the difference is to the fitted independent LE", "model", *columns, rows=scored, right=columns)
