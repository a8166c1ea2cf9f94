"""One parameter at a time, as in the paper's discussion: a and c by 20%, b by 1; and its three qualitative claims."""

from __future__ import annotations

from collections.abc import Sequence

import msgspec

from foreshock.sensitivity.cascade import PAPER, Outcome, outcome
from foreshock.taxonomy import Taxonomy

__all__ = ["Perturbed", "one_at_a_time"]

LOW, GATE = 0.3, 0.3
"""P of an isolated precursor that still counts as low; the paper's gate."""

STEPS = {
    "a": (1.28, 1.92),
    "b": (1.0, 3.0),
    "c": (0.96, 1.44),
    "window_s": (1.2, 1.8),
    "kappa": (1.0,),
    "r": (0.5,),
}
"""The paper's steps of a, b and c; 20% of the window; and what the extension adds to a model that had none of it."""


class Perturbed(msgspec.Struct, frozen=True):
    """One perturbation: what changed, what came of it, and whether the paper's claims hold.

    Attributes:
        name: of the parameter; ``""`` for the paper's values.
        value: of it.
        outcome: of the cascade.
        low_when_isolated: P of one precursor stays low.
        sharp: the second or third precursor is the steepest step, and the full cascade opens the gate.
        recovers: P is back at 0 when the window has passed.
    """

    name: str
    value: float
    outcome: Outcome
    low_when_isolated: bool
    sharp: bool
    recovers: bool


def one_at_a_time(kinds: Sequence[str], taxonomy: Taxonomy) -> list[Perturbed]:
    """The paper's values, then every perturbation."""
    points = [("", 0.0, PAPER)]
    points += [(n, v, msgspec.structs.replace(PAPER, **{n: v})) for n, values in STEPS.items() for v in values]
    return [_judged(name, value, outcome(point, kinds, taxonomy)) for name, value, point in points]


def _judged(name: str, value: float, o: Outcome) -> Perturbed:
    steps = (o.p_first, o.p_second - o.p_first, o.p_third - o.p_second)
    return Perturbed(
        name, value, o, o.p_first < LOW, max(steps[1:]) > steps[0] and 1.0 - o.p_third < GATE, o.left == 0.0
    )
