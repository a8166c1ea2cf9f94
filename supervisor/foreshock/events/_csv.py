"""Events in CSV: one row for each coding of an event, precursors in one cell."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from foreshock.errors import BadInputError
from foreshock.events import _cells
from foreshock.events._problem import Problem
from foreshock.events.schema import Event

__all__ = ["read", "write"]


def read(path: Path) -> tuple[list[str], list[tuple[int, dict[str, Any]]], list[Problem]]:
    """Column names, raw rows with their numbers, and rows that are not CSV.

    Raises:
        BadInputError: it is empty, not UTF-8, or has no usable header.
        OSError: it cannot be read.
    """
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            lines, problems = _lines(file.read())
    except UnicodeDecodeError as e:
        raise BadInputError(str(path), f"not UTF-8: {e.reason} at byte {e.start}") from None
    if not lines or lines[0][0] != 1:
        raise BadInputError(str(path), "has no header", "; its first row must name the columns")
    names = [name.strip() for name in lines[0][1]]
    if len(names) == 1 and ";" in names[0]:
        raise BadInputError(str(path), "its columns are separated by semicolons", "; export it with commas")
    if repeated := sorted({name for name in names if names.count(name) > 1}):
        raise BadInputError(str(path), f"has the column {repeated[0]!r} twice")
    rows = []
    for number, line in lines[1:]:
        if len(line) > len(names):
            more = f"has {len(line)} cells for {len(names)} columns; quote a cell that holds a comma"
            problems.append(Problem(number, "", ",".join(line[len(names) :]), more))
        else:
            rows.append((number, dict(zip(names, line, strict=False))))
    return names, rows, problems


def _lines(text: str) -> tuple[list[tuple[int, list[str]]], list[Problem]]:
    """Rows that hold something, with their numbers; reading goes on after a row that is not CSV."""
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    lines: list[tuple[int, list[str]]] = []
    problems: list[Problem] = []
    number = 0
    while True:
        number += 1
        begun = reader.line_num + 1
        try:
            line = next(reader)
        except StopIteration:
            return lines, problems
        except csv.Error as e:
            message = f"not CSV: {e}; lines {begun} to {reader.line_num} of the file are lost"
            problems.append(Problem(number, "", "", message))
            continue
        if any(cell.strip() for cell in line):
            lines.append((number, line))


def write(path: Path, events: Sequence[Event]) -> None:
    """Write the events.

    Raises:
        BadInputError: a precursor that the syntax cannot say.
        OSError: it cannot be written.
    """
    names = Event.__struct_fields__
    with path.open("w", newline="", encoding="utf-8") as file:
        out = csv.writer(file)
        out.writerow(names)
        out.writerows([_cell(event, name) for name in names] for event in events)


def _cell(event: Event, name: str) -> str:
    value = getattr(event, name)
    if name == "precursors":
        return _cells.text(event.precursors, f"{event.id} of {event.coder}")
    if isinstance(value, tuple):
        return ";".join(value)
    return "" if value is None else value if isinstance(value, str) else repr(float(value))
