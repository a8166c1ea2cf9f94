"""The two forms of the force filter against each other and against the model they assume."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from foreshock_detectors.grip._filter import FilterpyForceFilter, ForceFilter, ScalarForceFilter, force_filter

steps = st.tuples(
    st.floats(-50.0, 50.0),  # z
    st.floats(5e-4, 0.05),  # dt
    st.floats(0.0, 2.0),  # h: free fall .. 2 g
    st.floats(1e-4, 1.0),  # r
    st.floats(1e-2, 1e4),  # q
)


@settings(max_examples=60, deadline=None)
@given(st.lists(steps, min_size=1, max_size=30), st.sampled_from([5.0, 1e9]))
def test_scalar_and_filterpy_agree(sequence: list[tuple[float, ...]], gate: float) -> None:
    own, reference = ScalarForceFilter(), FilterpyForceFilter()
    for f in (own, reference):
        f.restart(sequence[0][0], 0.01)
    for z, dt, h, r, q in sequence:
        expected = reference.step(z, dt, h, r, q, gate)
        # The two round differently; errors grow with the condition of P, some 1e4 / 1e-4 here.
        assert own.step(z, dt, h, r, q, gate) == pytest.approx(expected, rel=1e-5, abs=1e-6)
        assert own.force == pytest.approx(reference.force, rel=1e-5, abs=1e-6)
        assert own.rate == pytest.approx(reference.rate, rel=1e-5, abs=1e-5)
        assert own.force_variance == pytest.approx(reference.force_variance, rel=1e-5)


@pytest.mark.parametrize("backend", ["scalar", "filterpy"])
def test_innovations_are_white_and_normal_under_the_model(backend: str) -> None:
    """Truth drawn from the filter's own model, so that sum of z^2 is chi-square and z is uncorrelated."""
    rng, n, dt, q, sigma = np.random.default_rng(11), 4000, 0.005, 4.0, 0.05
    noise = np.linalg.cholesky(q * np.array([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]]))
    x, f = np.array([10.0, 0.0]), force_filter(backend)  # type: ignore[arg-type]
    f.restart(10.0, sigma**2)
    z = []
    for _ in range(n):
        x = np.array([x[0] + dt * x[1], x[1]]) + noise @ rng.standard_normal(2)
        h = 1.0 + 0.2 * float(rng.standard_normal())
        z.append(f.step(float(h * x[0] + sigma * rng.standard_normal()), dt, h, sigma**2, q, 1e9))
    tail = np.array(z[200:])
    low, high = stats.chi2.interval(0.999, len(tail))
    assert low < float(tail @ tail) < high
    assert abs(float(tail[1:] @ tail[:-1])) / len(tail) < 3.3 / np.sqrt(len(tail))
    assert f.force == pytest.approx(x[0], abs=5 * np.sqrt(f.force_variance))


def test_an_outlier_bends_the_estimate_by_no_more_than_the_gate() -> None:
    def settled() -> ForceFilter:
        f = ScalarForceFilter()
        f.restart(10.0, 0.0025)
        for _ in range(500):
            f.step(10.0, 0.001, 1.0, 0.0025, 1.0, 5.0)
        return f

    spike, five_sigma = settled(), settled()
    z = spike.step(-1e6, 0.001, 1.0, 0.0025, 1.0, 5.0)
    assert z < -1e6  # what is reported is not cut
    root = (five_sigma.force_variance + 0.0025) ** 0.5
    five_sigma.step(10.0 - 5.0 * root, 0.001, 1.0, 0.0025, 1.0, 5.0)
    assert spike.force == pytest.approx(five_sigma.force, abs=1e-3)


def test_free_fall_tells_nothing_about_the_weight() -> None:
    f = ScalarForceFilter()
    f.restart(10.0, 0.0025)
    f.step(0.0, 0.001, 0.0, 0.0025, 1.0, 5.0)
    assert f.force == 10.0
