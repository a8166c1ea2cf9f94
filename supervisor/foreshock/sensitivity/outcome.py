"""What a timeline does to P and to the gate."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from itertools import pairwise

import msgspec

from foreshock.risk import RiskModel
from foreshock.sensitivity.timeline import Timeline
from foreshock.sensitivity.trajectory import Moment

__all__ = ["Outcome", "outcome"]


class Outcome(msgspec.Struct, frozen=True):
    """One timeline under one set of parameters.

    P is the model's own; in the correlated model it has the bound ``upper``. Trust is 1 - upper here, which is what
    actions are taken on by default, and the conceptual trust of Eq. 2: what recovers is T, not yet control_trust.

    Attributes:
        onset_s: of each precursor.
        p_at: P at each onset.
        peak: largest P.
        opened: whether trust ever fell below the gate.
        gate_s: when, from the first onset; censored at the end of the last condition where it never did, since nothing
            raises P after that.
        opened_on_p: the same if 1 - P is trusted instead of 1 - upper.
        gate_on_p_s: likewise.
        recovery_s: from the end of the last condition until trust is at or above the gate for good; 0 if it is before.
        falls: whether P only ever falls after the end of the last condition, and is 0 in the end.
        steps: (time in s, P, upper) from each moment on, for plots.
    """

    onset_s: tuple[float, ...]
    p_at: tuple[float, ...]
    peak: float
    opened: bool
    gate_s: float
    opened_on_p: bool
    gate_on_p_s: float
    recovery_s: float
    falls: bool
    steps: tuple[tuple[float, float, float], ...]


def outcome(timeline: Timeline, moments: Sequence[Moment], model: RiskModel, gate: float) -> Outcome:
    """Judge a trajectory.

    Args:
        timeline: that it is of.
        moments: the trajectory.
        model: precursors to risk.
        gate: of trust, 0..1.
    """
    judged = [model.estimate(m.precursors) for m in moments]
    p, upper = [r.probability for r in judged], [r.upper for r in judged]
    times = [m.at_ns for m in moments]
    start, end = times[0], round(timeline.end_s * 1e9)
    below = [not (1.0 - u >= gate) for u in upper]
    below_p = [not (1.0 - x >= gate) for x in p]
    last = max((k for k, b in enumerate(below) if b), default=-1)
    closes = times[last + 1] if 0 <= last < len(times) - 1 else end
    after = p[bisect_right(times, end) - 1 :]
    first, first_on_p = _first(times, below, end), _first(times, below_p, end)
    return Outcome(
        tuple(t - start / 1e9 for t in timeline.onsets_s),
        tuple(p[bisect_right(times, round(t * 1e9)) - 1] for t in timeline.onsets_s),
        max(p),
        any(below),
        (first - start) / 1e9,
        any(below_p),
        (first_on_p - start) / 1e9,
        max(0, closes - end) / 1e9,
        all(b <= a for a, b in pairwise(after)) and after[-1] == 0.0,
        tuple(zip([(t - start) / 1e9 for t in times], p, upper, strict=True)),
    )


def _first(times: Sequence[int], below: Sequence[bool], end: int) -> int:
    return next((t for t, b in zip(times, below, strict=True) if b), end)
