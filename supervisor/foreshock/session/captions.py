"""What is written above the picture of a run, and at which times stills show it best."""

from __future__ import annotations

import math
from collections.abc import Sequence

from foreshock.clock import seconds
from foreshock.records import ProtectionLevel
from foreshock.session.run import Run
from foreshock.twin import Caption

__all__ = ["captions", "moments"]

_BEFORE_S, _AFTER_S = 0.3, 0.6
"""Stills begin so long before the first sign of any run, and end so long after the last event."""


def captions(run: Run) -> tuple[Caption, ...]:
    """Level, trust and actions of a run by time, as the scenario's mode has them, and what has happened.

    Args:
        run: with its series (detail). In the shadow arm actions are left out: nobody takes them.
    """
    # an accident is told rather than what follows it
    series, happened = run.series, sorted(run.events, key=lambda e: (bool(e.mode), e.stamp_ns))
    actions = {k.removeprefix("action:"): v for k, v in series.items() if k.startswith("action:")}
    found: list[Caption] = []
    for k, t in enumerate(series.get("t_s", ())):
        text, trust = "", None
        if "level" in series:
            level = ProtectionLevel(int(series["level"][k])).name.lower().replace("_", " ")
            acts = [name for name, values in sorted(actions.items()) if values[k] > 0.0 and name != "speed-scale"]
            text = ": ".join((level, ", ".join(acts))) if acts and run.supervisor == "on" else level
            trust = round(series["trust"][k], 2)
        alarm = next((e.id for e in reversed(happened) if seconds(e.stamp_ns) <= t + 1e-9), "")
        if not found or (found[-1].text, found[-1].trust, found[-1].alarm) != (text, trust, alarm):
            found.append(Caption(t if found else 0.0, text, trust, alarm))
    return tuple(found)


def moments(runs: Sequence[Run], count: int = 5) -> tuple[float, ...]:
    """Times for stills: evenly, from just before the first sign of any run to after the last event, or to the end."""
    end = max(run.end_s for run in runs)
    signs = [t for run in runs for t in run.first_s.values()]
    events = [seconds(e.stamp_ns) for run in runs for e in run.events]
    first = max(min([*signs, *events], default=math.inf) - _BEFORE_S, 0.0)
    first = first if first < end else 0.0
    last = min(max(events, default=math.inf) + _AFTER_S, end)
    return tuple(first + (last - first) * k / (count - 1) for k in range(count))
