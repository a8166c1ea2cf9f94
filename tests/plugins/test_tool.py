"""The tool detector: each kind on its definition, silent on its nearest look-alike."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import msgspec
import numpy as np
import pytest
from tool_stream import Signal, stream

from foreshock.detector import Inputs
from foreshock.errors import ConfigError
from foreshock.messages import Capsule, HumanPose, Humans
from foreshock.records import Indication, Sample
from foreshock_detectors.tool import SPEC, ToolConfig
from foreshock_detectors.tool._orientation import axis, nearest

TIP, ORIENTATION, STABILITY = SPEC.kinds
NAMES = {"odometry": "pose", "command": "command", "pose": "humans", "wrench": "wrench", "expected_wrench": "expected"}
History = list[tuple[float, dict[str, Indication]]]


def play(samples: Sequence[Sample], config: ToolConfig | None = None, without: str = "") -> History:
    """Deliver by arrival to a detector that ticks at 100 Hz."""
    detector = SPEC.build(config or ToolConfig())
    latest: dict[str, Sample] = {}
    out, k, now = [], 0, 0
    while k < len(samples):
        now += 10_000_000
        new: dict[str, list[Sample]] = {}
        while k < len(samples) and samples[k].received_ns <= now:
            name = NAMES[samples[k].channel.rpartition("/")[2]]
            if name != without:
                latest[name] = samples[k]
                new.setdefault(name, []).append(samples[k])
            k += 1
        if {"pose", "command"} <= latest.keys():
            out.append((now * 1e-9, {i.kind: i for i in detector.update(now, Inputs(latest, new))}))
    return out


def present(history: History) -> set[str]:
    return {kind for _, said in history for kind, i in said.items() if i.present}


def onsets(history: History, kind: str) -> list[float]:
    states = [(t, kind in said and said[kind].present) for t, said in history]
    return [t for (_, before), (t, now) in pairwise(states) if now and not before]


def sine(hz: float, amplitude: float, start: float = 0.0, stop: float = 99.0) -> Signal:
    return lambda t: amplitude * math.sin(2.0 * math.pi * hz * t) if start <= t < stop else 0.0


def ramp(start: float, stop: float, to: float) -> Signal:
    return lambda t: to * min(max((t - start) / (stop - start), 0.0), 1.0)


# --- tip


@pytest.mark.parametrize("hz", [3.0, 6.0, 10.0, 13.0])
def test_a_tip_that_oscillates_is_found_while_it_does(hz: float) -> None:
    """12 mm of amplitude are 8.5 mm RMS, against 5."""
    history = play(stream(5.0, place=sine(hz, 0.012, 2.0, 3.5)))
    assert present(history) == {TIP}
    assert len(onsets(history, TIP)) == 1
    assert 2.0 < onsets(history, TIP)[0] < 2.5
    assert not history[-1][1][TIP].present
    during = [said[TIP].statistic for t, said in history if 3.0 < t < 3.4]
    assert 0.0055 < min(during) <= max(during) < 0.0095


@pytest.mark.parametrize(
    ("place", "path"),
    [
        (lambda t: 0.0, sine(3.0, 0.03)),  # a path that winds on purpose
        (sine(0.5, 0.03), lambda t: 0.0),  # slow leaning
        (sine(47.0, 0.012), lambda t: 0.0),  # the spindle's own vibration, far beyond any tool's
        (ramp(2.0, 2.3, 0.03), lambda t: 0.0),  # pressed aside once
        (sine(7.0, 0.004), lambda t: 0.0),  # 2.8 mm RMS
    ],
)
def test_look_alikes_of_an_oscillating_tip(place: Signal, path: Signal) -> None:
    assert present(play(stream(6.0, place=place, path=path, seed=2))) == set()


# --- orientation


@pytest.mark.parametrize("toward", [0.3, -0.3])
def test_an_axis_out_of_its_cone_is_unsafe_with_a_human_in_reach(toward: float) -> None:
    history = play(stream(5.0, yaw=ramp(2.0, 3.0, toward), human_y=lambda t: 0.7))
    assert present(history) == {ORIENTATION}
    assert onsets(history, ORIENTATION)[0] == pytest.approx(2.0 + 0.14 / 0.3 + 0.02, abs=0.03)
    last = history[-1][1][ORIENTATION]
    assert last.measures["deviation_rad"] == pytest.approx(0.3, abs=1e-9)
    assert last.measures["distance_m"] == pytest.approx(math.hypot(0.1, 0.7) - 0.15, abs=0.05)
    assert last.statistic == pytest.approx(0.3 / 0.14, rel=1e-6)


def test_a_human_who_steps_into_the_line_of_the_tool_makes_it_unsafe() -> None:
    """0.6 m ahead, from 45 degrees aside into the axis and out again."""
    history = play(stream(8.0, human_x=1.3, human_y=lambda t: 0.25 * abs(t - 4.0)))
    assert present(history) == {ORIENTATION}
    bearing = [(t, said[ORIENTATION].measures["bearing_rad"]) for t, said in history if t > 0.5]
    assert min(b for _, b in bearing) < 0.06
    start = onsets(history, ORIENTATION)[0]
    assert 0.6 * math.tan(0.26) == pytest.approx(0.25 * (4.0 - start), abs=0.06)
    assert not history[-1][1][ORIENTATION].present


@pytest.mark.parametrize(
    ("yaw", "yaw_command", "human_x", "human_y"),
    [
        (ramp(2.0, 3.0, 0.3), lambda t: 0.0, 0.8, lambda t: 1.5),  # out of its cone, nobody in reach
        (lambda t: 0.0, lambda t: 0.0, 2.2, lambda t: 0.0),  # points at the workpiece; somebody far behind it
        (lambda t: 0.0, ramp(2.0, 2.5, -0.6), 0.8, lambda t: 0.7),  # turned away as commanded
        (lambda t: -0.1 if 2.0 < t < 2.5 else 0.0, ramp(2.0, 2.5, 0.6), 0.8, lambda t: 0.7),  # and 80 ms behind it
        (sine(6.0, 0.1), lambda t: 0.0, 0.8, lambda t: 0.7),  # within its cone
    ],
)
def test_look_alikes_of_an_unsafe_orientation(
    yaw: Signal, yaw_command: Signal, human_x: float, human_y: Signal
) -> None:
    history = play(stream(5.0, yaw=yaw, yaw_command=yaw_command, human_x=human_x, human_y=human_y, seed=3))
    assert ORIENTATION not in present(history)


def with_another(samples: Sequence[Sample], other: HumanPose) -> list[Sample]:
    return [
        msgspec.structs.replace(s, value=Humans((*s.value.humans, other))) if isinstance(s.value, Humans) else s
        for s in samples
    ]


@pytest.mark.parametrize(("x", "found"), [(1.4, {ORIENTATION}), (1.8, set())])
def test_a_tool_that_points_at_the_second_nearest_is_unsafe_if_he_is_within_reach(x: float, found: set[str]) -> None:
    """The nearest stands 0.35 m aside, another in the line of the tool: 0.55 m ahead, or 0.95 m."""
    ahead = HumanPose("other", (Capsule("chest", (x, 0.0, 0.9), (x, 0.0, 1.5), 0.15),))
    history = play(with_another(stream(2.0, human_y=lambda t: 0.5), ahead))
    assert present(history) == found
    if found:
        measures = history[-1][1][ORIENTATION].measures
        assert measures["distance_m"] == pytest.approx(x - 0.7 - 0.15, abs=0.01)


def test_beside_a_human_without_capsules_orientation_is_unobserved_unless_another_makes_it_unsafe() -> None:
    nowhere = HumanPose("other", ())
    assert set(play(with_another(stream(2.0), nowhere))[-1][1]) == {TIP, STABILITY}
    assert present(play(with_another(stream(2.0, human_x=1.3, human_y=lambda t: 0.0), nowhere))) == {ORIENTATION}


def test_distance_to_capsules_and_axis_agree_with_dense_sampling_and_matrices() -> None:
    from scipy.spatial.transform import Rotation

    rng = np.random.default_rng(6)
    for _ in range(20):
        a, b, tip = rng.uniform(-1.0, 1.0, (3, 3))
        points = a + np.linspace(0.0, 1.0, 20_001)[:, None] * (b - a)
        least = float(np.linalg.norm(points - tip, axis=1).min())
        capsule = Capsule("chest", tuple(a.tolist()), tuple(b.tolist()), 0.1)
        found = nearest(HumanPose("h", (capsule,), uncertainty=0.05), tuple(tip.tolist()))
        assert found is not None
        assert found[0] == pytest.approx(least - 0.15, abs=1e-6)
        turn = Rotation.from_rotvec(rng.normal(size=3))
        assert axis(tuple(turn.as_quat())) == pytest.approx(turn.apply((1.0, 0.0, 0.0)), abs=1e-9)
    assert nearest(HumanPose("h", ()), (0.0, 0.0, 0.0)) is None
    assert axis((0.0, 0.0, 0.0, 0.0)) is None


# --- stability


def test_torque_that_the_process_does_not_explain_is_lost_stability() -> None:
    """Kicks of 6 N m at 8 Hz, the duty of bites, on 10 N m that the process explains."""
    kick: Signal = lambda t: 6.0 if 2.0 < t < 3.0 and (8.0 * t) % 1.0 < 0.4 else 0.0  # noqa: E731
    history = play(stream(5.0, torque=lambda t: 10.0, kick=kick))
    assert present(history) == {STABILITY}
    assert 2.0 < onsets(history, STABILITY)[0] < 2.2
    assert not history[-1][1][STABILITY].present


@pytest.mark.parametrize(
    "torque",
    [
        ramp(2.0, 2.1, 15.0),  # the tool touches the workpiece
        lambda t: 8.0 + 6.0 * math.sin(30.0 * t),  # a strong, but explained, load
        lambda t: 15.0 if (0.5 * t) % 1.0 < 0.5 else 0.0,  # on and off
    ],
)
def test_a_load_that_is_explained_is_stable(torque: Signal) -> None:
    assert present(play(stream(8.0, torque=torque, seed=4))) == set()


def test_an_odd_spike_of_the_torque_sensor_is_nothing() -> None:
    assert STABILITY not in present(play(stream(10.0, kick=lambda t: 80.0 if abs(t - 5.0) < 0.004 else 0.0)))


# --- absence, false alarms, settings


def test_ten_minutes_beside_a_human_are_silent() -> None:
    work = {"place": sine(5.0, 0.002), "torque": lambda t: 6.0 + math.sin(2.0 * t), "yaw": sine(5.0, 0.02)}
    history = play(stream(600.0, path=sine(0.2, 0.1), human_y=lambda t: 0.6 + 0.1 * math.sin(t), seed=8, **work))
    assert present(history) == set()


@pytest.mark.parametrize(
    ("missing", "left"),
    [("humans", {TIP, STABILITY}), ("wrench", {TIP, ORIENTATION}), ("expected", {TIP, ORIENTATION})],
)
def test_a_kind_without_its_input_is_unobserved(missing: str, left: set[str]) -> None:
    assert set(play(stream(2.0), without=missing)[-1][1]) == left


def test_nobody_there_is_an_observation() -> None:
    samples = [
        msgspec.structs.replace(s, value=Humans(())) if s.channel.endswith("humans/pose") else s
        for s in stream(2.0, yaw=lambda t: 0.5)
    ]
    last = play(samples)[-1][1][ORIENTATION]
    assert (last.present, last.statistic) == (False, 0.0)


@pytest.mark.parametrize(
    ("settings", "named"),
    [
        ({"tool": ""}, "tool"),
        ({"tip_low_hz": 20.0}, "tip_low_hz"),
        ({"cone_rad": 2.0}, "cone_rad"),
        ({"nis_samples": 5}, "nis_samples"),
        ({"nis_full": 0.5}, "nis_full"),
        ({"reach_m": math.inf}, "reach_m"),
    ],
)
def test_bad_settings_are_refused_by_name(settings: dict[str, Any], named: str) -> None:
    with pytest.raises(ConfigError, match=rf"tool\.{named}"):
        ToolConfig(**settings)
