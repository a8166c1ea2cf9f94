"""Oscillation amplitude and its nominal value, on closed-form signals."""

from __future__ import annotations

import itertools
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from foreshock_detectors.balance import BalanceConfig
from foreshock_detectors.balance._sway import NominalAmplitude, Swing

WINDOW_S = 1.2


def amplitudes(signal, t_end, rate_hz=200.0):
    swing = Swing(WINDOW_S, 0.005)
    return [swing.update(round(k / rate_hz * 1e9), signal(k / rate_hz)) for k in range(round(t_end * rate_hz))]


@given(st.floats(0.004, 0.2), st.floats(0.3, 1.1), st.floats(-3.0, 3.0), st.sampled_from([100.0, 200.0, 1000.0]))
def test_a_sine_has_its_peak_to_peak_amplitude_at_any_rate(amplitude, period_s, phase, rate_hz):
    seen = amplitudes(lambda t: 0.3 + amplitude * math.sin(2 * math.pi * t / period_s + phase), 4.0, rate_hz)
    # both peaks are sampled with at most half a period of error in time: 1 - cos(pi / (T rate)) of the amplitude each
    tolerance = 2 * amplitude * (1 - math.cos(math.pi / (period_s * rate_hz))) + 1e-9
    assert seen[-1] == pytest.approx(2 * amplitude, abs=tolerance)


def test_an_excursion_that_does_not_come_back_has_the_amplitude_of_what_came_back():
    """Out by 80 mm, back by 10 mm, and on by 100 mm: the largest oscillation is 10 mm."""
    corners = [(0.0, 0.0), (0.2, -0.01), (0.6, 0.08), (0.8, 0.07), (1.2, 0.17), (2.0, 0.17)]

    def path(t):
        for (a, x), (b, y) in itertools.pairwise(corners):
            if t <= b:
                return x + (y - x) * (t - a) / (b - a)
        return corners[-1][1]

    assert max(amplitudes(path, 2.0)) == pytest.approx(0.01, abs=1e-9)


def test_a_slow_shift_there_and_back_is_no_sway():
    assert max(amplitudes(lambda t: 0.1 * math.sin(2 * math.pi * t / 3.0), 9.0)) == 0.0


def test_an_oscillation_is_forgotten_after_the_window():
    seen = amplitudes(lambda t: 0.03 * math.sin(2 * math.pi * t / 0.6) if t < 1.8 else 0.0, 4.0)
    assert seen[round(1.8 * 200)] == pytest.approx(0.06, rel=1e-3)
    # the last turning point between two half swings lies at 1.65 s
    assert seen[round((1.65 + WINDOW_S) * 200) + 2] == pytest.approx(0.0)


def test_noise_below_the_reversal_makes_no_oscillation():
    assert max(amplitudes(lambda t: 0.0024 * (-1) ** round(200 * t), 3.0)) == 0.0


def test_the_nominal_amplitude_is_the_median_within_its_limits():
    config = BalanceConfig()

    def learn(values):
        nominal = NominalAmplitude(config, 0.05)
        for k, value in enumerate(values):
            nominal.update(k * 60_000_000, value)
        return nominal.value

    assert learn([0.01] * 99) == 0.05
    assert learn([0.06] * 60 + [0.3] * 39) == 0.06
    assert learn([0.3] * 99) == pytest.approx(1.5 * 0.05)
    # six seconds are learned, not more
    assert learn([0.06] * 101 + [0.07] * 500) == 0.06
