"""Events in Parquet: precursors as a list of structs; the schema's metadata say how many events are synthetic."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import msgspec

from foreshock.errors import BadInputError, MissingExtraError
from foreshock.events._problem import Problem
from foreshock.events.schema import SYNTHETIC, Event

__all__ = ["SYNTHETIC_KEY", "read", "write"]

SYNTHETIC_KEY = b"foreshock.synthetic"
"""Schema metadata; its value is e.g. ``252 of 252 rows are synthetic``."""


def _arrow(path: Path) -> tuple[Any, Any]:
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError as e:
        raise MissingExtraError(
            str(path), f"Parquet needs {e.name}", "; run: pip install 'foreshock[analysis]'"
        ) from None
    return pyarrow, parquet


def read(path: Path) -> tuple[list[str], list[tuple[int, dict[str, Any]]], list[Problem]]:
    """Column names, raw rows with their numbers from 1, and no problems.

    Raises:
        BadInputError: it is not a Parquet file.
        MissingExtraError: pyarrow is not installed.
        OSError: it cannot be read.
    """
    pyarrow, parquet = _arrow(path)
    try:
        with path.open("rb") as file:
            table = parquet.ParquetFile(file).read()
    except (pyarrow.ArrowInvalid, pyarrow.ArrowNotImplementedError) as e:
        raise BadInputError(str(path), f"not a Parquet file that can be read: {str(e).splitlines()[0]}") from None
    names = list(table.column_names)
    rows: list[dict[str, Any]] = table.to_pylist()
    if SYNTHETIC_KEY in (table.schema.metadata or {}) and "source" not in names:
        rows = [{**row, "source": SYNTHETIC} for row in rows]
    return names, list(enumerate(rows, 1)), []


def write(path: Path, events: Sequence[Event]) -> None:
    """Write the events.

    Raises:
        MissingExtraError: pyarrow is not installed.
        OSError: it cannot be written.
    """
    pa, parquet = _arrow(path)
    text, number = pa.string(), pa.float64()
    precursor = pa.struct(
        [("kind", text), ("onset_s", number), ("end_s", number), ("severity", number), ("subject", text)]
    )
    special = {
        "deviation": pa.list_(text),
        "precursors": pa.list_(precursor),
        "outcome_s": number,
        "observed_s": number,
    }
    synthetic = sum(e.source == SYNTHETIC for e in events)
    metadata = {SYNTHETIC_KEY: f"{synthetic} of {len(events)} rows are synthetic".encode()} if synthetic else None
    schema = pa.schema([(name, special.get(name, text)) for name in Event.__struct_fields__], metadata)
    rows = [msgspec.to_builtins(event) for event in events]
    with path.open("wb") as file:
        parquet.write_table(pa.Table.from_pylist(rows, schema), file)
