"""Two campaigns against each other: where a result got significantly worse."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

import msgspec

from foreshock.campaign.ledger import Row
from foreshock.campaign.outcomes import Outcomes
from foreshock.campaign.paired import holm, mcnemar
from foreshock.campaign.plan import Plan
from foreshock.campaign.results import Scope, scopes_of

__all__ = ["LEVEL", "Change", "compare"]

LEVEL = 0.05
"""Chance that any result is called worse where nothing has changed."""

WITHOUT = Scope("fault", "no fault")
"""The same runs as those of the whole."""

Seat = tuple[str, str, int, int, str]


class Change(msgspec.Struct, frozen=True):
    """How one metric of one arm changed in one part.

    Attributes:
        scope: overall, a mode or a fault.
        arm: id.
        metric: ``accidents``, ``false-interventions``, ``lead-time``, ``reduced-speed`` or ``failures``.
        before: value in the first campaign: a rate, or a median in s or as a share of time; NaN if there is none.
        after: in the second.
        n: runs that were compared.
        paired: whether the same runs were compared, one by one.
        p: one-sided, that it did not get worse, adjusted for the number of comparisons (Holm).
    """

    scope: Scope
    arm: str
    metric: str
    before: float
    after: float
    n: int
    paired: bool
    p: float

    @property
    def worse(self) -> bool:
        """Whether it is significantly worse."""
        return self.p < LEVEL


def compare(before: tuple[Plan, Sequence[Row]], after: tuple[Plan, Sequence[Row]]) -> list[Change]:
    """Every metric of the arms and scenarios that both campaigns have, overall, per mode and per fault.

    Runs of the same scenario, parameters, fault, seed and arm are compared one by one (McNemar; Wilcoxon's signed ranks
    for times); where the campaigns share none, as independent samples (Fisher's exact test; Mann and Whitney's).

    Args:
        before: plan and rows of the first campaign.
        after: of the second.
    """
    arms = {a.id: a for a in before[0].spec.arms}
    shared = [a for a in after[0].spec.arms if a.id in arms]
    sides = [Outcomes(*before), Outcomes(*after)]
    both = {r.scenario for r in before[1]} & {r.scenario for r in after[1]}
    tables = [[r for r in rows if r.scenario in both] for _, rows in (before, after)]
    found: list[Change] = []
    scopes = [
        s for s in scopes_of([*tables[0], *tables[1]]) if s[0].kind in ("overall", "mode", "fault") and s[0] != WITHOUT
    ]
    several = sum(scope.kind == "mode" for scope, _ in scopes) > 1
    for scope, belongs in scopes if several else scopes[1:]:  # one mode is the whole
        for arm in shared:
            first, second = ({_seat(r): r for r in rows if r.arm == arm.id and belongs(r)} for rows in tables)
            if first and second:
                found += _changes(scope, arm.id, sides, first, second)
    adjusted = holm([c.p for c in found])
    return [msgspec.structs.replace(c, p=p) for c, p in zip(found, adjusted, strict=True)]


def _seat(row: Row) -> Seat:
    parameters = ",".join(f"{k}={v!r}" for k, v in sorted(row.parameters.items()))
    return row.scenario, parameters, row.seed, row.replicate, row.fault


def _changes(
    scope: Scope, arm: str, sides: Sequence[Outcomes], first: Mapping[Seat, Row], second: Mapping[Seat, Row]
) -> list[Change]:
    found = []
    events: dict[str, list[Callable[[Row], bool | None]]] = {
        "accidents": [lambda r: r.accident, lambda r: r.accident],
        "false-interventions": [sides[0].false, sides[1].false],
        "failures": [lambda r: not r.ok, lambda r: not r.ok],
    }
    for metric, (of_first, of_second) in events.items():
        a = {k: v for k, r in first.items() if (v := of_first(r)) is not None}
        b = {k: v for k, r in second.items() if (v := of_second(r)) is not None}
        if a and b:
            found.append(_of_events(scope, arm, metric, a, b))
    x, y = (
        {k: lead_s for k, r in rows.items() if (lead_s := side.lead_s(r)) is not None}
        for side, rows in zip(sides, (first, second), strict=True)
    )
    if x and y:
        found.append(_of_times(scope, arm, "lead-time", x, y))
    x, y = (
        {k: -share for k, r in rows.items() if (share := side.reduced(r)) is not None}
        for side, rows in zip(sides, (first, second), strict=True)
    )
    if x and y:
        change = _of_times(scope, arm, "reduced-speed", x, y)
        found.append(msgspec.structs.replace(change, before=-change.before, after=-change.after))
    return found


def _of_events(scope: Scope, arm: str, metric: str, a: Mapping[Seat, bool], b: Mapping[Seat, bool]) -> Change:
    both = [k for k in a if k in b]
    if both:
        first, second = [a[k] for k in both], [b[k] for k in both]
        pairs = list(zip(first, second, strict=True))
        p = mcnemar(sum(f and not s for f, s in pairs), sum(s and not f for f, s in pairs), greater=True)
    else:
        from scipy.stats import fisher_exact

        first, second = list(a.values()), list(b.values())
        counts = [[sum(v), len(v) - sum(v)] for v in (second, first)]
        p = float(fisher_exact(counts, alternative="greater").pvalue)
    return Change(scope, arm, metric, _mean(first), _mean(second), len(second), bool(both), p)


def _of_times(scope: Scope, arm: str, metric: str, a: Mapping[Seat, float], b: Mapping[Seat, float]) -> Change:
    from scipy.stats import mannwhitneyu, wilcoxon

    both = [k for k in a if k in b]
    if both:
        x, y = [a[k] for k in both], [b[k] for k in both]
        less = [v - u for u, v in zip(x, y, strict=True)]
        p = float(wilcoxon(less, alternative="less").pvalue) if any(less) else 1.0
    else:
        x, y = list(a.values()), list(b.values())
        p = float(mannwhitneyu(y, x, alternative="less").pvalue)
    return Change(scope, arm, metric, _median(x), _median(y), len(y), bool(both), p)


def _mean(values: Sequence[bool]) -> float:
    return sum(values) / len(values) if values else math.nan


def _median(values: Sequence[float]) -> float:
    from statistics import median

    return median(values) if values else math.nan
