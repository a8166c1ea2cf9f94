"""One parameter at a time, as in the paper's discussion (section 4), and whether its three claims hold each time."""

from __future__ import annotations

from collections.abc import Mapping

import msgspec

from foreshock.sensitivity.outcome import Outcome
from foreshock.sensitivity.study import Study

__all__ = ["LOW", "Claims", "Perturbed", "one_at_a_time"]

LOW = 0.3
"""P of an isolated precursor that still counts as low. The paper gives no figure; its own value is 0.12."""


class Claims(msgspec.Struct, frozen=True):
    """The paper's claims, made into tests.

    Attributes:
        low: "low risk under isolated precursors": P stays below LOW for as long as one precursor lasts.
        sharp: "sharp escalation under two to three co-occurring precursors": the second or the third raises P more than
            the first did, and three give more than twice the P of one.
        opens: what the escalation is for: trust is below the gate at the third precursor, if not before.
        recovers: "recovery with decay": once the last condition has ended P only falls, to 0, and trust is back above
            the gate within one window.
    """

    low: bool
    sharp: bool
    opens: bool
    recovers: bool


class Perturbed(msgspec.Struct, frozen=True):
    """One perturbation.

    Attributes:
        factor: id of the parameter; ``""`` where nothing is perturbed.
        value: of it.
        answers: every output, by id.
        claims: which of the paper's hold.
    """

    factor: str
    value: float
    answers: dict[str, float]
    claims: Claims


def one_at_a_time(study: Study) -> list[Perturbed]:
    """The nominal values, then every step of every factor."""
    points = [("", 0.0)] + [(f.id, step) for f in study.factors for step in f.steps]
    found = []
    for factor, value in points:
        values = {factor: value} if factor else {}
        claims = judged(study.outcomes(values), study.nominal["window"] if factor != "window" else value)
        found.append(Perturbed(factor, value, study.answers(values), claims))
    return found


def judged(o: Mapping[str, Outcome], window_s: float) -> Claims:
    """The claims of one set of parameters.

    Args:
        o: outcomes of all timelines.
        window_s: length of the window.
    """
    first, second, third = o["cascade"].p_at
    opens = o["cascade"].opened and o["cascade"].gate_s <= o["cascade"].onset_s[-1]
    back = o["decay"].falls and o["decay"].recovery_s <= window_s
    return Claims(
        o["isolated"].peak < LOW, max(second - first, third - second) > first and third > 2.0 * first, opens, back
    )
