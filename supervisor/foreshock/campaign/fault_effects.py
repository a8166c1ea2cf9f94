"""What each fault does to an arm: the same runs with it and without."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Literal, TypeAlias

import msgspec

from foreshock.campaign.ledger import Row
from foreshock.campaign.outcomes import Outcomes, seat_of
from foreshock.campaign.paired import holm, mcnemar
from foreshock.campaign.plan import Plan
from foreshock.records import ProtectionLevel
from foreshock.session.rates import Rate, wilson

__all__ = ["LEVEL", "FaultEffect", "fault_effects"]

LEVEL = 0.05
"""Chance that any fault of a campaign is said to do something where none does anything."""
Effect: TypeAlias = Literal["more accidents", "more false interventions", "none shown"]


class FaultEffect(msgspec.Struct, frozen=True):
    """One fault in one arm that acts, over all scenarios that have both.

    Attributes:
        fault: id of what is injected.
        arm: id.
        accidents: with the fault, in scenarios in which the accident can be expected.
        accidents_without: on the same seeds without it.
        accidents_p: that the fault does not change their rate: exact McNemar test, two-sided, adjusted for all of the
            campaign's faults (Holm).
        where: scenarios and how many of their runs had the accident with the fault, of those with any.
        false: with the fault, runs that intervened although the reference's run came to no harm.
        false_without: on the same seeds without it.
        false_p: as accidents_p.
        minimal_risk: runs with the fault that ended at the minimal risk condition: somebody noticed, and gave up.
        failures: runs with the fault without a result.
    """

    fault: str
    arm: str
    accidents: Rate
    accidents_without: Rate
    accidents_p: float
    where: dict[str, Rate]
    false: Rate
    false_without: Rate
    false_p: float
    minimal_risk: Rate
    failures: int

    @property
    def effects(self) -> tuple[Effect, ...]:
        """What is significantly worse with the fault."""
        found: list[Effect] = []
        if self.accidents_p < LEVEL and self.accidents.k > self.accidents_without.k:
            found.append("more accidents")
        if self.false_p < LEVEL and self.false.k > self.false_without.k:
            found.append("more false interventions")
        return tuple(found) or ("none shown",)


def fault_effects(plan: Plan, rows: Sequence[Row]) -> list[FaultEffect]:
    """Every fault of the campaign under every arm that acts.

    Args:
        plan: of the campaign.
        rows: what was run of it.
    """
    outcomes = Outcomes(plan, rows)
    acting = [a.id for a in plan.spec.arms if a.kind == "on"]
    by: dict[tuple[str, str], list[Row]] = {}
    for row in rows:
        by.setdefault((row.fault, row.arm), []).append(row)
    found = []
    for entry in plan.spec.faults:
        for arm in acting:
            mine = by.get((entry.id, arm), [])
            if not mine:
                continue
            without = {seat_of(r)[:3]: r for r in by.get(("", arm), []) if r.ok}
            pairs = [(without[s], r) for r in mine if r.ok and (s := seat_of(r)[:3]) in without]
            found.append(_effect(entry.id, arm, pairs, outcomes, sum(not r.ok for r in mine)))
    adjusted = holm([p for e in found for p in (e.accidents_p, e.false_p)])
    return [
        msgspec.structs.replace(e, accidents_p=adjusted[2 * k], false_p=adjusted[2 * k + 1])
        for k, e in enumerate(found)
    ]


def _effect(fault: str, arm: str, pairs: Sequence[tuple[Row, Row]], outcomes: Outcomes, failures: int) -> FaultEffect:
    hurt = [(bool(a.accident), bool(b.accident)) for a, b in pairs if b.scenario not in outcomes.harmless]
    wrong = [(x, y) for a, b in pairs if (x := outcomes.false(a)) is not None and (y := outcomes.false(b)) is not None]
    ran = Counter(b.scenario for _, b in pairs)
    fell = Counter(b.scenario for _, b in pairs if b.accident)
    ended = sum((b.level or 0) >= ProtectionLevel.MINIMAL_RISK for _, b in pairs)
    return FaultEffect(
        fault,
        arm,
        *_held_against(hurt),
        {scenario: wilson(k, ran[scenario]) for scenario, k in fell.items()},
        *_held_against(wrong),
        wilson(ended, len(pairs)),
        failures,
    )


def _held_against(pairs: Sequence[tuple[bool, bool]]) -> tuple[Rate, Rate, float]:
    """Rate with, rate without, and McNemar's p, of pairs of without and with."""
    with_it, without = (wilson(sum(p[k] for p in pairs), len(pairs)) for k in (1, 0))
    p = mcnemar(sum(a and not b for a, b in pairs), sum(b and not a for a, b in pairs))
    return with_it, without, p
