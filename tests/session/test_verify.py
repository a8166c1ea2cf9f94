"""Verification of an accident mode: what counts as found, ordered, early, false; and one small closed loop."""

from __future__ import annotations

import math

import pytest

from foreshock.records import Intervention
from foreshock.registry import Registry
from foreshock.session.rates import per_hour, wilson
from foreshock.session.run import Arm, Run
from foreshock.session.scenario import find_scenario, scenario_ids
from foreshock.session.scripted import held, moved
from foreshock.session.verify import Cascade, ModeResult, _cascade, _judged, plan_of, verify
from foreshock.twin import TwinEvent

SECOND = 1_000_000_000
SLIP, SPIKE, COM = "foot-micro-slip", "torso-angular-spike", "com-lateral-deviation"


def fell(at_s: float, first_s: dict[str, float], gate_s: float | None) -> Run:
    event = TwinEvent(round(at_s * 1e9), "fall-onto-human", "A1", 300.0, 280.0, "N")
    gates = {} if gate_s is None else {"protective": gate_s}
    return Run("s", "A1", "shadow", "p", 0, {}, True, event.id, (event,), at_s, first_s=first_s, gate_s=gates)


def test_a_cascade_is_found_before_the_accident_or_not_at_all() -> None:
    runs = [
        fell(5.0, {SLIP: 3.0, SPIKE: 3.5, COM: 4.0}, 4.0),
        fell(5.0, {SLIP: 3.0, SPIKE: 4.0, COM: 3.5}, 4.5),  # in another order
        fell(5.0, {SLIP: 3.0, SPIKE: 3.5, COM: 5.0}, 5.0),  # not before
        fell(5.0, {SLIP: 3.0}, None),
    ]
    found = _cascade("A1", runs)
    assert (found.found.k, found.found.n) == (2, 4)
    assert (found.ordered.k, found.ordered.n) == (1, 2)
    assert (found.gated.k, found.gated.n) == (2, 4)
    assert found.lead_s is not None
    assert found.lead_s[1] == pytest.approx(0.75)
    assert found.first_s == pytest.approx({SLIP: 0.0, SPIKE: 0.75, COM: 0.75})


def supervised(*changes: Intervention) -> Run:
    return Run("s", "A1", "on", "p", 0, {}, False, "none", (), 7.0, interventions=changes)


def test_the_same_actions_come_at_another_time_of_the_same_length() -> None:
    scenario = find_scenario("a1-fall-onto-human", Registry())
    run = supervised(Intervention(2 * SECOND, "balance-lock", 1.0), Intervention(5 * SECOND, "balance-lock", 0.0))
    starts = []
    for seed in range(200):
        on, off = moved(run.interventions, scenario.duration_s, seed)
        assert off.stamp_ns - on.stamp_ns == 3 * SECOND
        starts.append(on.stamp_ns / 1e9)
    # uniform over the scenario: mean within four standard errors of the middle
    assert sum(starts) / 200 == pytest.approx(
        scenario.duration_s / 2, abs=4 * scenario.duration_s / math.sqrt(12 * 200)
    )
    assert moved((), scenario.duration_s, 0) == ()


def test_always_on_is_every_action_at_its_strongest_from_the_start() -> None:
    run = supervised(
        Intervention(SECOND, "speed-scale", 0.2),
        Intervention(2 * SECOND, "speed-scale", 0.7),
        Intervention(3 * SECOND, "speed-scale", 0.0),
    )
    assert [(i.stamp_ns, i.action, i.strength) for i in held(run.interventions)] == [(0, "speed-scale", 0.7)]


def test_an_accident_of_another_mode_is_harm_that_was_caused() -> None:
    """A gripper that is opened too early drops what it holds; a touch is no accident."""
    plan = plan_of("A4", scenario_ids(Registry()))
    assert plan is not None
    touch = TwinEvent(SECOND, "touch", "", 2.0, 1.0, "N")
    drop = TwinEvent(2 * SECOND, "object-dropped", "A5", 1.0, 0.5, "1")

    def seen(arm: Arm, *events: TwinEvent) -> Run:
        return Run("s", "A4", arm, "p", 0, {}, False, "none", events, 10.0)

    shadow, on, harmless = seen("shadow", touch), seen("on", touch, drop), [seen("on", drop), seen("on", touch)]
    result = _judged(plan, 1, [shadow, on, *harmless], [seen("off"), seen("off")])
    assert (result.supervised.k, result.caused, result.harmed) == (0, 1, 1)


def test_what_was_never_run_misses_every_aim() -> None:
    nothing = wilson(0, 0)
    empty = Cascade(nothing, nothing, {}, nothing, None)
    result = ModeResult("A1", "s", nothing, nothing, 0, empty, per_hour(0, 0.0), 0, nothing, nothing, 0)
    assert len(result.missed()) == 5


def test_every_shipped_scenario_belongs_to_a_plan_and_a1_holds_on_two_seeds() -> None:
    known = scenario_ids(Registry())
    plan = plan_of("A1", known)
    assert plan is not None
    assert {s.expect for s in plan.harmless} == {"none"}
    (result,) = verify([plan], 2, 7, 0.0, workers=1)
    assert (result.unsupervised.k, result.supervised.k, result.failures) == (2, 0, 0)
