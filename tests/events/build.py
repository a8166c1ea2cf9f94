"""Events for tests, in short."""

from __future__ import annotations

from foreshock.events import Event, EventPrecursor


def event(id_: str, outcome: str = "none", *precursors: EventPrecursor | tuple, coder: str = "anna", **more) -> Event:
    """An event of 10 s; an accident happens at 8 s. Precursors may be tuples of EventPrecursor's arguments."""
    held = tuple(p if isinstance(p, EventPrecursor) else EventPrecursor(*p) for p in precursors)
    at = None if outcome == "none" else 8.0
    fields = {"task": "handover", "deviation": (), "outcome_s": at, "observed_s": 10.0} | more
    return Event(
        id=id_,
        platform="Digit",
        environment="laboratory",
        spatial_relation="within reach",
        escalation="",
        precursors=held,
        outcome=outcome,
        coder=coder,
        **fields,
    )
