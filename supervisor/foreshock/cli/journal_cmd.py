"""``foreshock journal``: what a file holds, and a whole file of a torn one."""

from __future__ import annotations

from pathlib import Path

import click
from rich.markup import escape

from foreshock.cli.output import OK, console, emit, table
from foreshock.recording import JournalFile, recover, summary

__all__ = ["journal"]

FILE = click.Path(path_type=Path, exists=True, dir_okay=False)


@click.group()
def journal() -> None:
    """Journals of runs: MCAP files that Foxglove and PlotJuggler read, and that replay exactly."""


@journal.command()
@click.argument("file", type=FILE)
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def info(file: Path, as_json: bool) -> int:
    """Say what a journal FILE holds."""
    found = summary(file)
    if as_json:
        emit(found)
        return OK
    rows = [(topic, str(n)) for topic, n in sorted(found.messages.items())]
    table(f"{file}: {found.ticks} ticks, {found.seconds:.1f} s", "topic", "messages", rows=rows, right=("messages",))
    head = JournalFile(file).head
    console.print(f"Foreshock {head.foreshock}, Python {head.python}, seed {head.seed}", markup=False)
    console.print(f"digest {found.digest}")
    if found.left_out:
        console.print(f"[yellow]recovered: {escape(found.left_out)}[/]", soft_wrap=True)
    if not found.complete:
        console.print("[yellow]not closed: its writer was killed, or still writes; see foreshock journal recover[/]")
    return OK


@journal.command("recover")
@click.argument("file", type=FILE)
@click.argument("out", type=click.Path(path_type=Path, dir_okay=False))
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def recover_command(file: Path, out: Path, as_json: bool) -> int:
    """Copy every whole tick of a torn or damaged FILE to OUT, with an index, so that any reader of MCAP opens it.

    It ends before the first damage, and says where that is and how much is left out; exit code 0 then, too.
    """
    found = recover(file, out)
    if as_json:
        emit(found)
    else:
        console.print(f"{found.ticks} ticks, {sum(found.messages.values())} messages: {out}", markup=False)
        if found.left_out:
            console.print(f"[yellow]{escape(found.left_out)}[/]", soft_wrap=True)
    return OK
