"""``foreshock campaign``."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click
import msgspec
from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.progress import Progress as Bar

from foreshock.campaign.engine import Campaign, Estimate, Progress, begin, execute, refuse_changes, reopen
from foreshock.campaign.ledger import Row
from foreshock.campaign.spec import campaign_schema, load_campaign, shipped
from foreshock.cli.output import FAILED, OK, console, emit, notes, table
from foreshock.registry import Registry

__all__ = ["campaign"]

folder_argument = click.argument("folder", type=click.Path(path_type=Path, file_okay=False), metavar="DIR")
workers_option = click.option(
    "--workers", type=click.IntRange(1), default=os.cpu_count() or 1, show_default=True, help="Processes."
)
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
@json_option
def run(spec: str, out: Path, workers: int, as_json: bool) -> int:
    """Begin a campaign: SPEC is a TOML file, or the id of one that comes with Foreshock.

    Exit code 3 if a run gave no result; the others are not affected.
    """
    parsed, origin = load_campaign(spec)
    return _go(begin(parsed, origin, out, Registry()), workers, as_json)


@campaign.command()
@folder_argument
@click.option("--accept", is_flag=True, help="Go on although something has changed; what depends on it is run again.")
@click.option("--retry", is_flag=True, help="Do runs again that gave no result.")
@workers_option
@json_option
def resume(folder: Path, accept: bool, retry: bool, workers: int, as_json: bool) -> int:
    """Go on with a campaign that was broken off; the result is the same as without the break."""
    found, changed = reopen(folder, Registry(), accept=accept)
    if not accept:
        refuse_changes(folder, changed)
    return _go(found, workers, as_json, retry=retry)


@campaign.command()
@folder_argument
@json_option
def status(folder: Path, as_json: bool) -> int:
    """Say how far a campaign is, and what failed."""
    found, changed = reopen(folder, Registry())
    rows = found.rows()
    state = _state(found, rows, changed)
    if as_json:
        emit(state)
        return OK
    _print_state(state, rows)
    return OK


def _go(found: Campaign, workers: int, as_json: bool, *, retry: bool = False) -> int:
    total = len(found.plan.cases)
    with _bar(total, as_json) as (estimated, told):
        complete = execute(found, workers, estimated=estimated, told=told, retry=retry)
    rows = found.rows()
    state = _state(found, rows, [])
    if as_json:
        emit(state)
    else:
        _print_state(state, rows)
    if not complete:
        notes.print(f"the budget of wall time is used up; go on with: foreshock campaign resume {found.folder}")
    return FAILED if any(not r.ok for r in rows) else OK


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
    }


def _print_state(state: dict[str, Any], rows: list[Row]) -> None:
    failed = ", ".join(f"{n} {kind}" for kind, n in sorted(state["failed"].items())) or "none failed"
    console.print(
        f"{state['campaign']}: {state['done']} of {state['planned']} runs, {state['simulated_h']:.2f} h simulated; "
        f"{failed}",
        markup=False,
    )
    for line in state["changed"]:
        console.print(f"changed since it was begun: {line}", markup=False)
    for row in [r for r in rows if not r.ok][:8]:
        console.print(f"  {row.key} {row.scenario} {row.arm} seed {row.seed}: {row.status}: {row.detail}", markup=False)


@contextmanager
def _bar(total: int, quiet: bool) -> Iterator[tuple[Callable[[Estimate], None], Callable[[Progress], None]]]:
    """A progress bar with rate, time left and failures; and the estimate before the bulk of it."""
    with Bar(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[rate]:.1f} runs/s"),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
        TextColumn("{task.fields[failed]} failed"),
        console=notes,
        transient=True,
        disable=quiet,
    ) as bar:
        task = bar.add_task("campaign", total=total, failed=0, rate=0.0)

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
