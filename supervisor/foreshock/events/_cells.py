"""Precursors in one cell of a CSV file: ``kind@onset-end*severity[subject]``, joined by semicolons; times in s.

End, severity and subject may be left out: ``foot-micro-slip@0.00-1.20*0.8[left-foot];torso-angular-spike@0.48``.
"""

from __future__ import annotations

import re
from collections.abc import Iterable

from foreshock.errors import BadInputError
from foreshock.events.schema import EventPrecursor

__all__ = ["SYNTAX", "UNSAYABLE", "parse", "text"]

SYNTAX = "kind@onset-end*severity[subject], where -end, *severity and [subject] may be left out"
UNSAYABLE = re.compile(r"[\[\];\r\n]")
"""What a subject must not hold."""

_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_PRECURSOR = re.compile(
    rf"(?P<kind>[^@\[\]*;]+)@(?P<onset_s>{_NUMBER})(?:-(?P<end_s>{_NUMBER}))?"
    rf"(?:\*(?P<severity>{_NUMBER}))?(?:\[(?P<subject>[^\[\];]*)\])?"
)


def parse(token: str) -> dict[str, object] | None:
    """Fields of one precursor as they stand there, or None if it is not of the form."""
    found = _PRECURSOR.fullmatch(token.strip())
    if found is None:
        return None
    given = {name: value for name, value in found.groupdict().items() if value is not None}
    return {n: v.strip() if n == "kind" else v if n == "subject" else float(v) for n, v in given.items()}


def text(precursors: Iterable[EventPrecursor], place: str) -> str:
    """The cell; numbers in their shortest form that reads back exactly.

    Raises:
        BadInputError: a kind or subject holds a character of the form; names place.
    """
    tokens = []
    for p in precursors:
        token = f"{p.kind}@{float(p.onset_s)!r}"
        token += "" if p.end_s is None else f"-{float(p.end_s)!r}"
        token += "" if p.severity == 1.0 else f"*{float(p.severity)!r}"
        token += f"[{p.subject}]" if p.subject else ""
        if UNSAYABLE.search(p.subject) or parse(token) is None:
            raise BadInputError(f"{place}: precursors", f"{token!r} is not {SYNTAX}")
        tokens.append(token)
    return ";".join(tokens)
