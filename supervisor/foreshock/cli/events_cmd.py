"""``foreshock events``: the event database."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import click
from rich.markup import escape

from foreshock.cli._runs import ranges, runs_bar
from foreshock.cli.output import NEGATIVE, OK, console, emit, left_out, notes, table
from foreshock.errors import BadInputError, ForeshockError
from foreshock.events import SYNTHETIC, Event, Problem, read_events, write_events
from foreshock.events.analyse import analyse
from foreshock.events.html import write_events_report
from foreshock.events.record import record
from foreshock.events.summary import headline, text_tables
from foreshock.events.synthetic import EVENTS, synthetic_events
from foreshock.events.table import target
from foreshock.registry import Registry
from foreshock.session.isolated import Failure
from foreshock.session.run import Run
from foreshock.session.scenario import find_scenario
from foreshock.taxonomy import Taxonomy, builtin_taxonomy

__all__ = ["events"]

_FILE = click.Path(path_type=Path, dir_okay=False)
_json = click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
_extend = click.option("--extend", type=_FILE, help="A TOML file with further [[kinds]].")
_out = click.option("--out", type=_FILE, required=True, help="A .parquet or .csv file.")


@click.group()
def events() -> None:
    """The event database: coded, simulated or synthetic events as a validated table.

    Tables are CSV or Parquet, by suffix: one row for each coding of an event.
    """


@events.command()
@click.option("--seed", type=click.IntRange(0), required=True, help="Of the draw.")
@click.option("--n", type=click.IntRange(0), default=EVENTS, show_default=True, help="Number of accidents.")
@click.option("--near-misses", type=click.IntRange(0), default=0, show_default=True, help="Events without accident.")
@_out
@_json
def generate(seed: int, n: int, near_misses: int, out: Path, as_json: bool) -> None:
    """Draw a SYNTHETIC set with the paper's published marginals, coded by two synthetic coders.

    The paper's own events are not public. What comes out is labelled synthetic in ids, source column and Parquet
    metadata; it is for trying things out, and evidence of nothing.
    """
    drawn = synthetic_events(seed, n, near_misses=near_misses)
    write_events(out, drawn)
    _written(drawn, out, as_json)


@events.command()
@click.argument("file", type=_FILE)
@_extend
@_json
def check(file: Path, extend: Path | None, as_json: bool) -> int:
    """List what is wrong in a table, with row and column; exit code 1 if anything is."""
    read = read_events(file, _taxonomy(extend))
    if as_json:
        emit({"file": str(file), "rows": len(read.events), "problems": read.problems})
    else:
        _print_problems(read.problems)
        colour = "red" if read.problems else "green"
        console.print(f"[{colour}]{len(read.problems)} problems[/], {len(read.events)} good rows", soft_wrap=True)
    return NEGATIVE if read.problems else OK


@events.command()
@click.argument("file", type=_FILE)
@click.argument("out", type=_FILE)
@_extend
@_json
def convert(file: Path, out: Path, extend: Path | None, as_json: bool) -> int:
    """Write the good rows of FILE to OUT, CSV or Parquet; exit code 1 if there was any problem."""
    if file.resolve() == out.resolve():
        raise BadInputError(str(out), "is the table that is read", "; its bad rows would be lost")
    read = read_events(file, _taxonomy(extend))
    write_events(out, read.events)
    _written(read.events, out, as_json, read.problems)
    return NEGATIVE if read.problems else OK


@events.command(name="analyse")
@click.argument("file", type=_FILE)
@click.option("--out", type=_FILE, help="Write an HTML report with heat maps here.")
@click.option("--coder", default="", help="Whose coding counts for double-coded events; by default, see below.")
@_extend
@_json
def analyse_(file: Path, out: Path | None, coder: str, extend: Path | None, as_json: bool) -> None:
    """Frequencies, associations, overlap, order and agreement, beside what the paper publishes.

    An event with several codings counts once: as coded by whoever coded most events, or else who comes first.
    Rows with problems are listed and left out.
    """
    taxonomy = _taxonomy(extend)
    read = read_events(file, taxonomy)
    found = analyse(read.events, taxonomy, coder=coder)
    if out is not None:
        command = f"foreshock events analyse {file.name} --out {out.name}" + (f" --coder {coder}" if coder else "")
        write_events_report(out, found, taxonomy, problems=read.problems, command=command)
    if as_json:
        emit({"analysis": found, "problems": read.problems, "report": None if out is None else str(out)})
        return
    for problem in read.problems:
        notes.print(f"[yellow]left out:[/] {escape(str(problem))}", soft_wrap=True)
    console.print(escape(headline(found)), style="red" if found.synthetic else None, soft_wrap=True)
    for t in text_tables(found):
        table(t.title, *t.columns, rows=t.rows, right=t.columns[t.left :])
    if out is not None:
        console.print(f"report: {escape(str(out))}", soft_wrap=True)


def _seeds(_: click.Context, __: click.Parameter, given: str) -> range:
    first, colon, end = given.partition(":")
    if not colon or not first.isdecimal() or not end.isdecimal() or int(first) >= int(end):
        raise click.BadParameter(f"{given!r} is not FIRST:END with 0 <= FIRST < END")
    return range(int(first), int(end))


@events.command(name="record")
@click.argument("scenarios", nargs=-1, required=True, metavar="SCENARIO...")
@click.option("--seeds", callback=_seeds, required=True, metavar="FIRST:END", help="One run for each; END is not run.")
@click.option(
    "--vary",
    multiple=True,
    callback=ranges,
    metavar="NAME=LOW:HIGH",
    help="Draw a parameter of the twin uniformly for each seed.",
)
@_out
@click.option("--workers", type=click.IntRange(1), default=os.cpu_count() or 1, show_default=True, help="Processes.")
@_json
def record_(
    scenarios: tuple[str, ...],
    seeds: range,
    vary: dict[str, tuple[float, float]],
    out: Path,
    workers: int,
    as_json: bool,
) -> int:
    """Run scenarios (ids, or TOML files) unsupervised, and write them as events; exit code 1 if a run failed."""
    registry = Registry()
    found = [find_scenario(name, registry) for name in scenarios]
    taxonomy = _taxonomy(None, registry)
    target(out)  # what cannot be written is known before the runs
    failures: list[Failure] = []
    with runs_bar("runs", len(found) * len(seeds)) as told:

        def done(k: int, result: Run | Failure) -> None:
            if isinstance(result, Failure):
                failures.append(result)
            told(k, result)

        recorded = record(found, seeds, vary, workers=workers, done=done, taxonomy=taxonomy)
    write_events(out, recorded)
    for f in failures:
        said = f"{f.job.scenario.id}, seed {f.job.seed}: twin {f.kind}: {f.detail}"
        notes.print(f"[yellow]no event:[/] {escape(said)}", soft_wrap=True)
    _written(recorded, out, as_json, failures=len(failures))
    return NEGATIVE if failures else OK


def _taxonomy(extend: Path | None, registry: Registry | None = None) -> Taxonomy:
    """The paper's taxonomy with the kinds of installed plugins and of a file."""
    plugins = registry or Registry()
    left_out(plugins.load_all())
    try:
        full = builtin_taxonomy().extended(plugins.precursors())
    except ForeshockError as e:  # a broken plugin must not keep anybody from reading a table
        notes.print(f"[yellow]kinds of plugins are left out:[/] {escape(str(e))}", soft_wrap=True)
        full = builtin_taxonomy()
    return full if extend is None else full.extended_from(extend)


def _written(rows: Sequence[Event], out: Path, as_json: bool, problems: Sequence[Problem] = (), **more: int) -> None:
    ids = {e.id: e for e in rows}
    accidents, synthetic = sum(e.accident for e in ids.values()), sum(e.source == SYNTHETIC for e in ids.values())
    if as_json:
        counts = {"rows": len(rows), "events": len(ids), "accidents": accidents, "synthetic": synthetic, **more}
        emit({"file": str(out), **counts, "problems": problems})
        return
    _print_problems(problems)
    label = "[red]SYNTHETIC[/] " if synthetic else ""
    text = f"{len(rows)} rows, {len(ids)} events, {accidents} of them accidents: {out}"
    console.print(label + escape(text), soft_wrap=True)


def _print_problems(problems: Sequence[Problem]) -> None:
    for problem in problems:
        console.print(f"[yellow]{escape(str(problem))}[/]", soft_wrap=True)
