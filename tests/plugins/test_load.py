"""The load detector: each kind on its definition, silent on its nearest look-alike."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any

import msgspec
import pytest
from load_stream import Signal, about_y, stream

from foreshock.detector import Inputs
from foreshock.errors import ConfigError
from foreshock.records import Indication, Sample
from foreshock_detectors.load import SPEC, LoadConfig
from foreshock_detectors.load._tilt import tilt_error

WRIST, TILT = SPEC.kinds
NAMES = {"imu": "imu", "object": "object", "object_command": "command"}
History = list[tuple[float, dict[str, Indication]]]


def play(samples: Sequence[Sample], config: LoadConfig | None = None, without: str = "") -> History:
    """Deliver by arrival to a detector that ticks at 100 Hz."""
    detector = SPEC.build(config or LoadConfig())
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
        if len(latest) == 3:
            out.append((now * 1e-9, {i.kind: i for i in detector.update(now, Inputs(latest, new))}))
    return out


def present(history: History) -> set[str]:
    return {kind for _, said in history for kind, i in said.items() if i.present}


def onsets(history: History, kind: str) -> list[float]:
    states = [(t, kind in said and said[kind].present) for t, said in history]
    return [t for (_, before), (t, now) in pairwise(states) if now and not before]


def shake(hz: float, rate_rad_s: float, start: float, stop: float) -> Signal:
    """A sinusoidal angle with this amplitude of its rate."""
    return lambda t: rate_rad_s / (2 * math.pi * hz) * math.sin(2 * math.pi * hz * t) if start <= t < stop else 0.0


def jolt(t: float) -> float:
    return 4e-3 * math.exp(-40.0 * t) * math.sin(120.0 * t) if t > 0.0 else 0.0


def ramp(start: float, stop: float, to: float) -> Signal:
    return lambda t: to * min(max((t - start) / (stop - start), 0.0), 1.0)


# --- wrist


@pytest.mark.parametrize("hz", [12.0, 17.0, 23.0, 26.0])
def test_a_wrist_that_shakes_is_unstable_while_it_does(hz: float) -> None:
    """RMS of a rate of 0.25 rad/s amplitude is 0.18 rad/s, twice the threshold."""
    history = play(stream(5.0, wrist=shake(hz, 0.25, 2.0, 3.5)))
    assert present(history) == {WRIST}
    assert len(onsets(history, WRIST)) == 1
    assert 2.1 < onsets(history, WRIST)[0] < 2.5
    assert not history[-1][1][WRIST].present
    during = [said[WRIST] for t, said in history if 3.0 < t < 3.4]
    assert all(0.08 < i.statistic < 0.19 for i in during)
    assert during[0].threshold == 0.08
    assert 0.0 < during[0].severity < 1.0


@pytest.mark.parametrize(
    ("name", "wrist", "command"),
    [
        ("a fast wanted rotation", lambda t: 0.0, lambda t: 0.8 * (1.0 - math.cos(4.0 * t))),
        ("its tracking error", lambda t: 0.05 * math.sin(4.0 * t), lambda t: 0.8 * (1.0 - math.cos(4.0 * t))),
        ("the sway of a gait", lambda t: 0.02 * math.sin(10.0 * t), lambda t: 0.0),
        ("a tremor below the threshold", shake(20.0, 0.06, 0.0, 99.0), lambda t: 0.0),
        ("one jolt that rings off", lambda t: jolt(t - 2.0), lambda t: 0.0),
    ],
)
def test_look_alikes_of_an_unstable_wrist(name: str, wrist: Signal, command: Signal) -> None:
    assert WRIST not in present(play(stream(6.0, wrist=wrist, command=command, seed=3)))


def test_a_noisier_gyro_raises_the_threshold_to_six_times_its_band_noise() -> None:
    history = play(stream(3.0), LoadConfig(gyro_noise_rad_s=0.05))
    limit = history[-1][1][WRIST].threshold
    assert 0.2 < limit < 6.0 * 0.05 * math.sqrt(3.0)


# --- tilt


@pytest.mark.parametrize("to", [0.1, -0.1])
def test_a_slow_tilt_is_found_and_ends(to: float) -> None:
    """0.025 rad/s: 1.4 s until it passes the allowance of 35 mrad."""
    history = play(stream(9.0, tilt=lambda t: ramp(2.0, 6.0, to)(t) - ramp(6.5, 7.0, to)(t)))
    assert present(history) == {TILT}
    assert len(onsets(history, TILT)) == 1
    assert 3.4 < onsets(history, TILT)[0] < 4.5
    assert not history[-1][1][TILT].present
    worst = max((said[TILT] for _, said in history if TILT in said), key=lambda i: i.severity)
    assert worst.severity == pytest.approx((0.1 - 0.035) / (0.26 - 0.035), abs=0.1)


@pytest.mark.parametrize(
    ("tilt", "command", "yaw"),
    [
        (lambda t: 0.0, lambda t: 0.3 * (1.0 - math.cos(2.0 * t)), lambda t: 0.0),  # a wanted tilt
        (
            lambda t: -0.03 * math.sin(2.0 * t),
            lambda t: 0.3 * (1.0 - math.cos(2.0 * t)),
            lambda t: 0.0,
        ),  # 50 ms late
        (lambda t: 0.022, lambda t: 0.0, lambda t: 0.0),  # a constant error of calibration
        (lambda t: 0.05 * math.sin(12.0 * t), lambda t: 0.0, lambda t: 0.0),  # it swings, and does not drift
        (lambda t: 0.0, lambda t: 0.0, lambda t: 0.3),  # turned about the vertical
    ],
)
def test_look_alikes_of_a_tilt_drift(tilt: Signal, command: Signal, yaw: Signal) -> None:
    assert TILT not in present(play(stream(8.0, tilt=tilt, command=command, yaw=yaw, seed=4)))


def test_tilt_error_agrees_with_rotation_matrices() -> None:
    from scipy.spatial.transform import Rotation

    for seed in range(20):
        a, b = Rotation.random(2, random_state=seed)
        up = (a.inv() * b).apply((0.0, 0.0, 1.0))
        x, y = tilt_error(tuple(a.as_quat()), tuple(b.as_quat())) or (math.nan, math.nan)
        assert math.hypot(x, y) == pytest.approx(math.acos(up[2]), abs=1e-9)
        assert Rotation.from_rotvec((x, y, 0.0)).apply((0.0, 0.0, 1.0)) == pytest.approx(up, abs=1e-9)
    assert tilt_error((0.0, 0.0, 0.0, 0.0), about_y(0.1)) is None


# --- absence, false alarms, settings


def test_ten_minutes_of_carrying_are_silent() -> None:
    """Sway of a gait on all, a calibration error of 15 mrad; the rates claim less than one alarm in a shift."""
    carry: dict[str, Callable[[float], float]] = {
        "wrist": lambda t: 0.01 * math.sin(9.0 * t) + 5e-4 * math.sin(75.0 * t),
        "tilt": lambda t: 0.015 + 0.01 * math.sin(9.0 * t),
        "command": lambda t: 0.2 * math.sin(0.3 * t),
    }
    assert present(play(stream(600.0, **carry, seed=9))) == set()


@pytest.mark.parametrize("missing", ["imu", "object", "command"])
def test_nothing_is_said_without_an_input(missing: str) -> None:
    assert play(stream(1.0), without=missing) == []


def test_a_quaternion_that_is_no_rotation_leaves_the_tilt_unobserved() -> None:
    samples = stream(2.0)
    bad = [
        msgspec.structs.replace(s, value=msgspec.structs.replace(s.value, orientation=(0.0,) * 4))
        if s.channel.endswith("/object") and s.stamp_ns > 1e9
        else s
        for s in samples
    ]
    history = play(bad)
    assert TILT in next(said for t, said in history if t > 0.9)
    assert set(history[-1][1]) == {WRIST}


@pytest.mark.parametrize(
    ("settings", "named"),
    [
        ({"gripper": "a/b"}, "gripper"),
        ({"wrist_low_hz": 50.0}, "wrist_low_hz"),
        ({"tilt_noise_rad": 0.0}, "tilt_noise_rad"),
        ({"tilt_full_rad": 0.01}, "tilt_allowance_rad"),
        ({"hold_s": math.nan}, "hold_s"),
    ],
)
def test_bad_settings_are_refused_by_name(settings: dict[str, Any], named: str) -> None:
    with pytest.raises(ConfigError, match=rf"load\.{named}"):
        LoadConfig(**settings)
