"""The actuators detector: fires on its definitions, is silent on their look-alikes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import msgspec
import pytest
from actuator_stream import stream

from foreshock.detector import Inputs
from foreshock.errors import ConfigError
from foreshock.records import Indication, Sample
from foreshock_detectors.actuators import SPEC, ActuatorsConfig

SATURATION, DRIFT = SPEC.kinds


def play(rows: Sequence[Sequence[Sample]], config: ActuatorsConfig | None = None) -> list[dict[str, Indication]]:
    detector = SPEC.build(config or ActuatorsConfig())
    out = []
    for state, order in rows:
        inputs = Inputs({"joints": state, "command": order}, {"joints": (state,), "command": (order,)})
        out.append({i.kind: i for i in detector.update(state.stamp_ns, inputs)})
    return out


def present(history: Sequence[dict[str, Indication]]) -> set[str]:
    return {kind for said in history for kind, i in said.items() if i.present}


def first(history: Sequence[dict[str, Indication]], kind: str) -> float:
    return next(k for k, said in enumerate(history) if said[kind].present) * 0.02


def falls(at: float, to: float, start: float = 57.6):
    return lambda t: start if t < at else to


def test_limit_that_falls_below_the_load_is_saturation_within_three_samples() -> None:
    history = play(stream(3.0, limit=falls(1.0, 20.0)))
    assert present(history) == {SATURATION}
    assert first(history, SATURATION) == pytest.approx(1.04)
    assert history[-1][SATURATION].measures["owed"] == pytest.approx(5.0 / 57.6, abs=0.03)


def test_torque_at_the_rated_peak_is_saturation_even_if_the_command_is_clipped_too() -> None:
    assert present(play(stream(3.0, torque=lambda t: 57.6 if t > 1.0 else 25.0))) == {SATURATION}


def test_negative_torque_counts_alike() -> None:
    assert present(play(stream(3.0, torque=lambda _: -25.0, limit=falls(1.0, 20.0)))) == {SATURATION}


def test_short_peak_of_an_acceleration_is_no_saturation() -> None:
    """Two samples at the limit; and hard work at 90 % of it for seconds."""
    assert present(play(stream(3.0, torque=lambda t: 80.0 if 1.0 <= t < 1.035 else 50.0))) == set()
    assert present(play(stream(3.0, torque=lambda t: 52.0 * math.sin(6.0 * t)))) == set()


@pytest.mark.parametrize("given", [6.0, -6.0])
def test_drive_of_which_nothing_is_asked_owes_nothing_either_way(given: float) -> None:
    rows = stream(2.0, torque=lambda _: 0.0)
    held = [
        [msgspec.structs.replace(s, value=msgspec.structs.replace(s.value, effort=(1.0, given))), c] for s, c in rows
    ]
    history = play(held)
    assert present(history) == set()
    assert history[-1][SATURATION].measures["owed"] == 0.0


def test_drive_that_gives_more_than_it_is_asked_owes_nothing() -> None:
    rows = stream(2.0)
    more = [
        [msgspec.structs.replace(s, value=msgspec.structs.replace(s.value, effort=(1.0, 35.0))), c] for s, c in rows
    ]
    assert present(play(more)) == set()


def test_slow_sinking_is_drift_and_its_statistic_the_distance() -> None:
    history = play(stream(4.0, off=lambda t: -0.05 * max(0.0, t - 1.0)))
    assert present(history) == {DRIFT}
    # a ramp of 0.05 rad/s reaches 0.03 rad after 0.6 s; the mean is late by its time constant of 0.1 s
    assert first(history, DRIFT) == pytest.approx(1.7, abs=0.04)
    assert history[-1][DRIFT].statistic == pytest.approx(0.05 * 3.0 - 0.05 * 0.1, abs=0.003)


def test_tracking_lag_and_shaking_are_no_drift() -> None:
    moving = stream(10.0, command=lambda t: 0.25 * math.sin(3.0 * t), off=lambda t: 0.05 * math.sin(60.0 * t))
    assert present(play(moving)) == set()


def test_one_bad_sample_is_no_drift() -> None:
    assert present(play(stream(2.0, off=lambda t: 0.15 if 1.0 <= t < 1.01 else 0.0))) == set()


def test_drift_ends_with_hysteresis() -> None:
    """About the threshold, between it and 60 % of it, the verdict stands."""
    history = play(stream(6.0, off=lambda t: 0.05 if 1.0 < t < 2.0 else 0.024 if 2.0 <= t < 4.0 else 0.0))
    flags = [said[DRIFT].present for said in history]
    assert flags[60:205] == [True] * 145
    assert flags[-1] is False
    assert sum(a != b for a, b in pairwise(flags)) == 2


def test_ten_minutes_of_work_are_quiet() -> None:
    """Moves of 0.5 rad at up to 0.4 rad/s under a load that takes up to 80 % of the torque."""
    rows = stream(
        600.0,
        command=lambda t: 0.25 * math.sin(1.6 * t),
        torque=lambda t: 30.0 + 16.0 * math.sin(1.6 * t + 1.0),
        seed=7,
    )
    assert present(play(rows)) == set()


def test_what_is_not_streamed_is_unobserved() -> None:
    rows = stream(0.2)
    strip = [[msgspec.structs.replace(s, value=msgspec.structs.replace(s.value, effort=())), c] for s, c in rows]
    assert [set(said) for said in play(strip)] == [{DRIFT}] * len(rows)
    both = ActuatorsConfig(joints={"elbow": 57.6, "knee": 300.0})
    assert [set(said) for said in play(rows, both)] == [set()] * len(rows)


def test_joints_are_found_by_name_and_each_is_a_subject() -> None:
    config = ActuatorsConfig(joints={"elbow": 57.6, "wrist": 6.6})
    detector = SPEC.build(config)
    state, order = stream(0.1)[0]
    said = detector.update(state.stamp_ns, Inputs({"joints": state, "command": order}, {}))
    assert {(i.kind, i.subject) for i in said} == {(k, s) for k in SPEC.kinds for s in ("elbow", "wrist")}


@pytest.mark.parametrize(
    ("settings", "place"),
    [
        ({"joints": {}}, "actuators.joints"), ({"joints": {"elbow": -1.0}}, "actuators.joints.elbow"),
        ({"dwell_s": -0.1}, "actuators.dwell_s"), ({"drift_rad": 0.5}, "actuators.drift_rad"),
        ({"release_ratio": 2.0}, "actuators.release_ratio"), ({"mean_s": math.inf}, "actuators.mean_s"),
    ],
)  # fmt: skip
def test_bad_setting_is_named(settings: dict[str, object], place: str) -> None:
    with pytest.raises(ConfigError, match=place.replace(".", r"\.")):
        ActuatorsConfig(**settings)
