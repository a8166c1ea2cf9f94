"""``foreshock replay``."""

from __future__ import annotations

from pathlib import Path

import click
from rich.progress import Progress

from foreshock.cli.output import NEGATIVE, OK, console, emit, notes, table
from foreshock.config import load_config
from foreshock.session.replay import replay as run_replay

__all__ = ["replay"]


@click.command()
@click.argument("file", type=click.Path(path_type=Path, exists=True, dir_okay=False))
@click.option(
    "--config",
    type=click.Path(path_type=Path, exists=True, dir_okay=False),
    help="Another configuration: what would have happened.",
)
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def replay(file: Path, config: Path | None, as_json: bool) -> int:
    """Make the decisions of a journal FILE again and compare their digests.

    Exit code 1 if samples were altered or a decision differs; with --config decisions may differ, samples must not.
    """
    other = None if config is None else load_config(config)
    with Progress(console=notes, transient=True, disable=as_json) as bar:
        task = bar.add_task("ticks", total=None)
        result = run_replay(
            file, config=other, base=config.parent if config else None, done=lambda _: bar.update(task, advance=1)
        )
    fine = result.altered_at is None and (result.foreign or result.agrees)
    if as_json:
        emit(result)
        return OK if fine else NEGATIVE
    rows = [(name, str(count)) for name, count in result.levels.items()]
    table(f"{file}: {result.ticks} ticks in {result.seconds:.1f} s", "level", "ticks", rows=rows, right=("ticks",))
    if not result.complete:
        console.print("[yellow]the file was not closed: what is there was replayed[/]")
    if result.altered_at is not None:
        console.print(f"[red]samples of tick {result.altered_at} or before are not those that were recorded[/]")
    if result.foreign:
        said = "the same as" if result.differs_at is None else f"not those, from tick {result.differs_at} on, of"
        console.print(f"decisions with {config} are {said} the recorded configuration", markup=False)
    elif result.differs_at is not None:
        console.print(f"[red]decisions differ from tick {result.differs_at} on[/]")
    else:
        console.print(f"[green]decisions agree[/]: {result.replayed}")
    return OK if fine else NEGATIVE
