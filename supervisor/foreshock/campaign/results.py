"""What a campaign found: per arm, overall, per mode, scenario, fault and factor value, with 95% intervals."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from statistics import quantiles
from typing import Literal, TypeAlias

import msgspec

from foreshock.campaign.ledger import Row
from foreshock.campaign.paired import PairedDifference, paired_difference
from foreshock.campaign.plan import Plan
from foreshock.campaign.spec import ArmEntry
from foreshock.records import ProtectionLevel
from foreshock.session.rates import Frequency, Rate, per_hour, wilson

__all__ = ["ArmResult", "Brier", "Scope", "acted_s", "frequency", "results_of", "scopes_of", "shown"]

ScopeKind: TypeAlias = Literal["overall", "mode", "scenario", "fault", "factor"]
SEVERAL = 12
"""A factor with more distinct values than this is not broken down by value."""


class Scope(msgspec.Struct, frozen=True):
    """A part of the campaign's runs; its name is empty for all of them."""

    kind: ScopeKind
    name: str = ""


class Brier(msgspec.Struct, frozen=True):
    """Mean squared error of P against what happened, with its 95% interval (normal approximation).

    The forecast of a run is the highest P of the mode before the accident, judged in shadow: where the supervisor acts,
    what happens is no test of its forecast. base is the score of always saying the observed rate.
    """

    score: float
    low: float
    high: float
    base: float
    n: int


class ArmResult(msgspec.Struct, frozen=True):
    """What one arm did in one part of the campaign.

    Attributes:
        scope: which part.
        arm: id.
        runs: that gave a result.
        failures: that gave none.
        accidents: runs with the scenario's accident, of the scenarios in which it can be expected; where a part has
            none of those, of all.
        harmed: accidents in scenarios in which nothing should happen.
        difference: of the accident rate from the reference arm's, on the same seeds; None for the reference itself.
        prevented: of the accidents under the reference, those that did not happen here.
        caused: accidents that happened here and not under the reference.
        lead_s: from the intervention to the accident under the reference, one per run that has both, sorted; negative:
            too late.
        false: interventions in runs whose reference run came to no harm, per hour of such runs.
        brier: of P, for an arm in shadow.
    """

    scope: Scope
    arm: str
    runs: int
    failures: int
    accidents: Rate
    harmed: int
    difference: PairedDifference | None
    prevented: Rate
    caused: int
    lead_s: tuple[float, ...]
    false: Frequency | None
    brier: Brier | None

    @property
    def lead_quartiles_s(self) -> tuple[float, float, float] | None:
        """Quartiles of the lead time."""
        if not self.lead_s:
            return None
        if len(self.lead_s) == 1:
            return (self.lead_s[0],) * 3
        low, middle, high = quantiles(self.lead_s, n=4, method="inclusive")
        return low, middle, high


def acted_s(row: Row, arm: ArmEntry) -> float | None:
    """When a run intervened: at the protective level, or by its first action where an arm acts by action."""
    if arm.kind == "none":
        return None
    if arm.scripted or arm.acts_by == "action":
        return row.acted_s
    if row.protective_s is None and row.level is not None and row.level >= ProtectionLevel.PROTECTIVE:
        return row.acted_s  # the minimal risk condition without the mode's own gate
    return row.protective_s


def scopes_of(rows: Sequence[Row]) -> list[tuple[Scope, Callable[[Row], bool]]]:
    """Every part that is reported, and whether a run belongs to it."""
    found: list[tuple[Scope, Callable[[Row], bool]]] = [(Scope("overall"), lambda _: True)]
    modes = sorted({r.mode for r in rows}, key=lambda m: (len(m), m))
    found += [(Scope("mode", m), lambda r, m=m: r.mode == m) for m in modes]  # type: ignore[misc]  # m is bound here
    scenarios = list(dict.fromkeys(r.scenario for r in rows))
    found += [(Scope("scenario", s), lambda r, s=s: r.scenario == s) for s in scenarios]  # type: ignore[misc]  # as above
    faults = list(dict.fromkeys(r.fault for r in rows))
    if faults != [""]:
        found += [(Scope("fault", f or "no fault"), lambda r, f=f: r.fault == f) for f in faults]  # type: ignore[misc]  # as above
    for name in dict.fromkeys(p for r in rows for p in r.parameters):
        values = sorted({r.parameters[name] for r in rows if name in r.parameters})
        if len(values) <= SEVERAL:
            found += [
                (Scope("factor", f"{name} = {v:g}"), lambda r, n=name, v=v: r.parameters.get(n) == v)  # type: ignore[misc]  # as above
                for v in values
            ]
    return found


def results_of(plan: Plan, rows: Sequence[Row]) -> list[ArmResult]:
    """Every arm in every part.

    Args:
        plan: of the campaign.
        rows: what was run of it.
    """
    reference = plan.spec.reference_arm
    partner = {_seat(r): r for r in rows if reference is not None and r.arm == reference.id and r.ok}
    harmless = {id_ for id_, s in plan.scenarios.items() if s.expect == "none"}
    found = []
    for scope, belongs in scopes_of(rows):
        inside = [r for r in rows if belongs(r)]
        for arm in plan.spec.arms:
            mine = [r for r in inside if r.arm == arm.id]
            if mine:
                pairs = [(partner[_seat(r)], r) for r in mine if r.ok and _seat(r) in partner]
                found.append(_judged(scope, arm, mine, None if reference is None else pairs, reference, harmless))
    return found


def _seat(row: Row) -> tuple[str, int, int, str]:
    """What the arms share: scenario, point, replicate and fault."""
    return row.scenario, row.point, row.replicate, row.fault


def _judged(
    scope: Scope,
    arm: ArmEntry,
    mine: Sequence[Row],
    pairs: Sequence[tuple[Row, Row]] | None,
    reference: ArmEntry | None,
    harmless: set[str],
) -> ArmResult:
    runs = [r for r in mine if r.ok]
    exposed = {r.scenario for r in mine} - harmless or {r.scenario for r in mine}
    counted = [r for r in runs if r.scenario in exposed]
    both = [(a, b) for a, b in pairs or () if b.scenario in exposed]
    hurt = [(a, b) for a, b in both if a.accident]
    calm = [(a, b) for a, b in pairs or () if a.event_s is None]
    leads = [a.accident_s - t for a, b in hurt if (t := acted_s(b, arm)) is not None and a.accident_s is not None]
    false = per_hour(sum(acted_s(b, arm) is not None for _, b in calm), sum(b.end_s or 0.0 for _, b in calm) / 3600.0)
    itself = reference is None or arm.id == reference.id
    return ArmResult(
        scope,
        arm.id,
        len(runs),
        len(mine) - len(runs),
        wilson(sum(bool(r.accident) for r in counted), len(counted)),
        sum(bool(r.accident) for r in runs if r.scenario not in exposed),
        None if itself else paired_difference([bool(a.accident) for a, _ in both], [bool(b.accident) for _, b in both]),
        wilson(sum(not b.accident for _, b in hurt), len(hurt)),
        sum(bool(b.accident) and not a.accident for a, b in pairs or ()),
        tuple(sorted(leads)),
        None if pairs is None or arm.kind == "none" else false,
        _brier(runs) if arm.kind == "shadow" else None,
    )


def _brier(rows: Iterable[Row]) -> Brier | None:
    told = [(r.peak_p, float(bool(r.accident))) for r in rows if r.peak_p is not None]
    if not told:
        return None
    n = len(told)
    errors = [(p - y) ** 2 for p, y in told]
    score = sum(errors) / n
    rate = sum(y for _, y in told) / n
    spread = math.sqrt(sum((e - score) ** 2 for e in errors) / (n - 1) / n) if n > 1 else math.nan
    half = 1.96 * spread if n > 1 else 1.0
    return Brier(score, max(score - half, 0.0), min(score + half, 1.0), rate * (1.0 - rate), n)


def shown(results: Sequence[ArmResult]) -> list[ArmResult]:
    """Those of the whole, of each mode and of each fault; the whole is left out where there is only one mode."""
    several = len({r.scope for r in results if r.scope.kind == "mode"}) > 1
    return [r for r in results if r.scope.kind in ("mode", "fault") or (several and r.scope.kind == "overall")]


def frequency(found: Frequency | None) -> str:
    """A frequency for people; of less than an hour, which says little about a rate, the count and the time."""
    if found is None or not found.hours:
        return "–"
    if found.hours < 1.0:
        return f"{found.k} in {60.0 * found.hours:.1f} min"
    return f"{found.per_hour:.2f} ({found.low:.2f}–{found.high:.2f})"
