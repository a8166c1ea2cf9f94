"""Tables of events in CSV or Parquet; a bad row is listed with row and column, and costs no good one."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import msgspec

from foreshock.errors import BadInputError, nearest
from foreshock.events import _cells, _csv, _parquet
from foreshock.events._problem import Problem
from foreshock.events._row import Row
from foreshock.events.schema import Event
from foreshock.taxonomy import Taxonomy

__all__ = ["COLUMNS", "EventTable", "Problem", "read_events", "target", "write_events"]

COLUMNS = Event.__struct_fields__
OPTIONAL = ("group", "source")
SUFFIXES = (".csv", ".parquet")


class EventTable(msgspec.Struct, frozen=True):
    """What a file holds: its good rows, in order, and all problems of the others."""

    events: tuple[Event, ...]
    problems: tuple[Problem, ...]


def read_events(path: Path, taxonomy: Taxonomy) -> EventTable:
    """The events of a CSV or Parquet file.

    Names are taken in any case, with spaces or hyphens; aliases of kinds become their ids. A second row with the id
    and coder of an earlier one is a problem of the second.

    Args:
        path: its suffix says which.
        taxonomy: resolves kinds and accident modes.

    Raises:
        BadInputError: not such a file, or a column that it needs is missing.
    """
    path = Path(path)
    header = 1 if _suffix(path) == ".csv" else 0
    try:
        names, rows, problems = _csv.read(path) if header else _parquet.read(path)
    except OSError as e:
        siblings = [p.name for p in path.parent.glob("*") if p.suffix in SUFFIXES] if path.parent.is_dir() else []
        raise BadInputError(str(path), e.strerror or str(e), nearest(path.name, siblings)) from None
    unknown = [name for name in names if name not in COLUMNS]
    for name in COLUMNS:
        if name not in names and name not in OPTIONAL:
            hint = nearest(name, unknown) if unknown else ""
            raise BadInputError(str(path), f"has no column {name!r}", hint or f"; it has: {', '.join(names)}")
    problems += [Problem(header, n, n, f"unknown column {n!r}, not read{nearest(n, COLUMNS)}") for n in unknown]
    events = _events(rows, taxonomy, problems)
    return EventTable(events, tuple(sorted(problems, key=lambda p: p.row)))


def _events(
    rows: Sequence[tuple[int, dict[str, Any]]], taxonomy: Taxonomy, problems: list[Problem]
) -> tuple[Event, ...]:
    events = []
    seen: dict[tuple[str, str], int] = {}
    for number, raw in rows:
        row = Row(number, raw, taxonomy)
        event = row.event()
        problems += row.problems
        id_, coder = str(raw.get("id") or ""), str(raw.get("coder") or "")
        first = seen.setdefault((id_, coder), number)
        if first != number and id_:
            problems.append(Problem(number, "id", id_, f"{id_!r} by coder {coder!r} stands in row {first} already"))
        elif event is not None:
            events.append(event)
    return tuple(events)


def write_events(path: Path, events: Sequence[Event]) -> None:
    """Write events as CSV or Parquet, by the path's suffix; what is read back is equal.

    Raises:
        BadInputError: another suffix, or a precursor that the CSV syntax cannot say.
        OSError: it cannot be written.
    """
    path = target(path)
    for e in events:
        _cells.text(e.precursors, f"{e.id} of {e.coder}")
    (_csv if path.suffix == ".csv" else _parquet).write(path, events)


def target(path: Path) -> Path:
    """The path, if a table can be written there; its folder is made.

    Raises:
        BadInputError: neither .csv nor .parquet, or a folder.
        OSError: the folder cannot be made.
    """
    path = Path(path)
    _suffix(path)
    if path.is_dir():
        raise BadInputError(str(path), "is a folder")
    path.parent.mkdir(parents=True, exist_ok=True)
    return path


def _suffix(path: Path) -> str:
    if path.suffix not in SUFFIXES:
        raise BadInputError(str(path), f"unknown suffix {path.suffix!r}", f"; known: {', '.join(SUFFIXES)}")
    return path.suffix
