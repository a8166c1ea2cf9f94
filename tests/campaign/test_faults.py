"""Runs with a fault count for that fault alone, each against the same run without it, on tables made for it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import msgspec
import pytest
from statsmodels.stats.contingency_tables import mcnemar as sm_mcnemar
from statsmodels.stats.multitest import multipletests

from foreshock.campaign import Plan, Row, parse_campaign, plan_of
from foreshock.campaign.compare import compare
from foreshock.campaign.fault_effects import FaultEffect, fault_effects
from foreshock.campaign.results import Scope, results_of
from foreshock.campaign.trace import traces_of
from foreshock.campaign.verdicts import fault_table
from foreshock.registry import Registry

FALL, NOMINAL = "a1-fall-onto-human", "a1-fall-onto-human-nominal"
SPEC: dict[str, Any] = {
    "id": "c",
    "replicates": 20,
    "scenarios": [{"use": FALL}, {"use": NOMINAL}],
    "arms": [{"id": "none", "kind": "none"}, {"id": "shadow", "kind": "shadow"}, {"id": "on", "kind": "on"}],
    "faults": [
        {"id": "blind", "faults": [{"kind": "dropout", "channel": "*"}]},
        {"id": "late", "faults": [{"kind": "late", "magnitude": 0.3}]},
        {"id": "fall-only", "scenarios": [FALL], "faults": [{"kind": "ignored"}]},
    ],
}


@pytest.fixture(scope="module")
def plan() -> Plan:
    return plan_of(parse_campaign(SPEC, "c"), Path(), Registry())


def rows(plan: Plan) -> list[Row]:
    """Unsupervised all fall. Supervised nobody does, but 15 of 20 with late actions; blind, it stops every time."""
    made = []
    for c in plan.cases:
        fell = c.scenario == FALL and (c.arm != "on" or (c.fault == "late" and c.seed < 15))
        at_s = 5.0 if fell else None
        blind = c.fault == "blind" and c.arm == "on"
        gate_s = 1.0 if blind else 4.0 if c.scenario == FALL and c.arm != "none" else None
        row = Row(*(c.key, c.scenario, c.mode, c.arm, c.point, c.replicate, c.seed, c.parameters, c.fault))
        level = 3 if blind else 2 if gate_s else 0
        changed = {"accident": fell, "accident_s": at_s, "event_s": at_s, "end_s": 10.0, "level": level}
        made.append(msgspec.structs.replace(row, **changed, protective_s=gate_s, acted_s=gate_s, reduced_s=0.0))
    return made


def test_a_run_is_not_counted_again_under_every_fault(plan: Plan) -> None:
    """Twenty seeds unsupervised are twenty runs, whatever is injected into a supervisor that is not there."""
    found = results_of(plan, rows(plan))
    of = {(r.scope, r.arm): r for r in found}
    for scope in (Scope("overall"), Scope("mode", "A1"), Scope("scenario", FALL), Scope("fault", "no fault")):
        assert (of[scope, "none"].accidents.k, of[scope, "none"].accidents.n) == (20, 20)
        assert (of[scope, "on"].accidents.k, of[scope, "on"].prevented.k) == (0, 20)
    late = of[Scope("fault", "late"), "on"]
    assert (late.accidents.k, late.prevented.k, late.disturbed.k, late.disturbed.n) == (15, 5, 0, 20)
    assert (of[Scope("fault", "blind"), "on"].disturbed.k, of[Scope("fault", "fall-only"), "on"].disturbed.n) == (20, 0)
    traces = {(t.scenario, t.arm): t for t in traces_of(plan, rows(plan), found)}
    assert (traces[FALL, "on"].planned, traces[NOMINAL, "on"].verdict) == (20, "no harm")


def test_each_fault_is_held_against_the_same_runs_without_it(plan: Plan) -> None:
    table = rows(plan)
    lost = next(r for r in table if (r.fault, r.arm, r.scenario, r.seed) == ("late", "on", FALL, 19))
    table[table.index(lost)] = msgspec.structs.replace(lost, status="hang", accident=None)
    found = {e.fault: e for e in fault_effects(plan, table)}
    assert list(found) == ["blind", "late", "fall-only"]

    def counts(e: FaultEffect) -> list[tuple[int, int]]:
        rates = (e.accidents, e.accidents_without, e.false, e.false_without, e.minimal_risk)
        return [(r.k, r.n) for r in rates]

    assert counts(found["blind"]) == [(0, 20), (0, 20), (20, 20), (0, 20), (40, 40)]
    assert counts(found["late"]) == [(15, 19), (0, 19), (0, 20), (0, 20), (0, 39)]
    assert counts(found["fall-only"]) == [(0, 20), (0, 20), (0, 0), (0, 0), (0, 20)]
    assert {e.fault: e.effects for e in found.values()} == {
        "blind": ("more false interventions",),
        "late": ("more accidents",),
        "fall-only": ("not significant",),
    }
    assert (found["late"].failures, list(found["late"].where)) == (1, [FALL])
    stops = sm_mcnemar([[0, 0], [20, 0]], exact=True).pvalue
    falls = sm_mcnemar([[0, 0], [15, 4]], exact=True).pvalue
    adjusted = multipletests([1.0, stops, falls, 1.0, 1.0, 1.0], method="holm")[1]
    assert (found["blind"].false_p, found["late"].accidents_p) == pytest.approx((adjusted[1], adjusted[2]), rel=1e-9)
    said = fault_table(list(found.values())).splitlines()
    assert len({line.count("|") for line in said if line.startswith("|")}) == 1
    assert sum("**more accidents**" in line for line in said) == 1


def test_what_got_worse_under_a_fault_alone_is_found(plan: Plan) -> None:
    before = rows(plan)
    after = [
        msgspec.structs.replace(r, accident=True, accident_s=5.0, event_s=5.0)
        if (r.fault, r.arm, r.scenario) == ("blind", "on", FALL)
        else r
        for r in before
    ]
    found = [c for c in compare((plan, before), (plan, after)).changes if c.worse]
    assert [(c.scope, c.arm, c.metric) for c in found] == [(Scope("fault", "blind"), "on", "accidents")]
    assert not any(c.worse for c in compare((plan, after), (plan, before)).changes)
