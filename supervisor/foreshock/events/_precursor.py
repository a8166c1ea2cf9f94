"""From a token of the CSV syntax, or a struct of Parquet, to an EventPrecursor, or to all that is wrong with it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from foreshock.errors import ConfigError
from foreshock.events import _cells
from foreshock.events._names import kind_of
from foreshock.events._problem import wrong_number
from foreshock.events.schema import EventPrecursor
from foreshock.taxonomy import Taxonomy

__all__ = ["precursor"]

Say = Callable[[object, str], None]


def precursor(
    place: str, raw: object, taxonomy: Taxonomy, outcome_s: float | None, observed_s: float | None, say: Say
) -> EventPrecursor | None:
    """The precursor, or None.

    Args:
        place: which one it is, for the messages.
        raw: a token, or a mapping with the fields of EventPrecursor.
        taxonomy: resolves the kind.
        outcome_s: an onset may not be later (section 2.1: precursors precede the hazard); None if unknown.
        observed_s: neither onset nor end may be later; None if unknown.
        say: told value and message of each problem.
    """
    fields = _cells.parse(raw) if isinstance(raw, str) else raw
    if not isinstance(fields, Mapping):
        say(raw, f"{place}: {str(raw).strip()!r} is not {_cells.SYNTAX}")
        return None
    name = str(fields.get("kind") or "")
    kind = ""
    try:
        kind = kind_of(name, taxonomy)
    except ConfigError as e:
        say(name, f"{place}: unknown kind {name!r}{e.hint}")
    problems: list[tuple[object, str]] = []
    found = _read(kind, fields, problems)
    if found is not None:
        problems = _order(found, outcome_s, observed_s)
    for value, message in problems:
        say(value, f"{place} ({name}): {message}")
    return found if kind and not problems else None


def _read(kind: str, raw: Mapping[str, Any], problems: list[tuple[object, str]]) -> EventPrecursor | None:
    onset, end, severity = raw.get("onset_s"), raw.get("end_s"), raw.get("severity")
    severity = 1.0 if severity is None else severity
    subject = str(raw.get("subject") or "")
    for label, value in (("onset", onset), ("end", end), ("severity", severity)):
        wrong = "" if label == "end" and value is None else wrong_number(value)
        if wrong:
            problems.append((value, f"{label} {wrong}"))
    if _cells.UNSAYABLE.search(subject):
        problems.append((subject, f"subject {subject!r} holds one of [ ] ; or a line break"))
    if problems or onset is None:
        return None
    return EventPrecursor(kind, float(onset), None if end is None else float(end), float(severity), subject)


def _order(p: EventPrecursor, outcome_s: float | None, observed_s: float | None) -> list[tuple[object, str]]:
    problems: list[tuple[object, str]] = []
    if p.severity > 1.0:
        problems.append((p.severity, f"severity {p.severity:g} is not within 0..1"))
    if p.end_s is not None and p.end_s < p.onset_s:
        problems.append((p.end_s, f"end {p.end_s:g} s is before its onset, {p.onset_s:g} s"))
    if outcome_s is not None and p.onset_s > outcome_s:
        problems.append((p.onset_s, f"onset {p.onset_s:g} s is after the outcome, {outcome_s:g} s"))
    for label, value in (("onset", p.onset_s), ("end", p.end_s)):
        if value is not None and observed_s is not None and value > observed_s:
            problems.append((value, f"{label} {value:g} s is after the end of observation, {observed_s:g} s"))
    return problems
