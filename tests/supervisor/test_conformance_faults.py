"""Faults change what they say they change, and nothing else."""

from __future__ import annotations

import math
from collections import Counter

from hypothesis import given
from hypothesis import strategies as st

from foreshock.messages import Capsule, HumanPose, Humans, JointState, Scalar, is_finite
from foreshock.records import Sample
from foreshock.testing import disordered, duplicated, not_a_number, silenced, spoiled
from foreshock.testing.rig import arrival_ns

streams = st.lists(st.tuples(st.integers(0, 50), st.sampled_from("ab")), max_size=40).map(
    lambda steps: [
        Sample(1000 * k + late, f"talos/x/{name}", Scalar(float(k)), k, 1000 * k + late)
        for k, (late, name) in enumerate(steps)
    ]
)


@given(streams)
def test_disorder_keeps_every_measurement_and_the_order_of_arrival(samples: list[Sample]) -> None:
    out = disordered(samples)
    assert Counter((s.stamp_ns, s.channel, s.seq) for s in out) == Counter(
        (s.stamp_ns, s.channel, s.seq) for s in samples
    )
    assert [arrival_ns(s) for s in out] == sorted(arrival_ns(s) for s in out)
    assert all(arrival_ns(s) >= s.stamp_ns for s in out)  # nothing arrives before it was measured


def test_disorder_lets_every_second_sample_overtake() -> None:
    samples = [Sample(k, "talos/x/a", Scalar(0.0), k, k) for k in range(1, 5)]
    assert [s.stamp_ns for s in disordered(samples)] == [2, 1, 4, 3]


@given(streams, st.integers(0, 40_000))
def test_silence_begins_after_the_instant(samples: list[Sample], from_ns: int) -> None:
    out = silenced(samples, "talos/x/a", from_ns)
    assert all(s.channel == "talos/x/b" or arrival_ns(s) <= from_ns for s in out)
    assert [s for s in samples if s.channel == "talos/x/b"] == [s for s in out if s.channel == "talos/x/b"]


@given(streams)
def test_duplicates_follow_their_original(samples: list[Sample]) -> None:
    assert list(duplicated(samples))[::2] == samples
    assert list(duplicated(samples))[1::2] == samples


def test_every_float_becomes_nan_and_nothing_else() -> None:
    state = not_a_number(JointState(("knee",), (0.1,), (), (5.0,)))
    assert isinstance(state, JointState)
    assert state.name == ("knee",)
    assert all(map(math.isnan, (*state.position, *state.effort)))
    human = HumanPose("h1", (Capsule("chest", (0.0, 0.0, 1.0), (0.0, 0.0, 1.4), 0.2),))
    spoilt = not_a_number(Humans((human,)))
    assert isinstance(spoilt, Humans)
    assert spoilt.humans[0].id == "h1"
    assert spoilt.humans[0].velocity is None
    assert not is_finite(spoilt)


def test_a_message_without_numbers_is_dropped_when_spoilt() -> None:
    samples = [Sample(1, "talos/humans/pose", Humans(()), 0), Sample(2, "talos/humans/pose", Humans(()), 1)]
    assert spoiled(samples, "talos/humans/pose", 1) == (samples[0],)
