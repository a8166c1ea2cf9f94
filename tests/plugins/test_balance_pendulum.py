"""Predicted times of the linear inverted pendulum, against its numerical integration."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from foreshock_detectors.balance._lipm import capture_time_s, crossing_time_s, natural_frequency, time_to_fall_s

HULL = [(-0.105, -0.145), (0.10, -0.145), (0.10, 0.145), (-0.105, 0.145)]
W0 = st.floats(2.8, 3.6)


def integrate(c: float, v: float, p: float, w0: float, event, t_end: float = 5.0) -> float:
    event.terminal = True
    solution = solve_ivp(
        lambda t, s: (s[1], w0 * w0 * (s[0] - p)), (0, t_end), (c, v), events=event, rtol=1e-10, atol=1e-12
    )
    return float(solution.t_events[0][0]) if len(solution.t_events[0]) else math.inf


@given(W0, st.floats(0.001, 0.2), st.floats(-0.2, -0.001))
def test_crossing_time_is_that_of_the_integrated_pendulum(w0, outside, com):
    velocity = (outside - com) * w0
    expected = integrate(com, velocity, 0.0, w0, lambda t, s: s[0])
    # event location of solve_ivp: about 1e-8 s at these tolerances
    assert crossing_time_s(0.3 + com, velocity, 0.3, 0.3, w0) == pytest.approx(expected, abs=1e-6)


@given(W0, st.floats(0.001, 0.2), st.floats(0.0, 0.2), st.floats(-0.2, -0.001))
def test_crossing_time_with_the_centre_of_pressure_short_of_the_edge(w0, outside, short, com):
    velocity = (outside - com) * w0
    expected = integrate(com, velocity, -short, w0, lambda t, s: s[0])
    assert crossing_time_s(0.3 + com, velocity, 0.3 - short, 0.3, w0) == pytest.approx(expected, abs=1e-6)


@given(W0, st.floats(-0.2, -0.001), st.floats(0.0, 0.2))
def test_the_centre_of_mass_never_crosses_while_the_capture_point_is_inside(w0, com, inside):
    velocity = (-inside - com) * w0
    time_s = crossing_time_s(com, velocity, 0.0, 0.0, w0)
    # exactly at the edge rounding decides; then the crossing is at least some 17 time constants of w0 away
    assert time_s > 2.5
    assert crossing_time_s(0.01, 0.0, 0.0, 0.0, w0) == 0.0


@given(W0, st.floats(0.005, 0.08), st.floats(0.081, 0.3), st.sampled_from([1.0, -1.0]))
def test_capture_time_is_that_of_the_integrated_pendulum(w0, start, edge, side):
    velocity = 0.1
    com = side * start - velocity / w0
    expected = integrate(com, velocity, 0.0, w0, lambda t, s: side * (s[0] + s[1] / w0) - edge)
    assert capture_time_s(0.5 + side * start, 0.5, 0.5 + side * edge, w0) == pytest.approx(expected, abs=1e-6)


def test_capture_time_limits():
    assert capture_time_s(0.2, 0.0, 0.1, 3.3) == 0.0
    assert capture_time_s(-0.01, 0.0, 0.1, 3.3) == math.inf
    assert capture_time_s(0.0, 0.0, 0.1, 3.3) == math.inf


@given(W0, st.floats(-0.08, 0.08), st.floats(-0.12, 0.12), st.floats(-0.7, 0.7), st.floats(-0.7, 0.7))
def test_a_fall_is_predicted_exactly_when_the_capture_point_is_outside_and_the_pendulum_falls(w0, x, y, vx, vy):
    time_s = time_to_fall_s(HULL, HULL, (x, y), (vx, vy), w0, 0.005, 10.0)
    cx, cy = x + vx / w0, y + vy / w0
    px, py = min(max(cx, -0.105), 0.10), min(max(cy, -0.145), 0.145)
    distance = math.hypot(cx - px, cy - py)
    if distance < 0.0049:
        assert time_s is None
    elif distance > 0.0051:
        nx, ny = (cx - px) / distance, (cy - py) / distance
        expected = integrate(nx * (x - px) + ny * (y - py), nx * vx + ny * vy, 0.0, w0, lambda t, s: s[0], t_end=12.0)
        assert time_s == pytest.approx(expected, abs=1e-5)


def test_no_other_centre_of_pressure_in_the_hull_delays_the_fall():
    w0, com, velocity = 3.3, 0.05, 0.4
    best = time_to_fall_s(HULL, HULL, (0.0, com), (0.0, velocity), w0, 0.005, 10.0)
    assert best is not None
    for cop in (-0.145, 0.0, 0.085, 0.14):
        assert integrate(com, velocity, cop, w0, lambda t, s: s[0] - 0.145) < best


def test_on_the_far_foot_the_fall_comes_sooner():
    """In single support on the right foot the centre of pressure gets no farther than its inner edge, y = -25 mm."""
    right = [(-0.105, -0.145), (0.10, -0.145), (0.10, -0.025), (-0.105, -0.025)]
    w0, com, velocity = 3.3, 0.05, 0.4
    time_s = time_to_fall_s(HULL, right, (0.0, com), (0.0, velocity), w0, 0.005, 10.0)
    assert time_s == pytest.approx(integrate(com, velocity, -0.025, w0, lambda t, s: s[0] - 0.145), abs=1e-6)


def test_a_fall_beyond_the_horizon_is_not_predicted():
    assert time_to_fall_s(HULL, HULL, (0.0, 0.0), (0.0, 0.151 * 3.3), 3.3, 0.005, 0.3) is None


def test_natural_frequency_of_the_pendulum():
    assert natural_frequency(0.87, 9.81) == pytest.approx(3.358, abs=5e-4)
    with pytest.raises(ValueError, match="above the soles"):
        natural_frequency(-0.1, 9.81)
