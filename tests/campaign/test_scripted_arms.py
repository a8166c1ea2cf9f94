"""Arms that take another's interventions: where that one did nothing, they do what its policies would at the gate."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from foreshock.campaign import Plan, parse_campaign, plan_of
from foreshock.campaign.ledger import row_of
from foreshock.campaign.outcomes import Outcomes
from foreshock.records import Intervention
from foreshock.registry import Registry
from foreshock.session.isolated import run_all
from foreshock.session.run import Run
from foreshock.session.scripted import acts_of

NOMINAL = "a4-handover-crush-nominal"
SPEC: dict[str, Any] = {
    "id": "c",
    "seed": 3,
    "scenarios": [{"use": NOMINAL, "duration_s": 2.0}],
    "arms": [{"id": kind, "kind": kind} for kind in ("none", "on", "random", "always")],
}
GATE = {"release", "retreat"}
"""The paper's answer to a crush in a handover: let go and back off (section 3.3; the protocol of mode A4)."""


def plan(**change: Any) -> Plan:
    return plan_of(parse_campaign({**SPEC, **change}, "c"), Path(), Registry())


def act(t_s: float, action: str, mode: str = "A4", strength: float = 1.0) -> Intervention:
    return Intervention(round(t_s * 1e9), action, strength, mode)


@pytest.mark.parametrize("changes", [(), (act(0.5, "announce"), act(0.5, "speed-scale", "", 0.4))])
def test_where_the_other_arm_did_not_act_they_hold_what_it_would_at_the_gate(changes: tuple[Intervention, ...]) -> None:
    found = plan()
    jobs = {c.arm: found.job(c, changes) for c in found.cases}
    assert {(i.action, i.strength, i.stamp_ns) for i in jobs["always"].scripted} == {(a, 1.0, 0) for a in GATE}
    assert {(i.action, i.strength) for i in jobs["random"].scripted} == {(a, 1.0) for a in GATE}
    (at_ns,) = {i.stamp_ns for i in jobs["random"].scripted}
    assert 0 < at_ns < 2_000_000_000
    assert jobs["on"].scripted == jobs["none"].scripted == ()


def test_where_it_acted_they_take_what_it_did() -> None:
    found = plan()
    changes = (act(0.4, "hold", "A4", 0.5), act(0.9, "hold"), act(1.2, "hold", "A4", 0.0))
    jobs = {c.arm: found.job(c, changes) for c in found.cases}
    assert [(i.action, i.strength, i.stamp_ns) for i in jobs["always"].scripted] == [("hold", 1.0, 0)]
    assert [i.strength for i in jobs["random"].scripted] == [0.5, 1.0, 0.0]


def test_the_price_of_always_on_is_known_in_calm_runs() -> None:
    found = plan()
    cases = {c.arm: c for c in found.cases}
    jobs = {arm: found.job(cases[arm]) for arm in ("none", "on", "random", "always")}
    rows = {}
    for (arm, job), result in zip(jobs.items(), run_all(list(jobs.values())), strict=True):
        assert isinstance(result, Run)
        rows[arm] = row_of(cases[arm], result, 0.0, job.scripted)
    outcomes = Outcomes(found, list(rows.values()))
    assert {arm: outcomes.false(r) for arm, r in rows.items()} == {
        "none": False,
        "on": False,
        "random": True,
        "always": True,
    }
    assert outcomes.reduced(rows["always"]) == pytest.approx(1.0)
    assert 0.0 < (outcomes.reduced(rows["random"]) or 0.0) < 1.0


def test_a_policy_that_waits_for_evidence_says_nothing_of_calm_runs() -> None:
    reactive = {"policies": [{"use": "reactive-stop", "config": {"mode": "{mode}"}}]}
    arms = [{"id": "none", "kind": "none"}, {"id": "on", "kind": "on", "config": reactive, "acts_by": "action"}]
    found = plan(arms=[*arms, {"id": "always", "kind": "always"}])
    always = next(c for c in found.cases if c.arm == "always")
    job = found.job(always)
    assert job.scripted == ()
    (result,) = run_all([job])
    assert isinstance(result, Run)
    none = next(c for c in found.cases if c.arm == "none")
    rows = [row_of(none, result, 0.0, ()), row_of(always, result, 0.0, ())]
    outcomes = Outcomes(found, rows)
    assert outcomes.calm(rows[1])
    assert outcomes.false(rows[1]) is outcomes.reduced(rows[1]) is None


def test_the_minimal_risk_condition_is_an_intervention_of_every_mode() -> None:
    """It belongs to no mode; slowing down and announcing do not count, nor does a release."""
    changes = [act(1.0, "announce"), act(2.0, "hold", "A4", 0.0), act(3.0, "hold", "A9"), act(4.0, "minimal-risk", "")]
    assert [i.action for i in acts_of(changes, "A4")] == ["minimal-risk"]
