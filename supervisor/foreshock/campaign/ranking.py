"""Which arm wins where, and where Foreshock loses: arms that stand for Foreshock against those that do not."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Literal, TypeAlias

import msgspec

from foreshock.campaign.ledger import Row
from foreshock.campaign.outcomes import Outcomes, seat_of
from foreshock.campaign.paired import holm, mcnemar
from foreshock.campaign.plan import Plan
from foreshock.campaign.results import ArmResult, Scope, frequency, scopes_of
from foreshock.campaign.spec import ArmEntry

__all__ = ["LEVEL", "Duel", "Standing", "duels_of", "standings_of"]

LEVEL = 0.05
"""Chance that any duel of a campaign is called won or lost where the arms do not differ."""
Contest: TypeAlias = Literal["accidents", "false interventions", "reduced speed", "lead time"]


class Duel(msgspec.Struct, frozen=True):
    """One metric of an arm that stands for Foreshock against one that does not, on the same seeds.

    Attributes:
        scope: overall, or a mode.
        arm: stands for Foreshock.
        rival: does not.
        metric: what is compared.
        mine: mean over the pairs of the first: a share of runs, a share of time, or a time in s.
        theirs: of the second.
        n: pairs.
        p: two-sided, that they are the same, adjusted for all duels of the campaign (Holm).
    """

    scope: Scope
    arm: str
    rival: str
    metric: Contest
    mine: float
    theirs: float
    n: int
    p: float

    @property
    def verdict(self) -> Literal["wins", "loses", "open"]:
        """Who is significantly better, seen from Foreshock."""
        if not self.p < LEVEL or self.mine == self.theirs:
            return "open"
        more = self.mine > self.theirs
        return "wins" if more == (self.metric == "lead time") else "loses"


class Standing(msgspec.Struct, frozen=True):
    """A part of the campaign: the arms with the fewest accidents, false interventions and least time at reduced speed.

    The last two are of arms that decide and act; each entry is the arms that share first place, and the figure.
    """

    scope: Scope
    accidents: tuple[tuple[str, ...], str]
    false: tuple[tuple[str, ...], str]
    reduced: tuple[tuple[str, ...], str]


def duels_of(plan: Plan, rows: Sequence[Row]) -> list[Duel]:
    """All duels, overall and per mode.

    Accidents are compared in scenarios in which they can be expected; with rivals that act also false interventions and
    the share of time at reduced speed, in runs whose reference run came to no harm; with those that decide themselves
    lead times, where both acted. Pairs of events are tested by McNemar, of numbers by Wilcoxon's signed ranks.

    Args:
        plan: of the campaign.
        rows: what was run of it.
    """
    outcomes = Outcomes(plan, rows)
    found: list[Duel] = []
    for scope, belongs in scopes_of(rows):
        if scope.kind not in ("overall", "mode"):
            continue
        tables = {a.id: {seat_of(r): r for r in rows if r.arm == a.id and r.ok and belongs(r)} for a in plan.spec.arms}
        for arm in plan.spec.arms:
            for rival in plan.spec.arms:
                seats = [s for s in tables[arm.id] if s in tables[rival.id]]
                if arm.foreshock and not rival.foreshock and rival.kind != "shadow" and seats:
                    pairs = [(tables[arm.id][s], tables[rival.id][s]) for s in seats]
                    found += _duels(scope, arm, rival, pairs, outcomes)
    adjusted = holm([d.p for d in found])
    return [msgspec.structs.replace(d, p=p) for d, p in zip(found, adjusted, strict=True)]


def _duels(
    scope: Scope, arm: ArmEntry, rival: ArmEntry, pairs: Sequence[tuple[Row, Row]], outcomes: Outcomes
) -> list[Duel]:
    def accident(row: Row) -> float | None:
        return None if row.scenario in outcomes.harmless else float(bool(row.accident))

    def false(row: Row) -> float | None:
        value = outcomes.false(row)
        return None if value is None else float(value)

    contests: list[tuple[Contest, Callable[[Row], float | None]]] = [("accidents", accident)]
    if rival.acts:
        contests += [("false interventions", false), ("reduced speed", outcomes.reduced)]
    if rival.kind == "on":
        contests.append(("lead time", outcomes.lead_s))
    found = []
    for metric, of in contests:
        both = [(x, y) for a, b in pairs if (x := of(a)) is not None and (y := of(b)) is not None]
        if both:
            mine, theirs = (sum(side) / len(both) for side in zip(*both, strict=True))
            p = _p(both, events=metric in ("accidents", "false interventions"))
            found.append(Duel(scope, arm.id, rival.id, metric, mine, theirs, len(both), p))
    return found


def _p(pairs: Sequence[tuple[float, float]], *, events: bool) -> float:
    if events:
        return mcnemar(sum(x > y for x, y in pairs), sum(y > x for x, y in pairs))
    from scipy.stats import wilcoxon

    differences = [round(x - y, 9) for x, y in pairs]
    return float(wilcoxon(differences).pvalue) if any(differences) else 1.0


def standings_of(plan: Plan, results: Sequence[ArmResult]) -> list[Standing]:
    """Who is first, overall and per mode; arms that ran in only some of a part's scenarios are left out.

    Args:
        plan: of the campaign.
        results: of results_of.
    """
    kinds = {a.id: a.kind for a in plan.spec.arms}
    found = []
    for scope in dict.fromkeys(r.scope for r in results if r.scope.kind in ("overall", "mode")):
        mine = [r for r in results if r.scope == scope and kinds[r.arm] != "shadow"]
        most = max((r.scenarios for r in mine), default=0)
        mine = [r for r in mine if r.scenarios == most]
        acting = [r for r in mine if kinds[r.arm] == "on"]
        found.append(
            Standing(
                scope,
                _first(mine, lambda r: r.accidents.k / r.accidents.n if r.accidents.n else None, _accidents),
                _first(acting, lambda r: r.false.per_hour if r.false and r.false.hours else None, _false),
                _first(acting, lambda r: r.reduced.share if r.reduced else None, lambda r: str(r.reduced)),
            )
        )
    return found


def _accidents(result: ArmResult) -> str:
    return str(result.accidents)


def _false(result: ArmResult) -> str:
    return frequency(result.false)


def _first(
    results: Sequence[ArmResult], of: Callable[[ArmResult], float | None], told: Callable[[ArmResult], str]
) -> tuple[tuple[str, ...], str]:
    values = [(v, r) for r in results if (v := of(r)) is not None]
    if not values:
        return (), "–"
    best = min(v for v, _ in values)
    first = [r for v, r in values if v <= best + 1e-9]
    return tuple(r.arm for r in first), told(first[0])
