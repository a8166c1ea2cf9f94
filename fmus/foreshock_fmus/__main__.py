"""``python -m foreshock_fmus``: list the plants that come with Foreshock, and build one as an FMU."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

import click

from foreshock.cli.output import BAD_INPUT, emit, notes, table
from foreshock.errors import BadInputError
from foreshock_fmus import build_fmu, plants, read_plant

__all__ = ["main"]


@click.group()
def commands() -> None:
    """Plants as FMUs."""


@commands.command("list")
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def list_(as_json: bool) -> None:
    """List the plants."""
    found = {name: read_plant(folder / f"{name}.toml") for name, folder in plants().items()}
    if as_json:
        emit([{"id": name, "title": p.title} for name, p in found.items()])
    else:
        table("Plants", "id", "title", rows=[(name, p.title) for name, p in found.items()])


@commands.command()
@click.argument("plant")
@click.option("--fmi", type=click.Choice(["2", "3"]), default="3", show_default=True, help="FMI version.")
@click.option("--out", type=click.Path(path_type=Path, dir_okay=False), help="Copy the FMU here.")
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def build(plant: str, fmi: str, out: Path | None, as_json: bool) -> None:
    """Build a plant (a name, or a folder with its sources) and print where the FMU is."""
    built = build_fmu(Path(plant) if "/" in plant else plant, int(fmi))
    if out is not None:
        out.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(built, out)
        built = out
    if as_json:
        emit({"fmu": str(built)})
    else:
        click.echo(built)


def main() -> None:
    """Run the commands; bad input is one message and exit code 2."""
    try:
        commands(prog_name="python -m foreshock_fmus")
    except BadInputError as e:
        if "--json" in sys.argv:
            emit(None, [{"kind": type(e).__name__, "message": str(e)}])
        else:
            notes.print(f"error: {e}", markup=False, soft_wrap=True)
        sys.exit(BAD_INPUT)


if __name__ == "__main__":
    main()
