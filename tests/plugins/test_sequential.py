"""The shared sequential tests against tables, scipy and Monte Carlo."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import signal, stats

from foreshock_detectors import _sequential as sequential
from foreshock_detectors._sequential import (
    BandEnergy,
    Biquad,
    Cusum,
    EventWindow,
    Hysteresis,
    RunningMedian,
    WindowedNis,
    band_gain,
    chi2_quantile,
    chi2_tail,
    cusum_threshold,
    severity,
    siegmund_arl,
)


def test_everything_public_is_listed() -> None:
    assert list(sequential.__all__) == sorted(sequential.__all__)
    assert all(hasattr(sequential, name) for name in sequential.__all__)


# Montgomery, Introduction to Statistical Quality Control, table of two-sided CUSUM run lengths at k = 1/2:
# h = 4: 168 in control, 8.38 at one sigma, 3.34 at two; h = 5: 465, 10.4, 4.01. One-sided in control is twice that.
@pytest.mark.parametrize(
    ("h", "shift", "run_length"), [(4.0, 0.0, 336.0), (5.0, 0.0, 930.0), (4.0, 1.0, 8.38), (5.0, 1.0, 10.4)]
)
def test_siegmund_agrees_with_the_published_table(h: float, shift: float, run_length: float) -> None:
    assert siegmund_arl(h, 0.5, shift) == pytest.approx(run_length, rel=0.02)  # 2 %: the approximation's own error


def test_siegmund_is_continuous_where_drift_vanishes() -> None:
    assert siegmund_arl(5.0, 0.5, 0.5) == pytest.approx(siegmund_arl(5.0, 0.5, 0.5 + 1e-5), rel=1e-3)


@given(st.floats(50.0, 1e9), st.floats(0.1, 2.0))
def test_the_threshold_inverts_the_run_length(arl: float, k: float) -> None:
    h = cusum_threshold(arl, k)
    assert h >= 1.0
    if h > 1.0 + 1e-9:
        assert siegmund_arl(h, k) == pytest.approx(arl, rel=1e-6)


def test_cusum_keeps_its_false_alarm_rate() -> None:
    """Monte Carlo, 8e6 samples at a target of one alarm in 2000: the count's standard error is 1.6 %."""
    arl, k, clip, streams, steps = 2000.0, 0.5, 5.0, 400, 20_000
    h = cusum_threshold(arl, k)
    rng = np.random.default_rng(3)
    g, alarms = np.zeros(streams), 0
    for _ in range(steps):
        g = np.maximum(0.0, g + np.minimum(rng.standard_normal(streams), clip) - k)
        alarm = g >= h
        alarms += int(alarm.sum())
        g[alarm] = 0.0
    low, high = stats.poisson.interval(0.999, streams * steps / arl)
    assert 0.97 * low <= alarms <= 1.03 * high  # 3 %: what the approximation is off by in the table above, and more


def test_cusum_is_page_recursion() -> None:
    z = np.random.default_rng(0).normal(0.3, 1.0, 500)
    cusum, walk = Cusum(0.5, 1e9), np.concatenate([[0.0], np.cumsum(z - 0.5)])
    for i, value in enumerate(z):
        cusum.push(float(value))
        # Closed form of the recursion: the walk over its running minimum.
        assert cusum.value == pytest.approx(walk[i + 1] - walk[: i + 2].min(), abs=1e-9)


def test_cusum_needs_more_than_one_outlier_and_treats_nan_as_alarm() -> None:
    cusum = Cusum(0.5, 13.0, 5.0)
    assert [cusum.push(1e9) for _ in range(3)] == [False, False, True]
    cusum.restart()
    assert not cusum.push(0.0)
    assert cusum.push(math.nan)


@given(st.integers(1, 30), st.floats(0.1, 120.0))
def test_chi_square_tail_agrees_with_scipy(half: int, x: float) -> None:
    assert chi2_tail(x, 2 * half) == pytest.approx(stats.chi2.sf(x, 2 * half), rel=1e-9, abs=1e-300)


@pytest.mark.parametrize("tail", [0.5, 1e-3, 1e-9])
def test_chi_square_quantile_agrees_with_scipy(tail: float) -> None:
    assert chi2_quantile(tail, 24) == pytest.approx(stats.chi2.isf(tail, 24), rel=1e-9)


@pytest.mark.parametrize("dof", [0, 3, -2])
def test_chi_square_refuses_odd_degrees(dof: int) -> None:
    with pytest.raises(ValueError, match=str(dof)):
        chi2_tail(1.0, dof)


def test_windowed_nis_threshold_and_false_alarm_rate() -> None:
    tail = 0.05
    nis = WindowedNis(arl=25 / tail**2)
    assert nis.threshold == pytest.approx(stats.chi2.isf(tail, 24) / 24, rel=1e-9)
    blocks, pairs = 12_000, 0
    for block in np.random.default_rng(5).standard_normal((blocks, 25)):
        for z in block:
            exceeded = nis.push(float(z))
        pairs += exceeded
    low, high = stats.poisson.interval(0.999, 1.1 * blocks * tail**2)  # pairs overlap: variance 1 + 2p of Poisson's
    assert low <= pairs <= high


def test_windowed_nis_finds_scatter_but_neither_step_nor_drift() -> None:
    rng = np.random.default_rng(1)
    quiet = rng.standard_normal(500)
    step = quiet + np.where(np.arange(500) > 260, 4.0, 0.0)
    drift = quiet + 0.02 * np.arange(500)
    loud = quiet * np.where(np.arange(500) > 250, 3.0, 1.0)

    def found(series: np.ndarray) -> int:
        nis = WindowedNis(arl=36e6, least=4.0)
        return next((i for i, z in enumerate(series) if nis.push(float(z))), -1)

    assert found(quiet) == found(step) == found(drift) == -1
    assert 250 < found(loud) <= 250 + 75  # two full blocks, begun at worst one block late


@pytest.mark.parametrize(("kind", "corner"), [("low", 40.0), ("high", 3.0)])
def test_biquad_agrees_with_scipy(kind: str, corner: float) -> None:
    x = np.random.default_rng(2).standard_normal(400)
    b, a = signal.butter(2, corner, kind, fs=500.0)
    biquad = Biquad(kind, corner, 500.0)
    np.testing.assert_allclose([biquad.push(float(v)) for v in x], signal.lfilter(b, a, x), atol=1e-10)


@pytest.mark.parametrize("rate", [100.0, 1000.0])
def test_band_gain_agrees_with_the_frequency_response(rate: float) -> None:
    high = signal.butter(2, 3.0, "high", fs=rate, output="sos")
    low = signal.butter(2, 40.0, "low", fs=rate, output="sos")
    _, response = signal.freqz_sos(np.vstack([high, low]), worN=200_000)
    assert band_gain(3.0, 40.0, rate) == pytest.approx(np.mean(np.abs(response) ** 2), rel=1e-3)


@pytest.mark.parametrize("frequency", [6.0, 10.0, 20.0])
def test_band_energy_of_a_sine_on_an_offset(frequency: float) -> None:
    rate, amplitude, tau = 1000.0, 0.8, 0.25
    band = BandEnergy(3.0, 40.0, rate, tau)
    out = [band.push(25.0 + amplitude * math.sin(2 * math.pi * frequency * i / rate)) for i in range(3000)]
    gain = 1.0 / math.sqrt((1 + (3.0 / frequency) ** 4) * (1 + (frequency / 40.0) ** 4))  # Butterworth, second order
    ripple = 1.0 / (4 * math.pi * frequency * tau)  # of the exponential window at twice the frequency
    assert out[-1] == pytest.approx(gain * amplitude / math.sqrt(2), rel=ripple + 0.02)


def test_band_energy_is_blind_to_offset_and_to_one_spike() -> None:
    band = BandEnergy(3.0, 40.0, 200.0, 0.25)
    assert max(band.push(20.0 + (5.0 if i == 100 else 0.0)) for i in range(300)) == 0.0


def test_running_median_follows_a_skewed_stream() -> None:
    x = np.random.default_rng(7).gamma(2.0, 1e-3, 20_000)
    tracker, medians, mads = RunningMedian(1e-9), [], []
    for v in x:
        tracker.push(float(v))
        if tracker.ready:
            medians.append(tracker.value)
            mads.append(tracker.mad)
    assert np.mean(medians[5000:]) == pytest.approx(np.median(x), rel=0.03)
    assert np.mean(mads[5000:]) == pytest.approx(np.median(np.abs(x - np.median(x))), rel=0.05)


@given(st.lists(st.floats(-1e3, 1e3), min_size=9, max_size=9), st.floats(1e6, 1e300))
def test_running_median_starts_exact_and_bounds_an_outlier(values: list[float], outlier: float) -> None:
    tracker = RunningMedian(1e-3, start=9)
    for v in values:
        tracker.push(v)
    assert tracker.value == np.median(values)
    before, mad = tracker.value, tracker.mad
    tracker.push(outlier)
    assert 0.0 <= tracker.value - before <= 0.02 * mad * 1.0001 + 1e-9


def test_hysteresis_holds_dwells_and_closes_on_nan() -> None:
    h = Hysteresis(2.0, 1.0, hold_ns=10)
    seen = [h.push(x, t) for x, t in ((1.9, 0), (2.0, 1), (1.5, 50), (0.5, 55), (0.5, 60))]
    assert seen == [False, True, True, True, False]
    assert h.push(math.nan, 70)
    slow = Hysteresis(2.0, 1.0, hold_ns=0, dwell_ns=5)
    assert [slow.push(x, t) for x, t in ((3.0, 0), (3.0, 4), (3.0, 5))] == [False, False, True]
    slow.restart()
    assert not slow.push(3.0, 6)


def test_event_window_counts_the_last_span() -> None:
    window = EventWindow(10)
    for t in (0, 5, 9):
        window.add(t)
    assert [window.count(t) for t in (9, 10, 15, 19)] == [3, 2, 1, 0]
    window.add(20)
    window.restart()
    assert window.count(20) == 0


@given(st.floats(-10.0, 10.0), st.floats(-10.0, 10.0))
def test_severity_is_bounded_and_monotone(a: float, b: float) -> None:
    low, high = sorted((a, b))
    assert 0.0 <= severity(low, 1.0, 3.0) <= severity(high, 1.0, 3.0) <= 1.0
    assert severity(2.0, 1.0, 3.0) == 0.5
    assert severity(math.nan, 1.0, 3.0) == 1.0
