"""The balance detector as a part of the whole: missing and malformed evidence, order, gaps, determinism, its spec."""

from __future__ import annotations

import math

import pytest
from balance_motion import (
    Motion,
    inputs,
    now,
    roll_pulse,
    run,
    smooth_step,
    stepping,
    stepping_com,
)

from foreshock.detector import Inputs
from foreshock.errors import ConfigError
from foreshock.messages import Imu, JointState, MotionPlan, WrenchStamped
from foreshock.records import Sample
from foreshock_detectors.balance import SPEC, BalanceConfig, foreshock_detectors
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


# fail closed


@pytest.mark.parametrize(
    ("missing", "left_out"),
    [
        ("imu", {(SPIKE, "")}),
        ("left_wrench", {LEFT, RIGHT}),
        ("right_wrench", {LEFT, RIGHT}),
        ("plan", {(COM, "")}),  # judged against the plan so far; a wider threshold must not clear it
    ],
)
@pytest.mark.parametrize("how", ["missing", "nan"])
def test_kinds_without_evidence_are_left_out(missing, left_out, how):
    nan = (math.nan, 0.0, 0.0)
    malformed = {
        "imu": {"angular_velocity": nan},
        "left_wrench": {"force": nan},
        "right_wrench": {"torque": nan},
        "plan": {"com": (0.0, math.nan, 0.0)},
    }
    subject = detector()
    for samples in Motion(com_y=stepping_com, plan_y=stepping_com).samples(2.0):
        answer = subject.update(now(samples), inputs(samples))
        stamp = samples["joints"].stamp_ns
    assert {(i.kind, i.subject) for i in answer} == ALL
    broken = {k: Sample(stamp + 5_000_000, s.channel, s.value) for k, s in samples.items()}
    if how == "missing":
        del broken[missing]
    else:
        broken[missing] = changed(broken[missing], **malformed[missing])
    answer = subject.update(now(broken), inputs(broken))
    assert {(i.kind, i.subject) for i in answer} == ALL - left_out
    assert all(not ref.channel.endswith(missing) for i in answer for ref in i.evidence)


def test_a_slipping_foot_is_still_reported_when_the_other_wrench_is_lost():
    subject = detector()
    for samples in Motion(left_y=lambda t: 0.01 * smooth_step(t, 0.3, 0.1)).samples(0.5):
        kept = {k: s for k, s in samples.items() if k != "right_wrench" or s.stamp_ns < 450_000_000}
        answer = subject.update(now(kept), inputs(kept))
    slips = [i for i in answer if i.kind == SLIP]
    assert [(i.subject, i.present) for i in slips] == [("left", True)]


@pytest.mark.parametrize(
    ("name", "fields", "error", "words"),
    [
        ("joints", {"position": (math.nan,) * 32}, ValueError, "not finite: leg_left_1_joint"),
        ("odometry", {"orientation": (0.0, 0.0, 0.0, 1.02)}, ValueError, "norm 1.02"),
        ("joints", {"name": ("leg_left_7_joint",)}, ConfigError, "did you mean"),
    ],
)
def test_a_malformed_state_raises_and_the_next_good_one_goes_on(name, fields, error, words):
    subject, motion = detector(), Motion(com_y=stepping_com)
    for k, samples in enumerate(motion.samples(1.5)):
        if k == 150:
            bad = samples | {name: changed(samples[name], **fields)}
            with pytest.raises(error, match=words):
                subject.update(now(bad), inputs(bad))
        else:
            answer = subject.update(now(samples), inputs(samples))
    assert {(i.kind, i.subject) for i in answer} == ALL


def test_duplicates_and_late_samples_change_nothing():
    motion = Motion(com_y=stepping_com, left_share=stepping, left_y=lambda t: 0.006 * smooth_step(t, 0.9, 0.1))
    plain, disturbed, previous = detector(), detector(), None
    for samples in motion.samples(2.0):
        expected = plain.update(now(samples), inputs(samples))
        if previous is not None:
            disturbed.update(now(samples), inputs(previous))
            reordered = {name: (samples[name], previous[name], samples[name]) for name in samples}
            assert disturbed.update(now(samples), Inputs(samples, reordered)) == expected
            disturbed.update(now(samples), inputs(previous))
            assert disturbed.update(now(samples), inputs(samples)) == expected
        else:
            assert disturbed.update(now(samples), inputs(samples)) == expected
        previous = samples


def test_a_gap_restarts_windows_and_anchors():
    subject = detector()
    for samples in Motion(com_y=stepping_com).samples(2.0):
        subject.update(now(samples), inputs(samples))
    answers = []
    for samples in Motion(com_y=stepping_com, left_y=lambda t: 0.02).samples(3.5, t_start=2.2):
        answers.append({(i.kind, i.subject) for i in subject.update(now(samples), inputs(samples))})
        assert not any(i.present for i in subject.update(now(samples), inputs(samples)))
    assert answers[0] == {(COM, ""), (SPIKE, "")}
    assert LEFT not in answers[9]
    assert LEFT in answers[11]
    assert (SWAY, "") not in answers[200]
    assert answers[-1] == ALL


def test_sway_is_unobserved_until_a_window_is_full_and_warm_up_covers_it():
    first = {key: t for t, answer in reversed(run(Motion(), 1.5)) for key in answer}
    assert first.pop((SWAY, "")) == pytest.approx(BalanceConfig().sway_window_s)
    assert max(first.values()) == pytest.approx(BalanceConfig().slip_settle_s)
    assert SPEC.warm_up_s >= BalanceConfig().sway_window_s


# contract


def test_deterministic_and_reset_equals_new():
    motion = Motion(com_y=stepping_com, left_share=stepping, theta=roll_pulse)
    subject = detector()
    first = run(motion, 2.5, subject)
    subject.reset(1)
    assert run(motion, 2.5, subject) == first
    assert run(motion, 2.5) == first


def test_indications_carry_their_samples_and_the_newest_stamp():
    _, answer = run(Motion(plan_y=lambda t: 0.0), 2.0)[-1]
    channels = {key: {ref.channel.removeprefix("talos/") for ref in i.evidence} for key, i in answer.items()}
    body = {"joints/state", "base/odometry"}
    assert channels[LEFT] == body | {"left_sole/wrench"}
    assert channels[RIGHT] == body | {"right_sole/wrench"}
    assert channels[SPIKE, ""] == {"imu/torso"}
    assert channels[COM, ""] == channels[SWAY, ""] == body | {"left_sole/wrench", "right_sole/wrench", "plan/motion"}
    for i in answer.values():
        assert i.stamp_ns == max(ref.stamp_ns for ref in i.evidence) == 1_995_000_000
        assert i.severity == 0.0
        assert all(map(math.isfinite, i.measures.values()))


def test_severity_is_between_none_and_full():
    log = run(Motion(left_y=lambda t: 0.03 * smooth_step(t, 0.3, 0.2), theta=lambda t: 2 * roll_pulse(t)), 2.5)
    seen = [i for _, answer in log for i in answer.values() if i.present]
    assert {i.kind for i in seen} >= {SLIP, SPIKE}
    assert all(0.0 <= i.severity <= 1.0 for i in seen)
    assert {0.0, 1.0} <= {round(i.severity, 1) for i in seen if i.kind == SLIP}


def test_the_spec_is_what_the_plugin_offers():
    assert foreshock_detectors() == (SPEC,)
    assert (SPEC.id, SPEC.extra) == ("balance", "balance")
    assert {i.name: i.type for i in SPEC.inputs if i.required} == {"joints": JointState, "odometry": type(_odometry())}
    optional = {i.name: i.type for i in SPEC.inputs if not i.required}
    assert optional == {"imu": Imu, "left_wrench": WrenchStamped, "right_wrench": WrenchStamped, "plan": MotionPlan}


def _odometry():
    return next(Motion().samples(0.005))["odometry"].value
