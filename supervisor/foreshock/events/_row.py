"""From the raw cells of a row to an Event, or to the list of all that is wrong in it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from foreshock.errors import ConfigError, nearest
from foreshock.events._names import mode_of, slug
from foreshock.events._precursor import precursor
from foreshock.events._problem import Problem, wrong_number
from foreshock.events.schema import DEVIATIONS, NO_ACCIDENT, SYNTHETIC, TASKS, Event, EventPrecursor
from foreshock.taxonomy import Taxonomy

__all__ = ["Row"]


class Row:
    """Reads one row.

    Args:
        number: of the row, see Problem.
        raw: cells by column; strings from CSV, typed values from Parquet.
        taxonomy: resolves kinds and modes.
    """

    def __init__(self, number: int, raw: Mapping[str, Any], taxonomy: Taxonomy) -> None:
        self._number, self._raw, self._taxonomy = number, raw, taxonomy
        self.problems: list[Problem] = []

    def event(self) -> Event | None:
        """The event, or None if there is any problem."""
        outcome = self._outcome()
        observed_s = self._number_of("observed_s", above=True)
        outcome_s = self._outcome_s(outcome, observed_s)
        event = Event(
            self._needed("id"),
            self._task(),
            self._text("platform"),
            self._text("environment"),
            self._text("spatial_relation"),
            self._deviation(),
            self._precursors(outcome_s, observed_s),
            self._text("escalation"),
            outcome or NO_ACCIDENT,
            outcome_s,
            observed_s or 0.0,
            self._needed("coder"),
            self._text("group"),
            self._text("source"),
        )
        if event.id.startswith(f"{SYNTHETIC}-") and event.source != SYNTHETIC:
            self._say("source", event.source, f"the id {event.id!r} needs the source {SYNTHETIC!r}")
        return None if self.problems else event

    def _say(self, column: str, value: object, message: str) -> None:
        self.problems.append(Problem(self._number, column, "" if value is None else str(value), message))

    def _text(self, column: str) -> str:
        value = self._raw.get(column)
        if value is None or isinstance(value, str):
            return value or ""
        self._say(column, value, f"{value!r} is not text")
        return ""

    def _needed(self, column: str) -> str:
        value = self._text(column)
        if not value.strip() and not isinstance(self._raw.get(column), (int, float)):
            self._say(column, value, "missing")
        return value

    def _items(self, column: str) -> list[Any]:
        """The items of a list, or of a cell that is joined by semicolons."""
        raw = self._raw.get(column)
        if raw is None:
            return []
        if isinstance(raw, str):
            return [item for item in raw.split(";") if item.strip()]
        if isinstance(raw, list):
            return raw
        self._say(column, raw, f"{raw!r} is not a list")
        return []

    def _task(self) -> str:
        given = self._needed("task")
        task = slug(given)
        if given.strip() and task not in TASKS:
            self._say("task", given, f"{given!r} is not a task category{nearest(task, TASKS)}")
        return task

    def _deviation(self) -> tuple[str, ...]:
        names: list[str] = []
        for item in self._items("deviation"):
            name = slug(str(item))
            if name not in DEVIATIONS:
                self._say("deviation", item, f"{item!r} is not a deviation{nearest(name, DEVIATIONS)}")
            elif name in names:
                self._say("deviation", item, f"{name!r} stands there twice")
            else:
                names.append(name)
        return tuple(names)

    def _outcome(self) -> str | None:
        """Code or ``none``; None if it is missing or wrong."""
        given = self._needed("outcome").strip()
        if slug(given) == NO_ACCIDENT:
            return NO_ACCIDENT
        try:
            return mode_of(given, self._taxonomy) if given else None
        except ConfigError:
            known = (*self._taxonomy.codes, NO_ACCIDENT)
            hint = nearest(given, known) or f"; known: {', '.join(known)}"
            self._say("outcome", given, f"unknown accident mode {given!r}{hint}")
            return None

    def _number_of(self, column: str, *, above: bool = False, missing: str = "missing") -> float | None:
        """A number of at least 0 (above: above 0); None if it is wrong, or not there, which missing makes a problem."""
        raw = self._raw.get(column)
        if raw is None or (isinstance(raw, str) and not raw.strip()):
            if missing:
                self._say(column, "", missing)
            return None
        if wrong := wrong_number(raw, above=above):
            self._say(column, raw, wrong)
            return None
        return float(raw)

    def _outcome_s(self, outcome: str | None, observed_s: float | None) -> float | None:
        accident = outcome is not None and outcome != NO_ACCIDENT
        value = self._number_of("outcome_s", missing=f"missing; when did {outcome} happen?" if accident else "")
        if value is not None and outcome == NO_ACCIDENT:
            self._say("outcome_s", value, f"{value:g} s, but the outcome is {NO_ACCIDENT!r}")
        elif value is not None and observed_s is not None and value > observed_s:
            self._say("outcome_s", value, f"{value:g} s is after the end of observation, {observed_s:g} s")
        return value

    def _precursors(self, outcome_s: float | None, observed_s: float | None) -> tuple[EventPrecursor, ...]:
        def say(value: object, message: str) -> None:
            self._say("precursors", value, message)

        found = [
            precursor(f"precursor {k}", item, self._taxonomy, outcome_s, observed_s, say)
            for k, item in enumerate(self._items("precursors"), 1)
        ]
        return tuple(p for p in found if p is not None)
