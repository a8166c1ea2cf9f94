"""What is perturbed: every parameter of the model, by how much one at a time, and over which range globally."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import msgspec

from foreshock.risk import RiskParameters

__all__ = ["Factor", "factors_of", "mean_lift", "mean_r"]


class Factor(msgspec.Struct, frozen=True):
    """One parameter.

    Attributes:
        id: name.
        symbol: for plots.
        title: what it is.
        nominal: its value in the parameter set.
        steps: values that it takes one at a time.
        low: lower end of its range, uniform, in the global analysis.
        high: upper end.
        why: where steps and range come from.
    """

    id: str
    symbol: str
    title: str
    nominal: float
    steps: tuple[float, ...]
    low: float
    high: float
    why: str


HALF = "half to one and a half"
OURS = "±20%, as for a and c"


def factors_of(p: RiskParameters, kinds: Sequence[str], gate: float, severity: float, correlated: bool) -> list[Factor]:
    """The factors of a parameter set; those of the extension too if the model is the correlated one.

    The paper perturbs a and c by 20% and b by 1 (section 4); the other steps are ours. The global ranges are wider:
    half to one and a half of a and c, b ± 1.5, and a third of the window (of 1.5 s that is 0.5 s, the shortest overlap
    of section 3.2.2) to twice it.

    Args:
        p: what is perturbed.
        kinds: of the cascade, in order.
        gate: of trust.
        severity: of the precursors.
        correlated: the model.
    """
    w, around = p.window_s, _around
    found = [
        Factor("a", "a", "gain", p.a, around(p.a), 0.5 * p.a, 1.5 * p.a, f"±20% (paper); {HALF}"),
        Factor("b", "b", "half-way number", p.b, (p.b - 1.0, p.b + 1.0), p.b - 1.5, p.b + 1.5, "±1 (paper); ±1.5"),
        Factor("c", "c", "saturation", p.c, around(p.c), 0.5 * p.c, 1.5 * p.c, f"±20% (paper); {HALF}"),
        Factor("window", "window (s)", "its length", w, around(w), w / 3.0, 2.0 * w, f"{OURS}; a third to twice"),
        Factor("recurrence", "recurrence", "period, in windows", 1.0, around(1.0), 0.5, 2.0, f"{OURS}; half to twice"),
        Factor("gate", "gate", "of trust", gate, around(gate), 0.1, 0.6, f"{OURS}; up to the caution gate"),
    ]
    if correlated:
        r, j, k, p0 = mean_r(p, kinds), mean_lift(p, kinds), p.kappa, p.presence
        found += [
            Factor("kappa", "κ", "weight of the lift", k, around(k), 0.0, 2.0 * k or 1.0, f"{OURS}; 0 to twice"),
            Factor("lift", "J", "lift, mean of pairs", j, around(j), 0.0, 2.0 * j or 1.0, f"{OURS}; 0 to twice"),
            Factor("r", "r", "correlation, mean of pairs", r, _within(around(r)), 0.0, 0.9, f"{OURS}; 0 to 0.9"),
            Factor("presence", "p₀", "strength at severity 0", p0, _within(around(p0)), 0.0, 1.0, f"{OURS}; all"),
            Factor("severity", "severity", "of every precursor", severity, around(severity), 0.0, 1.0, f"{OURS}; all"),
        ]
    return found


def _around(value: float) -> tuple[float, ...]:
    """20% below and above; from 0 there is only up, by 0.2."""
    return (round(0.8 * value, 12), round(1.2 * value, 12)) if value > 0.0 else (0.2,)


def _within(steps: tuple[float, ...]) -> tuple[float, ...]:
    return tuple(s for s in steps if 0.0 <= s <= 1.0)


def mean_r(p: RiskParameters, kinds: Sequence[str]) -> float:
    """Mean r of all pairs of these kinds."""
    named = {frozenset(pair.kinds): pair.r for pair in p.correlation}
    pairs = [frozenset((a, b)) for k, a in enumerate(kinds) for b in kinds[:k]]
    return sum(named.get(pair, 0.0) for pair in pairs) / len(pairs) if pairs else 0.0


def mean_lift(p: RiskParameters, kinds: Sequence[str]) -> float:
    """Mean J of the consecutive pairs of these kinds."""
    named = {(link.first, link.then): link.lift for link in p.cascade}
    pairs = list(pairwise(kinds))
    return sum(named.get(pair, 0.0) for pair in pairs) / len(pairs) if pairs else 0.0
