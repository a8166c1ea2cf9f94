"""swing-leg-drift on a walk by cycloids, which is neither the gait nor the leg of the plant."""

from __future__ import annotations

import math
from collections.abc import Sequence

import pytest
from gait_feet import Deviation, by_tick, planned, swings, walk

from foreshock.detector import Inputs
from foreshock.errors import ConfigError
from foreshock.messages import Vec3
from foreshock.records import Indication, Sample
from foreshock_detectors import swing_leg
from foreshock_detectors.swing_leg import SwingLegConfig

(SPEC,) = swing_leg.foreshock_detectors()
NAMES = {"talos/plan/motion": "plan"} | {
    f"talos/{side}_foot/{what}": side + suffix
    for side in ("left", "right")
    for what, suffix in (("odometry", ""), ("plan", "-plan"))
}


def play(samples: Sequence[Sample], config: SwingLegConfig | None = None) -> list[tuple[float, dict[str, Indication]]]:
    """Time and indications by foot of every update."""
    detector, latest, history = SPEC.build(config or SwingLegConfig()), {}, []
    for now, arrived in by_tick(samples):
        new: dict[str, list[Sample]] = {}
        for s in arrived:
            new.setdefault(NAMES[s.channel], []).append(s)
            latest[NAMES[s.channel]] = s
        history.append((now * 1e-9, {i.subject: i for i in detector.update(now, Inputs(dict(latest), new))}))
    return history


def drifting(samples: Sequence[Sample]) -> set[str]:
    return {foot for _, said in play(samples) for foot, i in said.items() if i.present}


def sideways(depth_m: float, from_s: float) -> Deviation:
    """The left foot leaves its plan as a half sine over each swing after from_s."""

    def deviation(side: str, t: float) -> Vec3:
        if side != "left" or t < from_s or not swings(side, t):
            return (0.0, 0.0, 0.0)
        return (0.0, depth_m * math.sin(math.pi * (t % 1.2) / 0.5), 0.0)

    return deviation


def test_a_foot_that_is_pulled_aside_drifts_and_the_other_does_not() -> None:
    samples = walk(6.0, sideways(0.08, 3.6))
    history = play(samples)
    assert {foot for _, said in history for foot, i in said.items() if i.present} == {"left"}
    onset = next(t for t, said in history if said and said["left"].present)
    begun = 3.6 + 0.5 / math.pi * math.asin(0.5)  # a half sine of 80 mm reaches 40 mm
    assert begun - 0.1 <= onset <= begun + 0.12, (
        "ahead by no more than the lookahead, late by dwell, filter and latency"
    )
    gone = next(t for t, said in history if t > onset and not said["left"].present)
    assert gone >= 4.1 + SwingLegConfig().hold_s - 0.1


def test_ten_minutes_of_a_sound_walk_are_silent() -> None:
    """Tracking lag of 10 mm along the way and noise of 3 mm: 500 swings of each foot."""

    def lag(side: str, t: float) -> Vec3:
        return (-0.01 if swings(side, t) else 0.0, 0.0, 0.0)

    assert drifting(walk(600.0, lag, seed=2)) == set()


def test_a_planned_side_step_is_no_drift() -> None:
    assert drifting(walk(6.0, aside=lambda t: 0.15 * min(1.0, max(0.0, (t - 3.7) / 0.4)))) == set()


def test_a_measurement_that_comes_late_is_no_drift() -> None:
    """40 ms at the cycloid's 2.4 m/s are 96 mm, which the stamps explain."""
    assert drifting(walk(6.0, latency_s=0.04)) == set()


def test_a_loaded_foot_that_slides_is_no_swing_leg_drift() -> None:
    def slide(side: str, t: float) -> Vec3:
        return (0.0, 0.08 if side == "left" and not swings(side, t) and t > 3.0 else 0.0, 0.0)

    assert drifting(walk(6.0, slide)) == set()


def test_between_release_and_threshold_the_verdict_stands() -> None:
    def falls_to(rest_m: float) -> Deviation:
        def deviation(side: str, t: float) -> Vec3:
            if side != "left" or not 3.6 <= t <= 4.1:
                return (0.0, 0.0, 0.0)
            return (0.0, 0.06 + (rest_m - 0.06) * min(1.0, max(0.0, (t - 3.65) / 0.35)), 0.0)

        return deviation

    config = SwingLegConfig(hold_s=0.02)
    for rest_m, stands in ((0.03, True), (0.0, False)):
        history = play(walk(5.0, falls_to(rest_m), noise_m=0.0), config)
        late = next(said["left"] for t, said in history if t >= 4.06)
        assert late.present is stands


def test_without_a_plan_nothing_is_said() -> None:
    def left(samples: Sequence[Sample], channel: str) -> list[Sample]:
        return [s for s in samples if s.channel != channel]

    samples = walk(1.0)
    assert not any(said for _, said in play(left(samples, "talos/plan/motion")))
    assert all("left" not in said for _, said in play(left(samples, "talos/left_foot/plan")))
    assert any("right" in said for _, said in play(left(samples, "talos/left_foot/plan")))


def test_the_deviation_is_what_the_foot_is_off() -> None:
    """A constant 50 mm after the filter has settled; noise-free, the plan interpolated within 1 mm."""

    def off(side: str, t: float) -> Vec3:
        return (0.03, 0.04, 0.0) if swings(side, t) else (0.0, 0.0, 0.0)

    history = play(walk(3.0, off, noise_m=0.0))
    said = [i["left"].measures["now_m"] for t, i in history if 2.7 < t < 2.88]
    assert said == pytest.approx([0.05] * len(said), abs=0.0015)
    assert planned("left", 2.7)[2] > 0.01


@pytest.mark.parametrize(
    ("settings", "place"),
    [
        ({"feet": ()}, "feet"),
        ({"feet": ("plan",)}, "feet"),
        ({"drift_m": math.nan}, "drift_m"),
        ({"release": 1.0}, "release"),
    ],
)
def test_a_bad_setting_is_named(settings: dict[str, object], place: str) -> None:
    with pytest.raises(ConfigError, match=f"swing_leg.{place}"):
        SwingLegConfig(**settings)  # type: ignore[arg-type]
