"""``foreshock campaign``."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click
import msgspec
from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeRemainingColumn
from rich.progress import Progress as Bar

from foreshock.campaign.again import Again, case_of
from foreshock.campaign.again import rerun as rerun_case
from foreshock.campaign.cluster import dask_runner
from foreshock.campaign.compare import compare as compare_campaigns
from foreshock.campaign.engine import Campaign, Estimate, Progress, begin, execute, refuse_changes, reopen
from foreshock.campaign.ledger import Row
from foreshock.campaign.plan import Case
from foreshock.campaign.recorded import recorded
from foreshock.campaign.report import ranking_of, write_results
from foreshock.campaign.results import ArmResult
from foreshock.campaign.spec import campaign_schema, load_campaign, shipped
from foreshock.cli._campaign_results import print_changes, print_limits, print_results, results_json
from foreshock.cli.output import FAILED, NEGATIVE, OK, console, emit, notes, table
from foreshock.cli.simulate_cmd import summary, timeline
from foreshock.errors import BadInputError, MissingExtraError
from foreshock.registry import Registry
from foreshock.session.isolated import Failure, run_stream
from foreshock.session.run import Run

__all__ = ["campaign"]

folder_argument = click.argument("folder", type=click.Path(path_type=Path, file_okay=False), metavar="DIR")
workers_option = click.option(
    "--workers", type=click.IntRange(1), default=os.cpu_count() or 1, show_default=True, help="Processes."
)
dask_option = click.option("--dask", metavar="ADDRESS", help="Run on the Dask cluster of this scheduler instead.")
json_option = click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")


@click.group()
def campaign() -> None:
    """Test campaigns: scenarios, factors and arms on the same seeds; durable, resumable, with statistics."""


@campaign.command("list")
@json_option
def list_(as_json: bool) -> None:
    """List the campaigns that come with Foreshock."""
    found = {id_: load_campaign(id_)[0] for id_ in shipped()}
    if as_json:
        emit([{"id": id_, "title": spec.title, "file": shipped()[id_]} for id_, spec in found.items()])
        return
    table("Campaigns", "id", "what", rows=[(id_, spec.title) for id_, spec in found.items()])


@campaign.command()
def schema() -> None:
    """Print the JSON schema of a campaign file."""
    click.echo(msgspec.json.format(msgspec.json.encode(campaign_schema(), order="sorted"), indent=2).decode())


@campaign.command()
@click.argument("spec")
@click.option("--out", type=click.Path(path_type=Path, file_okay=False), required=True, help="Folder of the campaign.")
@workers_option
@dask_option
@json_option
def run(spec: str, out: Path, workers: int, dask: str | None, as_json: bool) -> int:
    """Begin a campaign: SPEC is a TOML file, or the id of one that comes with Foreshock.

    Exit code 3 if a run gave no result; the others are not affected. Else 1 if the budget of wall time was used up
    before all were done.
    """
    parsed, origin = load_campaign(spec)
    return _go(begin(parsed, origin, out, Registry(), spec), workers, dask, as_json)


@campaign.command()
@folder_argument
@click.option("--accept", is_flag=True, help="Go on although something has changed; what depends on it is run again.")
@click.option("--retry", is_flag=True, help="Do runs again that gave no result.")
@workers_option
@dask_option
@json_option
def resume(folder: Path, accept: bool, retry: bool, workers: int, dask: str | None, as_json: bool) -> int:
    """Go on with a campaign that was broken off; the result is the same as without the break.

    Its file is read again: with --accept, what was added to it is run, too. Exit codes as of run.
    """
    found, changed = reopen(folder, Registry(), accept=accept)
    if not accept:
        refuse_changes(folder, changed)
    return _go(found, workers, dask, as_json, retry=retry)


@campaign.command()
@folder_argument
@json_option
def status(folder: Path, as_json: bool) -> int:
    """Say how far a campaign is, and what failed."""
    found, changed = recorded(folder, Registry())
    rows = found.rows()
    state = _state(found, rows, changed)
    if as_json:
        emit(state)
        return OK
    _print_state(state, rows)
    return OK


@campaign.command()
@folder_argument
@click.option(
    "--markdown",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE",
    help="Write which arm wins where, where Foreshock loses, and what each fault does, as Markdown.",
)
@json_option
def report(folder: Path, markdown: Path | None, as_json: bool) -> int:
    """Write report.html and the Parquet files into DIR, and print the results.

    Also of a campaign that is not complete.
    """
    found, changed = recorded(folder, Registry())
    for line in changed:
        notes.print(f"changed since it was begun: {line}", markup=False)
    results, paths = write_results(found)
    if markdown is not None:
        markdown.write_text(ranking_of(found, results))
        paths.append(markdown)
    if as_json:
        emit({"results": results_json(results), "files": [str(p) for p in paths]})
        return OK
    print_results(found.plan.spec, results)
    for path in paths:
        console.print(str(path), markup=False)
    return OK


@campaign.command()
@click.argument("first", type=click.Path(path_type=Path, file_okay=False), metavar="A")
@click.argument("second", type=click.Path(path_type=Path, file_okay=False), metavar="B")
@click.option("--allow-missing", is_flag=True, help="Compare what is there although B lacks runs that A has.")
@json_option
def compare(first: Path, second: Path, allow_missing: bool, as_json: bool) -> int:
    """Hold campaign B against campaign A, run by run where they share runs.

    Exit code 1 if a result of B is significantly worse (more accidents or false interventions, less lead time, more
    time at reduced speed as commanded, more runs without a result) or B lacks runs that A has; 2 if they have nothing
    in common.
    """
    registry = Registry()
    sides = [recorded(folder, registry)[0] for folder in (first, second)]
    rows = [c.rows() for c in sides]
    found = compare_campaigns(*((c.plan, r) for c, r in zip(sides, rows, strict=True)))
    if not found.changes:
        told = "".join(f"\n  {line}" for line in found.differs)
        raise BadInputError(str(second), f"has no arm and scenario with runs in common with {first}", told)
    pairs = zip(sides, rows, strict=True)
    extent = [{"folder": str(c.folder), "planned": len(c.plan.cases), "done": len(r)} for c, r in pairs]
    if as_json:
        changes = [{**msgspec.to_builtins(c), "worse": c.worse} for c in found.changes]
        emit({**msgspec.to_builtins(found), "changes": changes, "first": extent[0], "second": extent[1]})
    else:
        print_changes(found.changes)
    print_limits(found, extent)
    return NEGATIVE if any(c.worse for c in found.changes) or (found.missing and not allow_missing) else OK


@campaign.command()
@folder_argument
@click.argument("key")
@click.option("--report", "page", type=click.Path(path_type=Path, dir_okay=False), help="Write an HTML report here.")
@click.option("--journal", type=click.Path(path_type=Path, dir_okay=False), help="Record the run in this MCAP file.")
@json_option
def rerun(folder: Path, key: str, page: Path | None, journal: Path | None, as_json: bool) -> int:
    """Run one run of DIR again, in full detail: KEY is the beginning of its key, as in the report.

    Exit code 1 if it is not what the ledger says.
    """
    found, changed = reopen(folder, Registry())
    case = case_of(found, key, changed)
    again = rerun_case(found, case, journal)
    if page is not None:
        _page(page, again.result, case)
    if as_json:
        result = again.result
        shown = msgspec.structs.replace(result, series={}) if isinstance(result, Run) else _failure(result)
        emit({"case": case, "result": shown, "differs": again.differs, "known": again.known, "changed": changed})
    else:
        _print_again(again, changed)
    return NEGATIVE if again.differs else OK


def _failure(failure: Failure) -> dict[str, str]:
    return {"kind": failure.kind, "detail": failure.detail, "log": failure.log}


def _page(path: Path, result: Run | Failure, case: Case) -> None:
    if isinstance(result, Failure):
        notes.print(f"no report: the run gave no result ({result.kind})", markup=False)
        return
    try:
        from foreshock.report import write_report
    except ImportError as e:
        raise BadInputError("--report", f"needs {e.name}", "; run: pip install 'foreshock[report]'") from e
    write_report(path, f"{case.scenario}, arm {case.arm}, seed {case.seed}", [(case.arm, result)])
    notes.print(f"report: {path}", markup=False)


def _print_again(again: Again, changed: list[str]) -> None:
    case, result = again.case, again.result
    if isinstance(result, Run):
        timeline(result, f"{case.key}: {case.scenario}, arm {case.arm}, seed {case.seed}")
        console.print(summary(result), soft_wrap=True)
    else:
        console.print(f"{result.kind}: {result.detail}", markup=False)
    for line in changed:
        console.print(f"changed since it was begun: {line}", markup=False)
    if not again.known:
        console.print("the ledger has no result of it yet")
    elif not again.differs:
        console.print("the same as in the ledger")
    for name, (before, now) in again.differs.items():
        console.print(f"differs: {name} was {before}, is {now}", markup=False, style="red")


def _go(found: Campaign, workers: int, dask: str | None, as_json: bool, *, retry: bool = False) -> int:
    runner = run_stream if dask is None else dask_runner(dask, found.plan)
    with _bar(len(found.plan.cases), len(found.rows()), as_json) as (estimated, told):
        complete = execute(found, workers, runner=runner, estimated=estimated, told=told, retry=retry)
    rows = found.rows()
    state = _state(found, rows, [])
    results: list[ArmResult] = []
    files: list[str] = []
    try:
        results, paths = write_results(found)
        files = [str(p) for p in paths]
    except MissingExtraError as e:
        notes.print(f"no report: {e}", markup=False)
    if as_json:
        emit({**state, "complete": complete, "results": results_json(results), "files": files})
    else:
        if results:
            print_results(found.plan.spec, results)
        _print_state(state, rows)
        for path in files:
            console.print(path, markup=False)
    if missing := found.plan.spec.unpaired:
        notes.print(f"there is no reference arm (kind none or shadow): no {', '.join(missing)}", soft_wrap=True)
    if not complete:
        notes.print(
            f"the budget of {found.plan.spec.budget.hours:g} h is used up after {len(rows)} of {len(found.plan.cases)} "
            f"runs; go on with: foreshock campaign resume {found.folder}",
            markup=False,
            soft_wrap=True,
        )
    return FAILED if any(not r.ok for r in rows) else OK if complete else NEGATIVE


def _state(found: Campaign, rows: list[Row], changed: list[str]) -> dict[str, Any]:
    failed: dict[str, int] = {}
    for row in rows:
        if not row.ok:
            failed[row.status] = failed.get(row.status, 0) + 1
    return {
        "campaign": found.plan.spec.id,
        "folder": str(found.folder),
        "planned": len(found.plan.cases),
        "done": len(rows),
        "failed": failed,
        "simulated_h": sum(r.end_s or 0.0 for r in rows) / 3600.0,
        "changed": changed,
        "note": found.note,
        "aside": found.aside(),
    }


def _print_state(state: dict[str, Any], rows: list[Row]) -> None:
    failed = ", ".join(f"{n} {kind}" for kind, n in sorted(state["failed"].items())) or "none failed"
    console.print(
        f"{state['campaign']}: {state['done']} of {state['planned']} runs, {state['simulated_h']:.2f} h simulated; "
        f"{failed}",
        markup=False,
    )
    if state["note"]:
        notes.print(state["note"], markup=False, soft_wrap=True)
    if state["aside"]:
        console.print(f"{state['aside']} rows in the ledger are no longer part of it", markup=False)
    for line in state["changed"]:
        console.print(f"changed since it was begun: {line}", markup=False)
    for row in [r for r in rows if not r.ok][:8]:
        console.print(f"  {row.key} {row.scenario} {row.arm} seed {row.seed}: {row.status}: {row.detail}", markup=False)


@contextmanager
def _bar(
    total: int, known: int, quiet: bool
) -> Iterator[tuple[Callable[[Estimate], None], Callable[[Progress], None]]]:
    """A progress bar with rate, time left and failures; and the estimate before the bulk of it."""
    with Bar(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[rate]:.1f} runs/s"),
        TimeRemainingColumn(),
        TextColumn("left"),
        TextColumn("{task.fields[failed]} failed"),
        console=notes,
        transient=True,
        disable=quiet,
    ) as bar:
        task = bar.add_task("campaign", total=total, completed=known, failed=0, rate=0.0)

        def estimated(e: Estimate) -> None:
            if not quiet:
                notes.print(
                    f"{e.runs} runs of {e.simulated_s / 3600.0:.2f} h simulated are left; estimate: {_time(e.wall_s)}"
                )

        def told(p: Progress) -> None:
            bar.update(task, completed=p.done, failed=p.failed, rate=p.rate_hz)

        yield estimated, told


def _time(wall_s: float) -> str:
    if not wall_s >= 90.0:
        return f"{wall_s:.0f} s"
    return f"{wall_s / 60.0:.0f} min" if wall_s < 5400.0 else f"{wall_s / 3600.0:.1f} h"
