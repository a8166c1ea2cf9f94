"""What a campaign found: per arm, overall, per mode, scenario, fault and factor value, with 95% intervals.

Runs with a fault count in the part of that fault alone: they share their seeds with those without, and a run that is
counted again under each of a dozen faults would feign a dozen runs.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from statistics import quantiles
from typing import Literal, TypeAlias

import msgspec

from foreshock.campaign.forecast import Bin, Brier, Discrimination, auc_difference, brier, discrimination, reliability
from foreshock.campaign.ledger import Row
from foreshock.campaign.outcomes import Outcomes, seat_of
from foreshock.campaign.paired import PairedDifference, paired_difference
from foreshock.campaign.plan import Plan
from foreshock.campaign.spec import ArmEntry
from foreshock.campaign.times import Times, TimeShare, share_of_time
from foreshock.session.rates import Frequency, Rate, per_hour, wilson

__all__ = ["ArmResult", "Scope", "forecasts", "frequency", "results_of", "scopes_of", "shown"]

ScopeKind: TypeAlias = Literal["overall", "mode", "scenario", "fault", "factor"]
SEVERAL = 12
"""A factor with more distinct values than this is not broken down by value."""


class Scope(msgspec.Struct, frozen=True):
    """A part of the campaign's runs: without faults, but for those of one fault. Its name is empty for the whole."""

    kind: ScopeKind
    name: str = ""


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
        disturbed: share of those runs that intervened.
        safe: time from the intervention to the safe state, of runs of a judged arm without the accident; None if nobody
            judged, or it was not recorded.
        reduced: share of the time of runs whose reference run came to no harm in which an action held; None if there
            are none, or it was not recorded.
        brier: of P, for an arm in shadow.
        reliability: of P, likewise.
        discrimination: of P, likewise.
        scenarios: in which it ran.
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
    disturbed: Rate
    safe: Times | None
    reduced: TimeShare | None
    brier: Brier | None
    reliability: tuple[Bin, ...]
    discrimination: Discrimination | None
    scenarios: int

    @property
    def lead_quartiles_s(self) -> tuple[float, float, float] | None:
        """Quartiles of the lead time."""
        if not self.lead_s:
            return None
        if len(self.lead_s) == 1:
            return (self.lead_s[0],) * 3
        low, middle, high = quantiles(self.lead_s, n=4, method="inclusive")
        return low, middle, high


def scopes_of(rows: Sequence[Row]) -> list[tuple[Scope, Callable[[Row], bool]]]:
    """Every part that is reported, and whether a run belongs to it."""
    found: list[tuple[Scope, Callable[[Row], bool]]] = [(Scope("overall"), lambda r: not r.fault)]
    modes = sorted({r.mode for r in rows}, key=lambda m: (len(m), m))
    found += [(Scope("mode", m), lambda r, m=m: r.mode == m and not r.fault) for m in modes]  # type: ignore[misc]  # m is bound here
    scenarios = list(dict.fromkeys(r.scenario for r in rows))
    found += [(Scope("scenario", s), lambda r, s=s: r.scenario == s and not r.fault) for s in scenarios]  # type: ignore[misc]  # as above
    faults = list(dict.fromkeys(r.fault for r in rows))
    if faults != [""]:
        found += [(Scope("fault", f or "no fault"), lambda r, f=f: r.fault == f) for f in faults]  # type: ignore[misc]  # as above
    for name in dict.fromkeys(p for r in rows for p in r.parameters):
        values = sorted({r.parameters[name] for r in rows if name in r.parameters})
        if len(values) <= SEVERAL:
            found += [
                (Scope("factor", f"{name} = {v:g}"), lambda r, n=name, v=v: r.parameters.get(n) == v and not r.fault)  # type: ignore[misc]  # as above
                for v in values
            ]
    return found


def results_of(plan: Plan, rows: Sequence[Row]) -> list[ArmResult]:
    """Every arm in every part.

    Args:
        plan: of the campaign.
        rows: what was run of it.
    """
    outcomes = Outcomes(plan, rows)
    first = next((a.id for a in plan.spec.arms if a.kind == "shadow"), "")
    found = []
    for scope, belongs in scopes_of(rows):
        by_arm: dict[str, list[Row]] = {}
        for r in rows:
            if belongs(r):
                by_arm.setdefault(r.arm, []).append(r)
        shadow = first, by_arm.get(first, [])
        found += [_judged(scope, a, by_arm[a.id], outcomes, shadow) for a in plan.spec.arms if a.id in by_arm]
    return found


def forecasts(rows: Sequence[Row]) -> list[Row]:
    """The runs whose highest P is known, and what happened."""
    return [r for r in rows if r.ok and r.peak_p is not None]


def _judged(
    scope: Scope, arm: ArmEntry, mine: Sequence[Row], outcomes: Outcomes, first: tuple[str, Sequence[Row]]
) -> ArmResult:
    reference = outcomes.reference
    runs = [r for r in mine if r.ok]
    exposed = {r.scenario for r in mine} - outcomes.harmless or {r.scenario for r in mine}
    counted = [r for r in runs if r.scenario in exposed]
    pairs = [(a, r) for r in runs if (a := outcomes.partner(r)) is not None]
    both = [(a, b) for a, b in pairs if b.scenario in exposed]
    hurt = [(a, b) for a, b in both if a.accident]
    calm = [r for r in runs if outcomes.calm(r)]
    judged = [(r, wrong) for r in calm if (wrong := outcomes.false(r)) is not None]
    errors, hours = sum(wrong for _, wrong in judged), sum(r.end_s or 0.0 for r, _ in judged) / 3600.0
    slowed = [r for r in calm if outcomes.reduced(r) is not None]
    safe = [t for r in runs if (t := outcomes.safe_after_s(r)) is not None]
    itself = reference is None or arm.id == reference.id
    told = forecasts(runs) if arm.kind == "shadow" else []
    p, happened = [r.peak_p or 0.0 for r in told], [bool(r.accident) for r in told]
    return ArmResult(
        scope,
        arm.id,
        len(runs),
        len(mine) - len(runs),
        wilson(sum(bool(r.accident) for r in counted), len(counted)),
        sum(bool(r.accident) for r in runs if r.scenario not in exposed),
        None if itself else paired_difference([bool(a.accident) for a, _ in both], [bool(b.accident) for _, b in both]),
        wilson(sum(not b.accident for _, b in hurt), len(hurt)),
        sum(bool(b.accident) and not a.accident for a, b in pairs),
        tuple(sorted(t for _, r in hurt if (t := outcomes.lead_s(r)) is not None)),
        per_hour(errors, hours) if reference is not None and (arm.judged or judged) and arm.kind != "none" else None,
        wilson(errors, len(judged)),
        Times(tuple(sorted(safe))) if safe else None,
        share_of_time([r.reduced_s or 0.0 for r in slowed], [r.end_s or 0.0 for r in slowed]) if slowed else None,
        brier(p, happened),
        reliability(p, happened),
        _told_apart(told, p, happened, None if arm.id == first[0] else first),
        len({r.scenario for r in mine}),
    )


def _told_apart(
    told: Sequence[Row], p: Sequence[float], happened: Sequence[bool], first: tuple[str, Sequence[Row]] | None
) -> Discrimination | None:
    """How well P discriminates, and how that differs from the first shadow arm, on the runs that both have."""
    found = discrimination(p, happened)
    if found is None or first is None:
        return found
    before = {seat_of(r): r.peak_p or 0.0 for r in forecasts(first[1])}
    both = [r for r in told if seat_of(r) in before]
    difference = auc_difference(
        first[0],
        [r.peak_p or 0.0 for r in both],
        [before[seat_of(r)] for r in both],
        [bool(r.accident) for r in both],
    )
    return msgspec.structs.replace(found, difference=difference)


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
