"""Statistics of paired runs against statsmodels, on fixed data; and what counts as prevented, false, early."""

from __future__ import annotations

import random
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from statsmodels.stats.contingency_tables import mcnemar as sm_mcnemar
from statsmodels.stats.multitest import multipletests
from statsmodels.stats.proportion import proportion_confint
from statsmodels.stats.rates import confint_poisson

from foreshock.campaign import Plan, Row, parse_campaign, plan_of
from foreshock.campaign.compare import compare
from foreshock.campaign.paired import holm, mcnemar, paired_difference
from foreshock.campaign.results import ArmResult, results_of
from foreshock.registry import Registry
from foreshock.session.rates import per_hour

EXACT = 1e-12
"""Both compute the same closed form or binomial sum; what differs is rounding."""


@pytest.mark.parametrize(("b", "c"), [(0, 0), (1, 0), (7, 2), (3, 14), (40, 22)])
def test_mcnemar_is_that_of_statsmodels(b: int, c: int) -> None:
    expected = sm_mcnemar([[50, b], [c, 30]], exact=True).pvalue if b + c else 1.0
    assert mcnemar(b, c) == pytest.approx(expected, rel=EXACT)


@settings(max_examples=30)
@given(st.lists(st.floats(0.0, 1.0), min_size=1, max_size=20))
def test_holm_is_that_of_statsmodels(p: list[float]) -> None:
    assert holm(p) == pytest.approx(list(multipletests(p, method="holm")[1]), abs=EXACT)


@pytest.mark.parametrize(("k", "hours"), [(0, 0.5), (1, 0.015), (3, 3.0), (16, 0.497), (250, 12.0)])
def test_frequency_is_that_of_statsmodels(k: int, hours: float) -> None:
    found = per_hour(k, hours)
    assert (found.low, found.high) == pytest.approx(confint_poisson(k, hours, method="exact-c"), rel=EXACT)


def test_paired_difference_is_the_closed_form_and_covers() -> None:
    """The closed form written out for 20 pairs, and that it covers: 95% of 4000 draws, not 4 sigma fewer."""
    first = [True] * 9 + [False] * 11
    second = [True] * 3 + [False] * 6 + [True] + [False] * 10
    d = paired_difference(first, second)
    p12, p21 = 7 / 22, 2 / 22
    half = 1.959963985 * np.sqrt((p12 + p21 - (p12 - p21) ** 2) / 22)
    assert (d.n, d.only_first, d.only_second) == (20, 6, 1)
    assert d.difference == pytest.approx(-0.25)
    assert (d.low, d.high) == pytest.approx((p21 - p12 - half, p21 - p12 + half), abs=1e-8)
    rng = np.random.default_rng(1)
    cells = rng.multinomial(40, [0.5, 0.3, 0.1, 0.1], size=4000)  # both, first alone, second alone, neither
    covered = 0
    for both, b, c, neither in cells:
        x = [True] * (both + b) + [False] * (c + neither)
        y = [True] * both + [False] * b + [True] * c + [False] * neither
        found = paired_difference(x, y)
        covered += found.low <= -0.2 <= found.high
    assert covered / 4000 > 0.95 - 4 * np.sqrt(0.95 * 0.05 / 4000)


SPEC: dict[str, Any] = {
    "id": "c",
    "replicates": 40,
    "scenarios": [{"use": "a1-fall-onto-human"}, {"use": "a1-fall-onto-human-nominal"}],
    "arms": [
        {"id": "shadow", "kind": "shadow"},
        {"id": "on", "kind": "on"},
        {"id": "early", "kind": "on", "policy": "ladder", "acts_by": "action"},
    ],
}


@pytest.fixture(scope="module")
def plan() -> Plan:
    return plan_of(parse_campaign(SPEC, "c"), Path(), Registry())


def rows(plan: Plan, fell: Any, acted: Any, protective: Any = None) -> list[Row]:
    """A table in which arm and seed decide: fell(arm, seed) at 5 s in the first scenario, acted(arm, seed) or None."""
    made = []
    for c in plan.cases:
        accident = c.scenario == "a1-fall-onto-human" and fell(c.arm, c.seed)
        at_s = 5.0 if accident else None
        gate = (protective or acted)(c.arm, c.seed)
        made.append(
            Row(
                *(c.key, c.scenario, c.mode, c.arm, c.point, c.replicate, c.seed, c.parameters),
                accident=accident,
                outcome="fall" if accident else "none",
                accident_s=at_s,
                event_s=at_s,
                end_s=36.0,
                level=3 if gate is not None else 0,
                protective_s=gate,
                acted_s=acted(c.arm, c.seed),
                peak_p=0.9 if accident else 0.1,
            )
        )
    return made


def overall(results: list[ArmResult]) -> dict[str, ArmResult]:
    return {r.arm: r for r in results if r.scope.kind == "overall"}


def test_rates_differences_lead_times_and_false_interventions(plan: Plan) -> None:
    def fell(arm: str, seed: int) -> bool:
        return seed < (30 if arm == "shadow" else 6) or (arm == "on" and seed == 39)

    def gate(arm: str, seed: int) -> float | None:
        return 4.0 if arm == "on" and seed < 20 else None

    found = overall(results_of(plan, rows(plan, fell, gate)))
    shadow, on, early = found["shadow"], found["on"], found["early"]
    # the nominal scenario is not among those in which an accident can be expected
    assert (shadow.accidents.k, shadow.accidents.n) == (30, 40)
    assert (on.accidents.k, on.accidents.n) == (7, 40)
    assert (on.accidents.low, on.accidents.high) == pytest.approx(proportion_confint(7, 40, 0.05, "wilson"), rel=1e-9)
    assert shadow.difference is None
    assert on.difference is not None
    assert (on.difference.only_first, on.difference.only_second) == (24, 1)
    assert on.difference.p == pytest.approx(sm_mcnemar([[6, 24], [1, 9]], exact=True).pvalue, rel=EXACT)
    assert (on.prevented.k, on.prevented.n, on.caused) == (24, 30, 1)
    assert on.lead_s == (1.0,) * 20
    # of the seeds, 20 acted in the nominal scenario, and none of those that were unharmed in the other
    assert on.false is not None
    assert (on.false.k, on.false.hours) == (20, pytest.approx((10 + 40) * 36.0 / 3600.0))
    assert early.false is not None
    assert early.false.k == 0
    assert shadow.brier is not None
    # 30 forecasts of 0.9 of what happened, 50 of 0.1 of what did not
    assert shadow.brier.score == pytest.approx(0.01)
    assert shadow.brier.base == pytest.approx(30 / 80 * 50 / 80)
    assert on.brier is None


def test_an_arm_acts_by_level_or_by_action(plan: Plan) -> None:
    table = rows(plan, lambda *_: False, lambda *_: 1.0, protective=lambda *_: None)
    found = overall(results_of(plan, table))
    assert found["on"].false is not None
    assert found["early"].false is not None
    assert (found["on"].false.k, found["early"].false.k) == (0, 80)


def test_failures_are_counted_and_left_out_of_pairs(plan: Plan) -> None:
    table = rows(plan, lambda arm, _: arm == "shadow", lambda *_: None)
    broken = [
        Row(*(getattr(r, f) for f in Row.__struct_fields__[:8]), status="hang") if r.arm == "on" and r.seed < 5 else r
        for r in table
    ]
    on = overall(results_of(plan, broken))["on"]
    assert (on.failures, on.runs) == (10, 70)
    assert on.difference is not None
    assert (on.difference.n, on.prevented.n) == (35, 35)


def worse(before: list[Row], after: list[Row], plan: Plan) -> set[tuple[str, str, str]]:
    return {(c.scope.name, c.arm, c.metric) for c in compare((plan, before), (plan, after)).changes if c.worse}


def test_comparison_finds_what_got_worse_and_only_that(plan: Plan) -> None:
    def base(arm: str, seed: int) -> bool:
        return arm == "shadow" or seed % 4 == 0

    def gate(arm: str, seed: int) -> float | None:
        return 4.0 + 0.001 * seed if seed % 2 else None

    before = rows(plan, base, gate)
    assert worse(before, before, plan) == set()
    falls = rows(plan, lambda arm, seed: base(arm, seed) or (arm == "on" and seed < 20), gate)
    assert worse(before, falls, plan) == {("A1", "on", "accidents")}
    assert worse(falls, before, plan) == set()
    late = rows(plan, base, lambda arm, seed: None if (t := gate(arm, seed)) is None else t + 0.3 * (arm == "on"))
    assert worse(before, late, plan) == {("A1", "on", "lead-time")}
    eager = rows(plan, base, lambda arm, seed: 4.0 if arm == "on" else gate(arm, seed))
    assert ("A1", "on", "false-interventions") in worse(before, eager, plan)


def test_comparison_of_other_seeds_is_by_independent_samples() -> None:
    one = plan_of(parse_campaign(SPEC, "c"), Path(), Registry())
    two = plan_of(parse_campaign({**SPEC, "seed": 1000}, "c"), Path(), Registry())
    rng = random.Random(3)
    before = rows(one, lambda arm, seed: arm == "shadow" or rng.random() < 0.1, lambda *_: None)
    after = rows(two, lambda arm, seed: arm == "shadow" or rng.random() < 0.7, lambda *_: None)
    changes = compare((one, before), (two, after)).changes
    assert not any(c.paired for c in changes)
    assert {(c.arm, c.metric) for c in changes if c.worse} == {("on", "accidents"), ("early", "accidents")}
