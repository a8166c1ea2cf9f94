"""``make bench``: prints the table and writes bench.json; ``python -m tests.bench NAME...`` does only these parts."""

from __future__ import annotations

import sys
from pathlib import Path

import msgspec
from rich.console import Console
from rich.progress import track
from rich.table import Table

from tests.bench import campaign, core, fmu_step, live, tick, whole_body
from tests.bench.rows import Row

OUT = Path("bench.json")
PARTS = {part.__name__.rpartition(".")[2]: part for part in (tick, core, fmu_step, whole_body, live, campaign)}


def main() -> int:
    """Run every benchmark, or those that are named."""
    names = sys.argv[1:] or list(PARTS)
    if unknown := sorted(set(names) - PARTS.keys()):
        sys.exit(f"no part {unknown[0]!r}; expected one of {', '.join(PARTS)}")
    rows: list[Row] = []
    for part in track(
        [PARTS[name] for name in names], description="bench", console=Console(stderr=True), transient=True
    ):
        rows += part.rows()
    table = Table(
        title="Foreshock benchmarks (us: CPU time; ms: wall clock; reference measured in the same run)",
        title_justify="left",
    )
    for column in ("what", "value", "unit", "reference", "ratio", "aim", "holds"):
        table.add_column(column, overflow="fold")
    for r in rows:
        reference = f"{r.reference:.1f}: {r.reference_name}"
        table.add_row(r.name, f"{r.value:.1f}", r.unit, reference, f"{r.ratio:.2f}", r.aim, "yes" if r.holds else "NO")
    Console(width=None if sys.stdout.isatty() else 150).print(table)
    OUT.write_bytes(msgspec.json.format(msgspec.json.encode(rows), indent=2) + b"\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
