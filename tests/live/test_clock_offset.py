"""The offset of a source's clock: found within the transport's own scatter, and not fooled by one wrong stamp."""

from __future__ import annotations

import numpy as np
import pytest

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


def test_a_clock_set_back_makes_samples_old_until_it_has_been_steady() -> None:
    clock = ClockOffset(0.1, window_s=2.0)
    ages = []
    for k, (s, a) in enumerate(arrivals(np.random.default_rng(4))):
        found = clock.take(s - (3 * S if k >= 500 else 0), a)
        assert found is not None
        ages.append((a - found) / 1e9)
    assert min(ages[500:690]) > 2.9
    assert max(ages[730:]) < 0.05
