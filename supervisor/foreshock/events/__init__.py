"""The event database: the paper's coding template as a validated table, and what it says about precursors."""

from __future__ import annotations

from foreshock.events.schema import DEVIATIONS, NO_ACCIDENT, SYNTHETIC, TASKS, Event, EventPrecursor
from foreshock.events.table import EventTable, Problem, read_events, write_events

__all__ = [
    "DEVIATIONS",
    "NO_ACCIDENT",
    "SYNTHETIC",
    "TASKS",
    "Event",
    "EventPrecursor",
    "EventTable",
    "Problem",
    "read_events",
    "write_events",
]
