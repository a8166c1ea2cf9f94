"""What a cascade of precursors does to P and when it opens the gate, as a function of every parameter of the model."""

from __future__ import annotations

from collections.abc import Sequence

import msgspec

from foreshock.evidence import Evidence, Window, step
from foreshock.records import Indication
from foreshock.risk import CorrelatedRisk, Link, Pair, Provenance, RiskParameters
from foreshock.taxonomy import Taxonomy

__all__ = ["PAPER", "RANGES", "Outcome", "Point", "outcome"]

TIMES_S = (0.0, 0.48, 1.12)
"""Onsets of the case study's cascade (section 3.3)."""
LASTS_S = 0.3
"""How long each precursor is present; what follows is the window's memory."""
END_S, TICK_S = 6.0, 0.02


class Point(msgspec.Struct, frozen=True):
    """One value of every parameter.

    Attributes:
        a: gain.
        b: half-way number of kinds.
        c: saturation of recurrence.
        window_s: length of the window.
        kappa: weight of the cascade lift; 0 is the paper.
        r: correlation of consecutive kinds; 0 is the paper.
        presence: strength of a precursor of severity 0.
        severity: of every precursor.
        gate: of trust.
    """

    a: float = 1.6
    b: float = 2.0
    c: float = 1.2
    window_s: float = 1.5
    kappa: float = 0.0
    r: float = 0.0
    presence: float = 1.0
    severity: float = 0.5
    gate: float = 0.3


PAPER = Point()
RANGES = {
    "a": (0.8, 2.4),
    "b": (1.0, 3.0),
    "c": (0.6, 1.8),
    "window_s": (0.5, 3.0),
    "kappa": (0.0, 1.5),
    "r": (0.0, 0.9),
    "presence": (0.0, 1.0),
    "severity": (0.0, 1.0),
    "gate": (0.2, 0.6),
}
"""Uniform, for the global analysis: half to one and a half of the paper's a and c, b as the paper perturbs it, the
window from the shortest overlap that the paper reports to twice the longest."""


class Outcome(msgspec.Struct, frozen=True):
    """What came of it.

    Attributes:
        p_first: P at the first precursor.
        p_second: P at the second.
        p_third: P at the third.
        gate_s: when trust fell below the gate, from the first precursor; END_S if it never did.
        opened: whether it did.
        left: P at the end, END_S after the first precursor.
    """

    p_first: float
    p_second: float
    p_third: float
    gate_s: float
    opened: bool
    left: float


def outcome(point: Point, kinds: Sequence[str], taxonomy: Taxonomy) -> Outcome:
    """Run a cascade of three kinds through the evidence window and the risk model, tick by tick.

    P is the model's own P*, not its upper bound, which does not depend on r.

    Args:
        point: the parameters.
        kinds: three, in order.
        taxonomy: that they belong to.
    """
    pairs = [(kinds[k], kinds[k + 1]) for k in range(len(kinds) - 1)]
    model = CorrelatedRisk(
        RiskParameters(
            name="point",
            provenance=Provenance("sensitivity"),
            a=point.a,
            b=point.b,
            c=point.c,
            kappa=point.kappa,
            presence=point.presence,
            # of an autoregressive chain, which is positive semidefinite for every r
            correlation=tuple(
                Pair((kinds[i], kinds[j]), r, r, r)
                for i in range(len(kinds))
                for j in range(i)
                if (r := point.r ** (i - j)) > 0.0
            ),
            cascade=tuple(Link(first, then, 1.0, 1.0, 1.0) for first, then in pairs),
        ),
        taxonomy,
    )
    window, state = Window(length_s=point.window_s), Evidence()
    at = dict(zip(kinds, TIMES_S, strict=True))
    p_at, gate_s, p = dict.fromkeys(kinds, 0.0), END_S, 0.0
    for tick in range(round(END_S / TICK_S) + 1):
        t = tick * TICK_S
        now = round(t * 1e9)
        said = {
            (kind, "", "d"): Indication(
                kind, "", now, at[kind] - 1e-9 <= t < at[kind] + LASTS_S, 1.0, 1.0, "1", point.severity
            )
            for kind in kinds
        }
        state, precursors = step(state, window, now, said)
        p = model.estimate(precursors).probability
        for kind in kinds:
            if abs(t - at[kind]) < TICK_S / 2.0:
                p_at[kind] = p
        if gate_s == END_S and 1.0 - p < point.gate:
            gate_s = t
    first, second, third = (p_at[kind] for kind in kinds)
    return Outcome(first, second, third, gate_s, gate_s < END_S, p)
