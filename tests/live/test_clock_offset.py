"""The offset of a source's clock: found within the transport's own scatter, and not fooled by one wrong stamp."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from foreshock.live._clock import ClockOffset

MS = 1_000_000
S = 1_000_000_000


def arrivals(rng: np.random.Generator, n: int = 1000) -> list[tuple[int, int]]:
    """Stamps every 10 ms of a clock that is 5 s behind, and arrivals 0.2 ms and an exponential 2 ms later."""
    return [(k * 10 * MS - 5 * S, k * 10 * MS + 200_000 + round(2 * MS * rng.exponential())) for k in range(1, n)]


def test_the_offset_is_that_of_the_fastest_sample() -> None:
    clock = ClockOffset(0.1)
    for stamp, arrival in arrivals(np.random.default_rng(1)):
        found = clock.take(stamp, arrival)
        assert found is not None
        assert found <= arrival
    assert clock.offset_ns is not None
    # the least of 200 exponentials of 2 ms is below 0.1 ms but for one in 20,000
    assert clock.offset_ns == pytest.approx(5 * S + 200_000, abs=0.2 * MS)
    assert clock.jumps == 0


def test_one_stamp_in_the_future_does_not_make_the_others_old() -> None:
    clock = ClockOffset(0.1)
    seen = arrivals(np.random.default_rng(2))
    for k, (stamp, arrival) in enumerate(seen):
        if k == 500:
            assert clock.take(stamp + 3 * S, arrival) is None
        found = clock.take(stamp, arrival)
        assert found is not None
        assert arrival - found < 50 * MS


def test_a_clock_set_forward_is_believed_again_when_it_has_been_steady() -> None:
    clock = ClockOffset(0.1, window_s=2.0)
    believed = [
        clock.take(s + (3 * S if k >= 500 else 0), a) for k, (s, a) in enumerate(arrivals(np.random.default_rng(3)))
    ]
    assert all(b is not None for b in believed[:500])
    silent = [b is None for b in believed[500:]]
    assert silent.index(False) == pytest.approx(200, abs=2)
    assert not any(silent[210:])
    assert clock.jumps == 1


def test_a_clock_set_back_makes_samples_old_for_good() -> None:
    """A delay that came at once looks the same: what would be believed again by itself would take old data for new."""
    clock = ClockOffset(0.1, window_s=2.0)
    ages = []
    for k, (s, a) in enumerate(arrivals(np.random.default_rng(4), 3000)):
        found = clock.take(s - (3 * S if k >= 500 else 0), a)
        assert found is not None
        ages.append((a - found) / 1e9)
    # 25 s later a clock's drift explains 25 ms of them
    assert min(ages[500:]) > 2.97
    assert clock.delay_ns == pytest.approx(2.975 * S, abs=5 * MS)


@pytest.mark.parametrize("seconds", [21, 120])
@pytest.mark.parametrize("growth", [0.03, 0.05])
def test_a_delay_that_grows_is_age(growth: float, seconds: int) -> None:
    """A slow reader: nothing is lost, nothing is out of order, and everything is ever older."""
    clock, least_ns = ClockOffset(0.1), S
    for s, a in arrivals(np.random.default_rng(5), 100 * seconds):
        delay = round(growth * (s + 5 * S))
        found = clock.take(s, a + delay)
        assert found is not None
        true_ns, believed_ns = a + delay - s - 5 * S, a + delay - found
        least_ns = min(least_ns, true_ns)
        # the fastest transport so far, and what drift may explain since the first sample
        assert true_ns - believed_ns <= least_ns + 1e-3 * (a + delay)
    # it is the least within the window and a step of it, less drift
    assert clock.delay_ns > (growth * (seconds - 2.25) - 1e-3 * seconds * (1.0 + growth)) * S - least_ns
    assert clock.jumps == 0


def test_a_clock_that_drifts_is_believed() -> None:
    """Half a millisecond a second is what NTP slews by; half an hour of it makes no sample old."""
    clock = ClockOffset(0.1)
    for s, a in arrivals(np.random.default_rng(6), 180_000):
        lost = round(0.5e-3 * (s + 5 * S))
        found = clock.take(s - lost, a)
        assert found is not None
        # its own transport, and at most what the clock lost within the window and a step of it
        assert a - found <= a - s - 5 * S + 1.2 * MS
    assert clock.delay_ns <= 1.2 * MS


@given(
    st.lists(st.tuples(st.integers(0, 10 * S), st.integers(0, 5 * S)), min_size=1, max_size=60),
    st.integers(-(10**18), 10**18),
)
def test_no_sample_is_believed_younger_than_drift_and_the_fastest_transport_explain(
    steps: list[tuple[int, int]], offset: int
) -> None:
    """Age by the estimate >= true age - (transport of any believed sample before + 1 ms per second since it)."""
    clock, sent_ns, seen, arrival_ns = ClockOffset(0.1), 0, list[tuple[int, int]](), 0
    for step_ns, transport_ns in steps:
        sent_ns += step_ns
        arrival_ns = max(arrival_ns, sent_ns + transport_ns)
        true_ns = arrival_ns - sent_ns
        found = clock.take(sent_ns - offset, arrival_ns)
        if found is None:
            continue
        seen.append((arrival_ns, true_ns))
        explained = min(t_ns + 1e-3 * (arrival_ns - at_ns) for at_ns, t_ns in seen)
        assert arrival_ns - found >= true_ns - explained - 1e-3  # rounding of a double of this size
