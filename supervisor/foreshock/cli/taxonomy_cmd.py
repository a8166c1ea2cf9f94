"""``foreshock taxonomy``."""

from __future__ import annotations

from pathlib import Path

import click

from foreshock.cli.output import console, emit, left_out, table
from foreshock.registry import Registry
from foreshock.taxonomy import builtin_taxonomy

__all__ = ["taxonomy"]


@click.group()
def taxonomy() -> None:
    """Accident modes and precursors, with their sources."""


@taxonomy.command()
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
@click.option("--extend", type=click.Path(path_type=Path), help="A TOML file with further [[kinds]].")
def show(as_json: bool, extend: Path | None) -> None:
    """Show classes, modes, cascades and kinds, those of installed plugins included."""
    registry = Registry()
    left_out(registry.load_all())
    full = builtin_taxonomy().extended(registry.precursors())
    if extend is not None:
        full = full.extended_from(extend)
    if as_json:
        tied = {k.id: full.modes_of(k.id) for k in full.kinds}
        emit({"taxonomy": full, "modes_of": tied})
        return
    table(
        "Precursor classes (section 3.2.2, Table 2)",
        "class",
        "share",
        "modes",
        rows=[(c.title, f"{c.share:.0%}", " ".join(c.modes)) for c in full.classes],
        right=("share",),
    )
    table(
        "Accident modes (Table 1) and their cascades (Table 3)",
        "code",
        "mode",
        "n",
        "%",
        "cascade",
        rows=[(m.code, m.title, str(m.n), f"{m.percent:.1f}", " → ".join(m.cascade)) for m in full.modes],
        right=("n", "%"),
    )
    table(
        f"Precursor kinds ({len(full.kinds)})",
        "kind",
        "class",
        "modes",
        "aliases",
        "source",
        rows=[(k.id, k.class_, " ".join(full.modes_of(k.id)), ", ".join(k.aliases), k.source) for k in full.kinds],
    )
    console.print(f"source: {full.source}", style="dim")
