"""The balance detector on TALOS swaying, stepping, slipping, leaning and turning, with noise on every channel."""

from __future__ import annotations

import math

import numpy as np
import pinocchio as pin
import pytest
from balance_motion import (
    MODEL,
    SOLES,
    Motion,
    Noise,
    inputs,
    now,
    onsets,
    roll_pulse,
    run,
    smooth_step,
    stepping,
    stepping_com,
)

from foreshock.detector import Inputs
from foreshock.messages import Imu
from foreshock.records import Sample
from foreshock_detectors.balance import SPEC, BalanceConfig
from foreshock_detectors.balance._detector import BalanceDetector

SLIP, SPIKE, COM, SWAY = SPEC.kinds
LEFT, RIGHT = (SLIP, "left"), (SLIP, "right")
ALL = {LEFT, RIGHT, (SPIKE, ""), (COM, ""), (SWAY, "")}


def detector(**settings) -> BalanceDetector:
    return BalanceDetector(BalanceConfig(**settings))


def changed(sample: Sample, **fields) -> Sample:
    value = sample.value
    kept = {f: getattr(value, f) for f in value.__struct_fields__}
    return Sample(sample.stamp_ns, sample.channel, type(value)(**kept | fields))


# nominal motion is silent


@pytest.mark.parametrize("planned", [True, False])
@pytest.mark.parametrize("rate_hz", [100.0, 200.0])
def test_stepping_in_place_is_silent(planned, rate_hz):
    plan = stepping_com if planned else None
    log = run(Motion(com_y=stepping_com, left_share=stepping, plan_y=plan, rate_hz=rate_hz), 9.0)
    assert onsets(log) == {}
    assert set(log[-1][1]) == ALL


def test_the_first_steps_out_of_standing_are_silent():
    motion = Motion(
        com_y=lambda t: stepping_com(t - 9.0) if t > 9.0 else 0.0,
        left_share=lambda t: stepping(t - 9.0) if t > 9.0 else 0.5,
    )
    assert onsets(run(motion, 12.0)) == {}


def test_a_kilohertz_stream_is_silent_too():
    assert onsets(run(Motion(com_y=stepping_com, left_share=stepping, rate_hz=1000.0), 2.0)) == {}


# each kind fires on its definition, and not on what looks like it


@pytest.mark.parametrize("rate_hz", [100.0, 200.0, 1000.0])
@pytest.mark.parametrize("foot", ["left", "right"])
def test_a_loaded_foot_that_slides_five_millimetres_slips(foot, rate_hz):
    motion = Motion(**{f"{foot}_y": lambda t: 0.005 * smooth_step(t, 1.0, 0.15)}, rate_hz=rate_hz)
    first = onsets(run(motion, 1.5))
    assert set(first) == {(SLIP, foot)}
    crossing = next(t for t in np.arange(1.0, 1.2, 1e-4) if 0.005 * smooth_step(t, 1.0, 0.15) > 0.002)
    assert first[SLIP, foot] == pytest.approx(crossing, abs=0.03)


def test_a_foot_that_moves_in_the_air_does_not_slip():
    motion = Motion(
        left_share=lambda t: 0.5 - 0.5 * smooth_step(t, 0.5, 0.3) + 0.5 * smooth_step(t, 1.4, 0.3),
        left_y=lambda t: 0.03 * smooth_step(t, 0.9, 0.3),
    )
    log = run(motion, 2.0)
    assert onsets(log) == {}
    lifted = next(answer for t, answer in log if t >= 1.0)[LEFT]
    assert (lifted.present, lifted.measures["loaded"], lifted.statistic) == (False, 0.0, 0.0)


def test_load_transfer_is_no_slip():
    motion = Motion(
        com_y=lambda t: 0.03 * math.sin(2.0 * t), left_share=lambda t: 0.5 + 0.45 * math.sin(2.0 * t), seed=3
    )
    assert not {LEFT, RIGHT} & set(onsets(run(motion, 6.0)))


def test_a_fast_roll_is_a_spike():
    first = onsets(run(Motion(theta=roll_pulse), 2.5))
    # rate of the quintic step: 30 s^2 (1 - s)^2 * 0.15 / 0.3, above 0.6 from s = 0.276 on
    s = min(x for x in np.roots([1, -2, 1, 0, -0.6 * 0.3 / (30 * 0.15)]).real if 0.1 < x < 0.5)
    assert first[SPIKE, ""] == pytest.approx(2.0 + 0.3 * s, abs=0.02)


def test_a_deliberate_lean_is_neither_spike_nor_slip_nor_sway():
    """60 mm in 2 s, held: with the plan, no deviation either."""

    def lean(t):
        return 0.06 * smooth_step(t, 2.0, 2.0)

    assert onsets(run(Motion(com_y=lean, plan_y=lean, theta=lambda t: 0.1 * smooth_step(t, 2.0, 1.0)), 6.0)) == {}


def test_turning_on_the_spot_is_no_spike():
    subject = detector()
    samples = next(Motion(noise=Noise.none()).samples(0.005))
    for k in range(100):
        imu = samples["imu"].value
        spun = Sample(k * 5_000_000, "imu", Imu(imu.orientation, (0.0, 0.0, -2.0), imu.linear_acceleration))
        (answer,) = subject.update(spun.stamp_ns, Inputs({"imu": spun}, {"imu": (spun,)}))
    assert answer.kind == SPIKE
    # the vertical of imu_link leans by the chest's fixed mounting alone, which is exact in half-sitting
    assert answer.statistic < 0.05


def test_gyroscope_bias_does_not_move_the_statistic():
    quiet = [run(Motion(noise=Noise(gyro_bias_rad_s=b)), 12.0)[-1][1][SPIKE, ""].statistic for b in (0.0, 0.015)]
    assert quiet[1] - quiet[0] < 0.004  # sqrt(2) * 15 mrad/s less exp(-12 s / 5 s)


def test_com_beside_the_feet_is_a_deviation_and_matches_the_closed_form():
    def lean(t):
        return 0.055 * smooth_step(t, 1.0, 0.5)

    log = run(Motion(com_y=lean, plan_y=lambda t: 0.0, noise=Noise.none()), 2.0)
    _, answer = log[-1]
    assert answer[COM, ""].present
    # mid-feet lie at y = 0; 1.25 mm is TALOS's own asymmetry, absorbed by the generator's closed form
    assert answer[COM, ""].measures["com_deviation_m"] == pytest.approx(0.055, abs=1e-4)
    crossing = next(t for t in np.arange(1.0, 1.5, 1e-3) if lean(t) > 0.04)
    assert onsets(log) == {(COM, ""): pytest.approx(crossing, abs=0.006)}


def test_without_a_plan_half_of_the_nominal_sway_is_conceded():
    """The threshold is then 40 + 55 / 2 = 67.5 mm about the running nominal, which hardly moves in half a second."""
    for reach, present in ((0.055, False), (0.085, True)):
        log = run(Motion(com_y=lambda t, reach=reach: reach * smooth_step(t, 1.0, 0.5)), 1.8)
        indication = log[-1][1][COM, ""]
        assert indication.threshold == pytest.approx(0.0675)
        assert indication.present is present


def test_com_deviation_is_relative_to_the_feet_and_to_the_heading():
    """The same lean, standing at another place and turned by 2 rad, gives the same statistic."""
    moved = pin.SE3(pin.exp3(np.array([0.0, 0.0, 2.0])), np.array([3.0, -4.0, 0.0]))
    answers = []
    for place in (pin.SE3.Identity(), moved):
        samples = next(Motion(com_y=lambda t: 0.03, noise=Noise.none()).samples(0.005))
        odometry = samples["odometry"].value
        pose = pin.SE3ToXYZQUAT(place * pin.XYZQUATToSE3([*odometry.position, *odometry.orientation])).tolist()
        samples["odometry"] = changed(samples["odometry"], position=tuple(pose[:3]), orientation=tuple(pose[3:]))
        answers += [i for i in detector().update(now(samples), inputs(samples)) if i.kind == COM]
    assert answers[0].statistic == pytest.approx(answers[1].statistic, abs=1e-9)
    assert answers[0].measures["capture_point_margin_m"] == pytest.approx(
        answers[1].measures["capture_point_margin_m"], abs=1e-9
    )


def test_growing_oscillation_is_sway_before_it_is_a_fall():
    """Stepping sway whose amplitude doubles: 52 mm to 105 mm peak to peak; 1.5 * 55 mm are crossed on the way."""

    def com(t):
        return stepping_com(t) * (1.0 + smooth_step(t, 8.0, 3.0))

    first = onsets(run(Motion(com_y=com, left_share=stepping, plan_y=stepping_com), 11.5))
    assert 8.0 < first[SWAY, ""] < 11.2


def test_planned_sway_is_nominal():
    def wide(t):
        return 0.045 * math.sin(math.pi * t / 0.6) * smooth_step(t, 1.0, 3.0)

    assert (SWAY, "") not in onsets(run(Motion(com_y=wide, plan_y=wide), 6.0))
    assert (SWAY, "") in onsets(run(Motion(com_y=wide), 6.0))


def test_sway_that_was_there_from_the_start_is_learned_within_the_limit():
    def sway(amplitude):
        return Motion(com_y=lambda t: amplitude * math.sin(math.pi * t / 0.6))

    # 76 mm peak to peak is 1.4 times the least nominal amplitude, 140 mm more than 1.5 * 1.5 times
    modest, wild = run(sway(0.038), 8.0), run(sway(0.07), 8.0)
    assert (SWAY, "") not in onsets(modest)
    assert modest[-1][1][SWAY, ""].statistic == pytest.approx(1.0, abs=0.1)
    assert wild[-1][1][SWAY, ""].present


# stability measures


def test_zmp_disagreement_detects_a_push():
    """72 N on the CoM at 0.866 m move the CoP of 886 N by 72 * 0.866 / 886 = 70 mm against the momentum's ZMP."""
    motion = Motion(com_y=stepping_com, push_n=lambda t: 72.0 if t >= 2.0 else 0.0)
    log = run(motion, 2.5)
    before = [a[COM, ""].measures["zmp_disagreement_m"] for t, a in log if 0.5 < t < 2.0]
    after = [a[COM, ""].measures["zmp_disagreement_m"] for t, a in log if t > 2.25]
    assert np.median(after) == pytest.approx(72 * 0.866 / (90.27 * 9.81), abs=0.01)
    assert max(before) < 0.5 * min(after)


def test_measures_of_quiet_standing():
    _, answer = run(Motion(noise=Noise.none()), 0.5)[-1]
    m = answer[COM, ""].measures
    # TALOS's soles: y = +-0.085 m, half width 0.06 m; CoM of half-sitting by Pinocchio
    com = pin.centerOfMass(MODEL, MODEL.createData(), Motion().q(0.0))
    assert (m["support_min_y_m"], m["support_max_y_m"]) == pytest.approx((-0.145, 0.145), abs=1e-3)
    assert (m["com_x_m"], m["com_y_m"]) == pytest.approx(com[:2], abs=1e-6)
    assert m["capture_point_y_m"] == pytest.approx(m["com_y_m"], abs=1e-6)
    assert (m["zmp_x_m"], m["zmp_y_m"]) == pytest.approx(com[:2], abs=1e-6)
    heel, toe = (_sole_x() + edge for edge in (-0.105, 0.10))
    assert m["capture_point_margin_m"] == pytest.approx(min(com[0] - heel, toe - com[0]), abs=1e-6)
    assert "time_to_fall_s" not in m
    assert answer[COM, ""].time_to_event_s is None


@pytest.mark.parametrize(("share", "side"), [(1.0, 1.0), (0.0, -1.0)])
def test_measures_of_standing_on_one_foot_with_the_capture_point_between_the_feet(share, side):
    """The CoM rests at y = 0, 25 mm beside the stance sole and 145 mm from the outer edge of the free one."""
    _, answer = run(Motion(left_share=lambda t: share, noise=Noise.none()), 0.3)[-1]
    m = answer[COM, ""].measures
    edges = sorted((0.025 * side, 0.145 * side))
    assert (m["support_min_y_m"], m["support_max_y_m"]) == pytest.approx(edges, abs=1e-3)
    assert m["capture_point_support_margin_m"] == pytest.approx(-0.025, abs=1e-3)
    assert m["com_margin_m"] == pytest.approx(-0.025, abs=1e-3)
    com = pin.centerOfMass(MODEL, MODEL.createData(), Motion().q(0.0))
    # the capture point runs from 25 to 170 mm beside the centre of pressure at that edge
    expected = math.log(0.170 / 0.025) / math.sqrt(9.81 / com[2])
    assert m["time_to_capture_loss_s"] == pytest.approx(expected, rel=0.02)
    assert answer[COM, ""].time_to_event_s is None


def test_a_fall_is_predicted_once_the_capture_point_leaves_both_soles():
    """LIPM with the CoP at the outer edge of the left foot, streamed to the detector: the prediction counts down."""
    w0, edge = math.sqrt(9.81 / 0.866), 0.145
    a, b = 0.010, -0.110  # half of the distances of xi and of its mirror to the edge

    def com(t):
        return edge + a * math.exp(w0 * t) + b * math.exp(-w0 * t)

    fall = math.log(-b / a) / (2 * w0)
    motion = Motion(com_y=com, plan_y=lambda t: 0.0, left_share=lambda t: 1.0)
    for t, answer in run(motion, 0.8 * fall):
        predicted = answer[COM, ""].time_to_event_s
        assert predicted is not None
        # xi is 20 mm or more outside; 3 mm/s and 1 mm of noise shift it by 2 mm, the height by leaning some percent
        assert predicted == pytest.approx(fall - t, abs=0.06)
    assert answer[COM, ""].severity > 0.5


def _sole_x():
    data = MODEL.createData()
    pin.framesForwardKinematics(MODEL, data, Motion().q(0.0))
    return data.oMf[SOLES["left"]].translation[0]
