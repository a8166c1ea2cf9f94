"""What each run of a campaign counts as, beside the run of the reference arm that shares its seed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

from foreshock.campaign.ledger import Row
from foreshock.campaign.plan import Plan
from foreshock.campaign.spec import ArmEntry
from foreshock.records import ProtectionLevel

__all__ = ["Outcomes", "Seat", "acted_s", "seat_of"]

Seat: TypeAlias = tuple[str, int, int, str]
"""What the arms share: scenario, point, replicate and fault."""


def seat_of(row: Row) -> Seat:
    """Where a run sits."""
    return row.scenario, row.point, row.replicate, row.fault


def acted_s(row: Row, arm: ArmEntry) -> float | None:
    """When a run intervened: at the protective level, or by its first action where an arm acts by action."""
    if arm.kind == "none":
        return None
    if arm.scripted or arm.acts_by == "action":
        return row.acted_s
    if row.protective_s is None and row.level is not None and row.level >= ProtectionLevel.PROTECTIVE:
        return row.acted_s  # the minimal risk condition without the mode's own gate
    return row.protective_s


class Outcomes:
    """Runs of a campaign, each with its partner: the reference arm's run on the same seat.

    Args:
        plan: of the campaign.
        rows: what was run of it.

    Attributes:
        reference: the arm that the others are paired with; None if there is none.
        harmless: scenarios in which no accident is expected.
    """

    def __init__(self, plan: Plan, rows: Sequence[Row]) -> None:
        self._arms = {a.id: a for a in plan.spec.arms}
        self.reference = plan.spec.reference_arm
        self.harmless = frozenset(id_ for id_, s in plan.scenarios.items() if s.expect == "none")
        id_ = "" if self.reference is None else self.reference.id
        self._partners = {seat_of(r): r for r in rows if r.arm == id_ and r.ok}

    def partner(self, row: Row) -> Row | None:
        """The reference's run on the same seat; None if there is none that gave a result."""
        return self._partners.get(seat_of(row))

    def acted_s(self, row: Row) -> float | None:
        """When it intervened."""
        return acted_s(row, self._arms[row.arm])

    def calm(self, row: Row) -> bool:
        """Whether nothing happened in the reference's run, so that an intervention here is a false one."""
        partner = self.partner(row)
        return row.ok and partner is not None and partner.event_s is None

    def false(self, row: Row) -> bool | None:
        """Whether it is a false intervention; None where the reference came to harm, or nobody knows.

        An arm whose interventions are those of another may have had none to take: that says nothing of it.
        """
        at_s = self.acted_s(row)
        if not self.calm(row) or (self._arms[row.arm].scripted and at_s is None):
            return None
        return at_s is not None and at_s <= (row.end_s or 0.0)

    def lead_s(self, row: Row) -> float | None:
        """Time from the intervention to the reference's accident; negative is too late."""
        partner, at_s = self.partner(row), self.acted_s(row)
        return None if partner is None or partner.accident_s is None or at_s is None else partner.accident_s - at_s

    def safe_after_s(self, row: Row) -> float | None:
        """Time from the intervention to the safe state; infinite if that was not reached.

        None where nobody intervened or judged, or the accident happened.
        """
        at_s = self.acted_s(row)
        if at_s is None or row.accident or self._arms[row.arm].kind != "on" or row.reduced_s is None:
            return None
        return float("inf") if row.safe_s is None else max(row.safe_s - at_s, 0.0)

    def reduced(self, row: Row) -> float | None:
        """Share of a calm run's time under an action, of arms that act.

        None where the reference came to harm, it was not recorded, or there was nothing to take from another arm.
        """
        arm = self._arms[row.arm]
        if not arm.acts or row.reduced_s is None or not row.end_s or not self.calm(row):
            return None
        if arm.scripted and row.acted_s is None:
            return None
        return row.reduced_s / row.end_s
