"""Where Foreshock wins and loses, the traceability table and the Pareto front, on tables made for it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import wilcoxon
from statsmodels.stats.contingency_tables import mcnemar as sm_mcnemar
from statsmodels.stats.multitest import multipletests

from foreshock.campaign import Plan, Row, parse_campaign, plan_of
from foreshock.campaign.compare import compare
from foreshock.campaign.outcomes import Outcomes
from foreshock.campaign.panels import front_of
from foreshock.campaign.ranking import Duel, duels_of, standings_of
from foreshock.campaign.results import Scope, results_of
from foreshock.campaign.trace import Trace, traces_of
from foreshock.campaign.verdicts import bouts
from foreshock.registry import Registry

FALL, NOMINAL = "a1-fall-onto-human", "a1-fall-onto-human-nominal"
SPEC: dict[str, Any] = {
    "id": "c",
    "replicates": 30,
    "scenarios": [{"use": FALL}, {"use": NOMINAL}],
    "arms": [
        {"id": "none", "kind": "none"},
        {"id": "on", "kind": "on"},
        {"id": "baseline", "kind": "on", "acts_by": "action"},
        {"id": "narrow", "kind": "on", "acts_by": "action", "scenarios": [FALL]},
        {"id": "always", "kind": "always"},
    ],
}


@pytest.fixture(scope="module")
def plan() -> Plan:
    return plan_of(parse_campaign(SPEC, "c"), Path(), Registry())


def rows(plan: Plan, of: Callable[[str, str, int], tuple[bool, float | None, float]]) -> list[Row]:
    """A table: of(arm, scenario, seed) is whether it fell at 5 s, when it acted, and how long any action held."""
    made = []
    for c in plan.cases:
        fell, acted_s, held_s = of(c.arm, c.scenario, c.seed)
        at_s = 5.0 if fell else None
        common = (c.key, c.scenario, c.mode, c.arm, c.point, c.replicate, c.seed, c.parameters)
        made.append(
            Row(
                *common,
                accident=fell,
                accident_s=at_s,
                event_s=at_s,
                end_s=10.0,
                level=2 if acted_s is not None else 0,
                protective_s=acted_s,
                acted_s=acted_s,
                safe_s=None if fell else 6.0,
                reduced_s=held_s,
            )
        )
    return made


def story(arm: str, scenario: str, seed: int) -> tuple[bool, float | None, float]:
    """Foreshock saves 10 of 30 and never errs; the baseline saves all, earlier, and errs in every second run."""
    if scenario == NOMINAL:
        return False, (1.0 if arm == "baseline" and seed % 2 else None), (4.0 if arm == "baseline" else 0.5)
    if arm == "none":
        return True, None, 0.0
    if arm == "on":
        return seed < 20, 4.0 + 0.01 * seed, 5.0
    return False, 2.0, 8.0


def by(duels: list[Duel], rival: str) -> dict[str, Duel]:
    return {d.metric: d for d in duels if d.scope == Scope("overall") and d.rival == rival}


def test_foreshock_loses_where_another_arm_is_better(plan: Plan) -> None:
    table = rows(plan, story)
    duels = duels_of(plan, table)
    assert {d.arm for d in duels} == {"on"}
    baseline, none, always = (by(duels, rival) for rival in ("baseline", "none", "always"))
    verdicts = {metric: d.verdict for metric, d in baseline.items()}
    assert verdicts == {
        "accidents": "loses",
        "false interventions": "wins",
        "reduced speed": "wins",
        "lead time": "loses",
    }
    assert none["accidents"].verdict == "wins"
    # nobody decides in the other two: what they cost is not theirs
    assert set(none) == set(always) == {"accidents"}
    (bout,) = (b for b in bouts(duels, results_of(plan, table)) if b.scope.kind == "overall")
    assert any(line.startswith("baseline: accidents (67 against 0%)") for line in bout.loses)
    # the p values are those of the tests, adjusted for all of them together
    lead = [4.0 + 0.01 * seed - 2.0 for seed in range(30)]
    raw = {
        "accidents": sm_mcnemar([[0, 20], [0, 10]], exact=True).pvalue,
        "false interventions": sm_mcnemar([[0, 0], [15, 15]], exact=True).pvalue,
        "reduced speed": wilcoxon([0.35] * 30).pvalue,
        "lead time": wilcoxon(lead).pvalue,
    }
    # the narrow arm meets it only in the fall, and "none" and "always" in accidents; the only mode says all once more
    others = [raw["accidents"], raw["lead time"], sm_mcnemar([[20, 0], [10, 0]], exact=True).pvalue, raw["accidents"]]
    family = [*raw.values(), *others] * 2
    adjusted = multipletests(family, method="holm")[1]
    for metric, p in zip(raw, adjusted, strict=False):
        assert baseline[metric].p == pytest.approx(p, rel=1e-9)


def test_equal_arms_neither_win_nor_lose(plan: Plan) -> None:
    table = rows(plan, lambda arm, scenario, seed: (arm == "none" and scenario == FALL, None, 1.0))
    verdicts = {(d.rival, d.verdict) for d in duels_of(plan, table)}
    assert verdicts == {("none", "wins"), ("baseline", "open"), ("narrow", "open"), ("always", "open")}


def test_first_places_leave_out_what_ran_in_part_of_the_scenarios(plan: Plan) -> None:
    table = rows(plan, story)
    overall = standings_of(plan, results_of(plan, table))[0]
    assert overall.accidents[0] == ("baseline", "always")
    assert overall.false[0] == ("on",)
    assert overall.reduced[0] == ("on",)


def test_an_arm_that_is_not_done_yet_is_not_left_out(plan: Plan) -> None:
    """Cut short before the last scenario, "none" alone has all: that makes it no winner."""
    table = [r for r in rows(plan, story) if r.arm == "none" or r.scenario == FALL]
    overall = standings_of(plan, results_of(plan, table))[0]
    assert overall.accidents[0] == ("baseline", "always")


def test_what_an_arm_costs_and_how_long_until_it_is_safe(plan: Plan) -> None:
    found = {r.arm: r for r in results_of(plan, rows(plan, story)) if r.scope.kind == "overall"}
    assert found["on"].reduced is not None
    assert (found["on"].reduced.share, found["on"].reduced.n) == (pytest.approx(0.05), 30)
    assert found["baseline"].reduced is not None
    assert found["baseline"].reduced.share == pytest.approx(0.4)
    # ten runs without the accident: it acted at 4.2 to 4.29 s, and was safe from 6 s on
    assert found["on"].safe is not None
    assert found["on"].safe.values_s == pytest.approx(sorted(2.0 - 0.01 * seed for seed in range(20, 30)))
    for arm in ("none", "always"):
        assert found[arm].reduced is found[arm].safe is found[arm].false is None


def test_traceability_says_what_is_shown_and_what_is_not(plan: Plan) -> None:
    table = rows(plan, story)
    # of the arm always nothing in the nominal scenario was run
    table = [r for r in table if not (r.arm == "always" and r.scenario == NOMINAL)]
    traces = traces_of(plan, table, results_of(plan, table))
    verdict = {(t.scenario, t.arm): t.verdict for t in traces if t.mode == "A1"}
    assert verdict == {
        (FALL, "none"): "reference",
        (FALL, "on"): "fewer accidents",
        (FALL, "baseline"): "fewer accidents",
        (FALL, "narrow"): "fewer accidents",
        (FALL, "always"): "fewer accidents",
        (NOMINAL, "none"): "no harm",
        (NOMINAL, "on"): "no harm",
        (NOMINAL, "baseline"): "false interventions",
        (NOMINAL, "narrow"): "not applicable",
        (NOMINAL, "always"): "not shown",
    }
    rest = [t for t in traces if t.mode != "A1"]
    assert [t.mode for t in rest] == [f"A{k}" for k in range(2, 13)]
    assert all((t.verdict, t.scenario, t.planned) == ("not shown", "", 0) and "ISO 12100" in t.hazard for t in rest)

    def of(arm: str, scenario: str) -> Trace:
        return next(t for t in traces if (t.arm, t.scenario) == (arm, scenario))

    shows = {r.key: r for r in table}
    assert shows[of("on", FALL).key].accident
    assert Outcomes(plan, table).false(shows[of("baseline", NOMINAL).key])
    assert of("always", NOMINAL).planned == 30


def test_more_time_at_reduced_speed_is_worse_and_less_is_not(plan: Plan) -> None:
    before = rows(plan, story)
    slower = [msgspec.structs.replace(r, reduced_s=(r.reduced_s or 0.0) + 0.2) if r.arm == "on" else r for r in before]
    found = [c for c in compare((plan, before), (plan, slower)).changes if c.worse]
    assert [(c.arm, c.metric) for c in found] == [("on", "reduced-speed")]
    assert (found[0].before, found[0].after) == (pytest.approx(0.05), pytest.approx(0.07))
    assert not any(c.worse for c in compare((plan, slower), (plan, before)).changes)


@given(st.dictionaries(st.text(max_size=3), st.tuples(*[st.integers(0, 4).map(float)] * 2), min_size=1, max_size=8))
def test_the_front_beats_all_that_is_not_on_it(points: dict[str, tuple[float, float]]) -> None:
    front = front_of(points)

    def beats(a: tuple[float, float], b: tuple[float, float]) -> bool:
        return a != b and a[0] <= b[0] and a[1] <= b[1]

    for name, point in points.items():
        assert (name in front) != any(beats(points[other], point) for other in front)
