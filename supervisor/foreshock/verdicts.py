"""Verdicts: what clocks and processes decided of a detector, told in its health so that a replay needs neither."""

from __future__ import annotations

import re

__all__ = ["GAVE_UP", "VERDICT", "VerdictError", "verdict_in"]

VERDICT = "verdict: "
"""So begins a reason of health that does not follow from what came in."""
GAVE_UP = "gave up: "
"""So begins a verdict that ends a detector until reset."""

_VERDICT = re.compile(rf"(?:gave up after \d+ failures; the last: )?{VERDICT}(.*)", re.DOTALL)


class VerdictError(Exception):
    """Raised by a detector's stand-in for what does not follow from the samples: a hang, a death, a lost process."""


def verdict_in(reason: str) -> str | None:
    """The verdict that a reason of health records; None if it follows from what came in."""
    found = _VERDICT.fullmatch(reason)
    return None if found is None else found[1]
