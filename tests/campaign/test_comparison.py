"""What a comparison of two campaigns may compare: the same experiment under another supervisor, and all of it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import msgspec
import pytest

from foreshock.campaign import Plan, Row, parse_campaign, plan_of
from foreshock.campaign.compare import Comparison, compare
from foreshock.registry import Registry

SCENARIO: dict[str, Any] = {"use": "a1-fall-onto-human"}
SPEC: dict[str, Any] = {
    "id": "c",
    "replicates": 12,
    "scenarios": [SCENARIO, {"use": "a1-fall-onto-human-nominal"}],
    "arms": [{"id": "none", "kind": "none"}, {"id": "on", "kind": "on"}],
}
NOISE = {"kind": "noise", "channel": "imu/torso", "fields": ["angular_velocity[0]"], "magnitude": 0.3, "unit": "rad/s"}


def side(**changed: Any) -> tuple[Plan, list[Row]]:
    """A campaign, and its runs as if none had the accident."""
    plan = plan_of(parse_campaign({**SPEC, **changed}, "c"), Path(), Registry())
    columns = ("key", "scenario", "mode", "arm", "point", "replicate", "seed", "parameters", "fault")
    return plan, [
        Row(**{c: getattr(case, c) for c in columns}, accident=False, outcome="none", end_s=36.0, level=0)
        for case in plan.cases
    ]


def fell(runs: tuple[Plan, list[Row]], arm: str = "on") -> tuple[Plan, list[Row]]:
    """The same, with the accident in every run of the arm."""
    fallen = {"accident": True, "accident_s": 5.0, "event_s": 5.0, "outcome": "fall"}
    return runs[0], [msgspec.structs.replace(r, **fallen) if r.arm == arm else r for r in runs[1]]


def lacking(found: Comparison) -> dict[tuple[str, str, str], int]:
    return {(m.scenario, m.arm, m.fault): m.runs for m in found.missing}


@pytest.mark.parametrize("changed", [{"duration_s": 1.0}, {"parameters": {"drop_mu": 0.5}}])
def test_a_scenario_of_another_content_is_another_experiment(changed: dict[str, Any]) -> None:
    """Neither a campaign in which nobody lives long enough to fall is better, nor one on firmer ground."""
    before, after = side(), side(scenarios=[{**SCENARIO, **changed}, SPEC["scenarios"][1]])
    for found in (compare(before, fell(after)), compare(after, fell(before))):
        assert {c.n for c in found.changes} == {12}  # those of the other scenario alone
        assert found.not_compared["scenarios"] == ("a1-fall-onto-human",)
        assert lacking(found) == {("a1-fall-onto-human", arm, ""): 12 for arm in ("none", "on")}
    (name,) = changed
    assert any(line.startswith(f"scenarios.a1-fall-onto-human.{name}") for line in compare(before, after).differs)
    assert compare(side(scenarios=[SCENARIO]), side(scenarios=[{**SCENARIO, **changed}])).changes == ()


def test_the_supervisor_is_what_is_compared() -> None:
    """Another configuration of an arm changes the keys of its runs, and they are still pairs; it is said."""
    arms = [SPEC["arms"][0], {"id": "on", "kind": "on", "config": {"risk": {"c": 0.9}}}]
    found = compare(side(), fell(side(arms=arms)))
    assert all(c.paired and c.n == 24 for c in found.changes)
    assert {(c.arm, c.metric) for c in found.changes if c.worse} == {("on", "accidents")}
    assert found.missing == ()
    assert found.differs == ("campaign.arms.on.config.risk is new",)


def test_a_seed_that_both_have_is_a_pair_wherever_it_stands_in_line() -> None:
    """Seeds 0 to 11 and 6 to 17 share six, under other replicate numbers."""
    found = compare(side(), side(seed=6))
    assert all(c.paired and c.n == 12 for c in found.changes)  # six seeds, two scenarios
    assert set(lacking(found).values()) == {6}


def test_a_fault_of_another_content_is_another_experiment() -> None:
    weak, strong = ([{"id": "noise", "faults": [{**NOISE, "magnitude": m}]}] for m in (0.3, 3.0))
    found = compare(side(faults=weak), fell(side(faults=strong)))
    assert not [c for c in found.changes if c.scope.kind == "fault"]
    assert found.not_compared["faults"] == ("noise",)
    assert {fault for _, _, fault in lacking(found)} == {"noise"}


def test_other_values_of_a_factor_are_no_independent_sample_of_it() -> None:
    low, high = ([{"parameter": "drop_mu", "values": [v], "scenarios": ["a1-fall-onto-human"]}] for v in (0.05, 0.5))
    found = compare(side(factors=low), fell(side(factors=high)))
    assert found.not_compared["scenarios"] == ("a1-fall-onto-human",)
    assert {c.n for c in found.changes} == {12}


def test_what_the_second_lacks_is_missing() -> None:
    assert compare(side(), side()).missing == ()
    whole = side()
    assert lacking(compare(whole, side(scenarios=[SCENARIO]))) == {
        ("a1-fall-onto-human-nominal", arm, ""): 12 for arm in ("none", "on")
    }
    without = compare(whole, side(arms=SPEC["arms"][:1]))
    assert without.not_compared["arms"] == ("on",)
    assert {arm for _, arm, _ in lacking(without)} == {"on"}
    few = compare(whole, (whole[0], whole[1][:3]))
    assert sum(lacking(few).values()) == len(whole[1]) - 3
    # more than the first has is no loss; other seeds are as good if they are as many
    assert compare(side(scenarios=[SCENARIO]), whole).missing == ()
    assert compare(side(scenarios=[SCENARIO]), whole).not_compared["scenarios"] == ("a1-fall-onto-human-nominal",)
    assert compare(whole, side(seed=1000)).missing == ()
    assert set(lacking(compare(whole, side(seed=1000, replicates=5))).values()) == {7}
