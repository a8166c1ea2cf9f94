"""What is wrong in a file of events, and where."""

from __future__ import annotations

import math

import msgspec

__all__ = ["Problem", "wrong_number"]


class Problem(msgspec.Struct, frozen=True):
    """Something wrong in a file of events.

    Attributes:
        row: as a spreadsheet numbers it: the header of a CSV file is row 1; in Parquet, which has no header, the
            first event is row 1, and row 0 stands for the columns themselves.
        column: its name; empty if the row as a whole is wrong.
        value: what stands there.
        message: what is wrong, what was expected, and the nearest right name.
    """

    row: int
    column: str
    value: str
    message: str

    def __str__(self) -> str:
        return f"row {self.row}{', ' if self.column else ''}{self.column}: {self.message}"


def wrong_number(value: object, *, above: bool = False) -> str:
    """Why this is not a finite number of at least 0 (above: above 0); empty if it is one."""
    try:
        number = float(value) if isinstance(value, (str, int, float)) and not isinstance(value, bool) else math.nan
    except (ValueError, OverflowError):
        number = math.nan
    if not math.isfinite(number):
        return f"{value!r} is not a finite number"
    if number < 0:
        return f"{number:g} is negative"
    return f"{number:g} is not above 0" if above and number == 0 else ""
