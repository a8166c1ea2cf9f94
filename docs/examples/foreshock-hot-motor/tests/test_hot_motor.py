"""The contract of every detector, and the physics of this one."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
import pytest
from foreshock_hot_motor import KIND, SPEC, Settings
from foreshock_hot_motor._detector import heated, time_to_trip_s

from foreshock.errors import ConfigError
from foreshock.messages import JointState
from foreshock.records import Sample
from foreshock.testing import DetectorConformance, Play, Rig

RATED_N_M, TAU_S = 50.0, 2.0
"""A small motor, so that a recording of seconds heats it."""
SETTINGS = Settings(rated_n_m={"knee": RATED_N_M, "hip": 80.0}, time_constant_s=TAU_S, start=0.0)
PERIOD_NS = 10_000_000


def walking(knee_n_m: Callable[[float], float], seconds: float, noise_n_m: float = 0.0) -> list[Sample]:
    """Joint states at 100 Hz; the hip idles at 10 N m."""
    rng = np.random.default_rng(3)
    out = []
    for k in range(round(seconds * 1e9) // PERIOD_NS):
        stamp_ns = PERIOD_NS * (k + 1)
        torques = (
            10.0 + noise_n_m * rng.standard_normal(),
            knee_n_m(stamp_ns / 1e9) + noise_n_m * rng.standard_normal(),
        )
        state = JointState(("hip", "knee"), (0.0, 0.6), (0.0, 0.0), tuple(map(float, torques)))
        out.append(Sample(stamp_ns, "talos/joints/state", state, k))
    return out


class TestHotMotor(DetectorConformance):
    """Everything that Foreshock asks of a detector; the tests are inherited."""

    spec = SPEC
    config = SETTINGS
    precursors = (KIND,)

    def recording(self) -> Sequence[Sample]:
        """The knee at 1.6 times its rated torque for 2 s, noisy, and then at rest."""
        return walking(lambda t: 80.0 if t < 2.0 else 5.0, 4.0, noise_n_m=1.0)


def play(samples: Sequence[Sample]) -> Play:
    return Rig(SPEC, SETTINGS, (KIND,)).play(samples)


def first_present_s(played: Play) -> float:
    return next(d.now_ns for d in played.decisions if any(i.present for i in d.indications)) / 1e9


@pytest.mark.parametrize("load", [1.2, 1.6, 3.0])
def test_onset_is_where_the_closed_form_has_it(load: float) -> None:
    """From cold, theta = k^2 (1 - exp(-t / tau)) reaches the limit at t = tau ln(k^2 / (k^2 - limit))."""
    expected_s = TAU_S * math.log(load**2 / (load**2 - SETTINGS.limit))
    onset_s = first_present_s(play(walking(lambda _: load * RATED_N_M, expected_s + 0.5)))
    # the first sample is the origin of time, and the onset falls on a sample
    assert 0.0 <= onset_s - PERIOD_NS / 1e9 - expected_s <= PERIOD_NS / 1e9


def test_rated_torque_for_ever_never_trips() -> None:
    assert heated(0.3, 1.0, 1e6, TAU_S) == pytest.approx(1.0, abs=1e-12)
    assert time_to_trip_s(0.99, 1.0, TAU_S) is None


def test_time_to_trip_agrees_with_the_heating() -> None:
    """Heating for the predicted time ends at 1: two formulas, one the inverse of the other."""
    for level, load in ((0.0, 1.1), (0.85, 1.6), (0.99, 4.0)):
        left_s = time_to_trip_s(level, load, TAU_S)
        assert left_s is not None
        assert heated(level, load, left_s, TAU_S) == pytest.approx(1.0, abs=1e-12)


def test_a_gap_in_the_stream_never_cools() -> None:
    """Without the samples of 0.3 s at full torque the onset comes no later."""
    samples = walking(lambda t: 80.0 if t < 2.0 else 5.0, 3.0)
    gap = [s for s in samples if not 0.5e9 < s.stamp_ns < 0.58e9]
    assert first_present_s(play(gap)) <= first_present_s(play(samples))


def test_a_joint_without_torque_is_unobserved() -> None:
    """A JointState may carry no efforts at all: then nothing is known, and nothing is said."""
    bare = JointState(("hip", "knee"), (0.0, 0.6))
    silent = [Sample(s.stamp_ns, s.channel, bare, s.seq) for s in walking(lambda _: 5.0, 1.0)]
    played = play(silent)
    assert all(d.indications == () for d in played.decisions)
    assert played.decisions[-1].trust.unobserved == (KIND.id,)


@pytest.mark.parametrize(
    ("settings", "place"),
    [
        ({"rated_n_m": {}}, "rated_n_m"),
        ({"rated_n_m": {"knee": 0.0}}, "rated_n_m.knee"),
        ({"rated_n_m": {"knee": math.nan}}, "rated_n_m.knee"),
        ({"limit": 1.0}, "limit"),
        ({"start": -0.1}, "start"),
        ({"time_constant_s": math.inf}, "time_constant_s"),
        ({"release": 0.0}, "release"),
    ],
)
def test_senseless_settings_are_refused(settings: dict[str, object], place: str) -> None:
    with pytest.raises(ConfigError, match=f"^{place}: "):
        Settings(**settings)  # type: ignore[arg-type] # wrong on purpose
