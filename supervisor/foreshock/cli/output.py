"""How commands print: tables for people, one JSON envelope for programs, one line for an error.

Exit codes: 0 ok; 1 a negative result; 2 bad input; 3 an internal failure or a twin that failed;
130 interrupted (SIGINT); 143 ended by SIGTERM, children included.
"""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Iterable, Sequence
from typing import Any

import msgspec
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from foreshock.registry import Broken

__all__ = [
    "BAD_INPUT",
    "FAILED",
    "INTERRUPTED",
    "NEGATIVE",
    "OK",
    "TERMINATED",
    "console",
    "emit",
    "left_out",
    "notes",
    "table",
    "warn",
]

OK, NEGATIVE, BAD_INPUT, FAILED, INTERRUPTED, TERMINATED = 0, 1, 2, 3, 130, 143
SCHEMA = "foreshock/1"

console = Console(highlight=False, width=None if sys.stdout.isatty() or "COLUMNS" in os.environ else 120)
"""Results."""
notes = Console(stderr=True, highlight=False)
"""Progress, hints and errors."""


def _plain(value: Any) -> Any:
    """Builtins only; a number that JSON cannot say is null."""
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if isinstance(value, dict):
        return {k: _plain(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(v) for v in value]
    return value


def emit(result: Any, errors: list[dict[str, str]] | None = None) -> None:
    """Print the envelope {schema, ok, result, errors}."""
    plain = _plain(msgspec.to_builtins(result))
    envelope = {"schema": SCHEMA, "ok": not errors, "result": plain, "errors": errors or []}
    sys.stdout.write(msgspec.json.format(msgspec.json.encode(envelope), indent=2).decode() + "\n")


def left_out(broken: Iterable[Broken]) -> None:
    """Say which plugins are missing from a result, one line each, and why."""
    for b in broken:
        notes.print(f"[yellow]plugin {escape(b.name)} is left out:[/] {escape(b.reason)}", soft_wrap=True)


def warn(warnings: Iterable[str]) -> None:
    """Say what is allowed but probably not meant, one line each."""
    for warning in warnings:
        notes.print(f"[yellow]warning: {escape(warning)}[/]", soft_wrap=True)


def table(title: str, *columns: str, rows: Sequence[tuple[str, ...]], right: tuple[str, ...] = ()) -> None:
    """Print a table below its title, which may be wider; the columns named in right are aligned to it."""
    console.print(title, style="bold", markup=False, soft_wrap=True)
    t = Table(header_style="bold", pad_edge=False)
    for c in columns:
        t.add_column(c, justify="right" if c in right else "left", overflow="fold")
    for row in rows:
        t.add_row(*(escape(cell) for cell in row))
    console.print(t)
