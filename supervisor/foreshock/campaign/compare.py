"""Two campaigns against each other: where a result got significantly worse."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeAlias

import msgspec

from foreshock.campaign.identity import changes, digest
from foreshock.campaign.ledger import Row
from foreshock.campaign.outcomes import Outcomes
from foreshock.campaign.paired import holm, mcnemar
from foreshock.campaign.plan import Plan, runs_in
from foreshock.campaign.results import Scope, scopes_of

__all__ = ["LEVEL", "Change", "Comparison", "Missing", "compare"]

LEVEL = 0.05
"""Chance that any result is called worse where nothing has changed."""

WITHOUT = Scope("fault", "no fault")
"""The same runs as those of the whole."""

Group: TypeAlias = tuple[str, str, str]
"""Scenario, arm and fault."""
Seat: TypeAlias = tuple[str, str, int]
"""Hash of the experiment, values of the factors, and seed: all of a run but the supervisor, which is compared."""


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


class Missing(msgspec.Struct, frozen=True):
    """Runs of the first campaign that the second has no like of: scenario, arm, fault, and how many."""

    scenario: str
    arm: str
    fault: str
    runs: int


class Comparison(msgspec.Struct, frozen=True):
    """One campaign against another.

    Attributes:
        changes: every metric that could be compared.
        missing: what the first has and the second does not.
        not_compared: ids of ``scenarios``, ``arms`` and ``faults`` of either of which nothing was compared: only one
            has them, or they are not the same.
        differs: what differs between what the results of both depend on, beside the code; a line for each leaf.
    """

    changes: tuple[Change, ...]
    missing: tuple[Missing, ...]
    not_compared: dict[str, tuple[str, ...]]
    differs: tuple[str, ...]


class _Side:
    """One campaign: what its runs count as, and the runs by group and seat."""

    def __init__(self, plan: Plan, rows: Sequence[Row]) -> None:
        self.plan, self.outcomes = plan, Outcomes(plan, rows)
        self._faults = {f.id: f.faults for f in plan.spec.faults}
        self._hashes: dict[tuple[str, str], str] = {}
        self.runs: dict[Group, dict[Seat, Row]] = {}
        for r in rows:
            parameters = ",".join(f"{k}={v!r}" for k, v in sorted(r.parameters.items()))
            seat = self.experiment(r.scenario, r.fault), parameters, r.seed
            self.runs.setdefault((r.scenario, r.arm, r.fault), {})[seat] = r

    def experiment(self, scenario: str, fault: str) -> str:
        """Hash of the scenario without its supervisor, and of what is injected."""
        key = scenario, fault
        if key not in self._hashes:
            content = {k: v for k, v in self.plan.identity["scenarios"][scenario].items() if k != "config"}
            self._hashes[key] = digest([content, self._faults.get(fault, ())])
        return self._hashes[key]

    def drawn(self, group: Group) -> tuple[Any, ...]:
        """What the runs of a group are samples of."""
        spec = self.plan.spec
        factors = [f for f in spec.factors if runs_in(group[0], f.scenarios)]
        return self.experiment(group[0], group[2]), spec.sampler if factors else "", factors


def compare(before: tuple[Plan, Sequence[Row]], after: tuple[Plan, Sequence[Row]]) -> Comparison:
    """Every metric of what both campaigns have, overall, per mode and per fault.

    Runs of the same scenario, parameters, fault, seed and arm are compared one by one (McNemar; Wilcoxon's signed ranks
    for times); where the campaigns share no seed, as independent samples of the same factors (Fisher's exact test; Mann
    and Whitney's). A scenario or a fault is the same by content, but for the configuration of the supervisor.

    Args:
        before: plan and rows of the first campaign.
        after: of the second.
    """
    first, second = _Side(*before), _Side(*after)
    pairs: list[Group] = []
    samples: list[Group] = []
    missing = []
    for group, mine in first.runs.items():
        other = second.runs.get(group, {})
        lacks = len(mine)
        if shared := mine.keys() & other.keys():
            pairs.append(group)
            lacks -= len(shared)
        elif other and first.drawn(group) == second.drawn(group):
            samples.append(group)
            lacks -= len(other)
        if lacks > 0:
            missing.append(Missing(*group, lacks))
    return Comparison(
        tuple(_all_changes(first, second, (pairs, samples))),
        tuple(missing),
        _not_compared(before[0], after[0], [*pairs, *samples]),
        tuple(changes(_told(before[0].identity), _told(after[0].identity))),
    )


def _all_changes(first: _Side, second: _Side, kinds: Sequence[Sequence[Group]]) -> list[Change]:
    """Of pairs and of independent samples: where a part has both, each is a result of its own."""
    sides = [first.outcomes, second.outcomes]
    arms = [a.id for a in second.plan.spec.arms]
    every = [r for side in (first, second) for g in itertools.chain(*kinds) for r in side.runs[g].values()]
    scopes = [s for s in scopes_of(every) if s[0].kind in ("overall", "mode", "fault") and s[0] != WITHOUT]
    several = sum(scope.kind == "mode" for scope, _ in scopes) > 1
    found: list[Change] = []
    for scope, belongs in scopes if several else scopes[1:]:  # one mode is the whole
        for arm in arms:
            for groups in kinds:
                mine = [g for g in groups if g[1] == arm]
                a, b = ({s: r for g in mine for s, r in side.runs[g].items() if belongs(r)} for side in (first, second))
                if a and b:
                    found += _changes(scope, arm, sides, a, b)
    adjusted = holm([c.p for c in found])
    return [msgspec.structs.replace(c, p=p) for c, p in zip(found, adjusted, strict=True)]


def _not_compared(before: Plan, after: Plan, compared: Sequence[Group]) -> dict[str, tuple[str, ...]]:
    declared = [
        {
            "scenarios": list(plan.scenarios),
            "arms": [a.id for a in plan.spec.arms],
            "faults": [f.id for f in plan.spec.faults],
        }
        for plan in (before, after)
    ]
    return {
        name: tuple(id_ for id_ in dict.fromkeys(declared[0][name] + declared[1][name]) if id_ not in seen)
        for name, seen in zip(declared[0], ({g[k] for g in compared} for k in (0, 1, 2)), strict=True)
    }


def _told(identity: Mapping[str, Any]) -> dict[str, Any]:
    """An identity without the code, arms and faults by their ids."""
    campaign = identity["campaign"]
    named = {name: {entry["id"]: entry for entry in campaign[name]} for name in ("arms", "faults")}
    return {**{k: v for k, v in identity.items() if k != "code"}, "campaign": {**campaign, **named}}


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
