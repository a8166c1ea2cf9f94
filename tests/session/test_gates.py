"""Gates compared: what opens, what is counted, and one small comparison in closed loop."""

from __future__ import annotations

import math

import msgspec
import pytest
from scipy.stats import poisson

from foreshock.records import Intervention
from foreshock.registry import Registry
from foreshock.session.gates import compare_gates, drawn, opened
from foreshock.session.rates import per_hour
from foreshock.session.run import Run
from foreshock.session.scenario import find_scenario

SECOND = 1_000_000_000


def test_a_gate_opens_when_the_first_action_begins() -> None:
    changes = (
        Intervention(0, "speed-scale", 0.5),  # of no mode: not the gate
        Intervention(SECOND, "step-suppression", 1.0, "A1"),
        Intervention(SECOND, "balance-lock", 1.0, "A1"),
        Intervention(2 * SECOND, "step-suppression", 0.0, "A1"),
        Intervention(3 * SECOND, "balance-lock", 0.0, "A1"),
        Intervention(4 * SECOND, "step-suppression", 0.3, "A1"),
    )
    run = Run("s", "A1", "on", "p", 0, {}, False, "none", (), 5.0, interventions=changes)
    assert opened(run) == [1.0, 4.0]


@pytest.mark.parametrize(("k", "hours"), [(0, 1.0), (3, 2.0)])
def test_the_rate_per_hour_has_the_exact_poisson_interval(k: int, hours: float) -> None:
    found = per_hour(k, hours)
    rate, low, high = found.per_hour, found.low, found.high
    assert rate == k / hours
    # by its definition: at each end what was seen, or more extreme, has a probability of 2.5%
    assert poisson.cdf(k, high * hours) == pytest.approx(0.025)
    if k:
        assert poisson.sf(k - 1, low * hours) == pytest.approx(0.025)
    else:
        assert low == 0.0


def test_parameters_are_drawn_from_the_seed_alone() -> None:
    ranges = {"drop_mu": (0.03, 0.07), "drop_duration": (0.1, 0.6)}
    assert drawn(ranges, 3) == drawn(dict(reversed(ranges.items())), 3) != drawn(ranges, 4)
    assert all(low <= drawn(ranges, s)[n] <= high for s in range(50) for n, (low, high) in ranges.items())


def test_the_lift_opens_no_later_than_the_independent_model_on_the_same_seeds() -> None:
    """Three seeds of A1: the order of openings is certain, who falls is for the full comparison to say."""
    registry = Registry()
    scenario = find_scenario("a1-fall-onto-human", registry)
    calm = msgspec.structs.replace(find_scenario("a1-fall-onto-human-nominal", registry), duration_s=3.0)
    independent, correlated, _ = compare_gates(scenario, [calm], range(3), range(1), {}, workers=2)
    assert independent.failures == correlated.failures == 0
    assert len(independent.lead_s) == len(correlated.lead_s) > 0
    assert all(c >= i for c, i in zip(correlated.lead_s, independent.lead_s, strict=True))
    assert correlated.nominal_opened == 0
    assert math.isclose(correlated.nominal_h, 3.0 / 3600.0)
