"""The recovery detector: fires on its definitions, is silent on their look-alikes."""

from __future__ import annotations

import math

import numpy as np
import pytest
from recovery_motion import Motion, person, pulse

from foreshock.errors import ConfigError
from foreshock.messages import Capsule, HumanPose, Odometry
from foreshock.records import Indication
from foreshock_detectors.recovery import SPEC, RecoveryConfig
from foreshock_detectors.recovery._separation import distance_to, protective_separation

ARM, TORSO, BREACH = SPEC.kinds


def play(
    motion: Motion, seconds: float = 2.0, without: tuple[str, ...] = (), config: RecoveryConfig | None = None
) -> list[tuple[float, dict[tuple[str, str], Indication]]]:
    detector = SPEC.build(config or RecoveryConfig())
    out = []
    for k in range(round(seconds * 100)):
        now, inputs = motion.inputs(k, without)
        out.append((k * 0.01, {(i.kind, i.subject): i for i in detector.update(now, inputs)}))
    return out


def present(history: list[tuple[float, dict[tuple[str, str], Indication]]]) -> set[str]:
    return {kind for _, said in history for (kind, _), i in said.items() if i.present}


SWING = {"shoulder": pulse(1.0, 2.5)}


def test_unplanned_swing_of_the_arm_is_excessive_and_a_planned_one_is_not() -> None:
    assert present(play(Motion(SWING))) == {ARM}
    assert present(play(Motion(SWING, plans=SWING))) == set()


def test_arm_that_stops_short_of_its_plan_is_excessive_too() -> None:
    """An arm that hangs while its plan sweeps is as far from its plan as one that sweeps unplanned."""
    assert present(play(Motion(plans=SWING))) == {ARM}


def test_threshold_is_that_of_the_fingertip() -> None:
    """0.8 m/s at 0.69 m from the shoulder are 1.16 rad/s."""
    quiet = {"shoulder": pulse(1.0, 0.8)}
    assert present(play(Motion(quiet))) == set()
    history = play(Motion({"shoulder": pulse(1.0, 1.6)}))
    onset = next(t for t, said in history if said[ARM, "arm"].present)
    assert 1.6 * math.exp(-0.5 * ((onset - 1.0) / 0.15) ** 2) == pytest.approx(0.8 / 0.69, abs=0.25)  # 5 sigma of noise


def test_trunk_that_turns_against_its_legs_is_recovery_but_toppling_and_stepping_are_not() -> None:
    turn = pulse(1.0, 1.6)
    assert present(play(Motion({"hip": turn}, gyro=turn))) == {TORSO}
    assert present(play(Motion(gyro=turn))) == set(), "toppling: hips still"
    assert present(play(Motion({"hip": turn}))) == set(), "legs swing below a still trunk"
    assert present(play(Motion({"hip": turn}, plans={"hip": turn}, gyro=turn))) == set(), "a planned bow"


def test_either_direction_counts() -> None:
    turn = pulse(1.0, -1.6)
    assert present(play(Motion({"hip": turn}, gyro=turn))) == {TORSO}


def test_fast_hand_near_a_human_is_a_breach_and_a_slow_one_at_the_same_place_is_not() -> None:
    fast = pulse(1.0, 2.0)
    assert present(play(Motion(hand_speed=fast))) == {BREACH}
    assert present(play(Motion(hand_speed=pulse(1.0, 0.5)))) == set()
    assert present(play(Motion(hand_speed=fast, people=lambda _: (person("ann", 2.0),)))) == set(), "out of reach"


def test_breach_ends_after_its_hold_and_not_at_the_threshold() -> None:
    history = play(Motion(hand_speed=pulse(1.0, 2.0)), 2.5)
    flags = [said[BREACH, "ann"].present for _, said in history]
    first, last = flags.index(True), len(flags) - 1 - flags[::-1].index(True)
    assert all(flags[first : last + 1]), "no chatter"
    below = max(
        k for k, (_, said) in enumerate(history) if said[BREACH, "ann"].statistic < said[BREACH, "ann"].threshold
    )
    assert last - below >= 19  # 0.2 s of hold


def test_every_human_is_a_subject_and_one_who_leaves_is_absent_for_three_seconds() -> None:
    def people(t: float):
        return (person("ann", 1.0), person("bob", 1.05)) if t < 1.0 else ()

    history = play(Motion(hand_speed=pulse(0.7, 2.0), people=people), 5.0)
    subjects = [{s: i.present for (kind, s), i in said.items() if kind == BREACH} for _, said in history]
    assert subjects[70] == {"ann": True, "bob": True}
    assert subjects[120] == {"ann": False, "bob": False}
    assert subjects[390] == {"ann": False, "bob": False}
    assert subjects[-1] == {"": False}


@pytest.mark.parametrize(
    ("without", "left"),
    [
        ("joints", {BREACH}), ("plan", {BREACH}), ("torso", {ARM, BREACH}), ("humans", {ARM, TORSO}),
        ("hand-arm", {ARM, TORSO}),
    ],
)  # fmt: skip
def test_kind_without_its_evidence_is_unobserved(without: str, left: set[str]) -> None:
    for _, said in play(Motion(SWING), 0.3, (without,)):
        assert {kind for kind, _ in said} == left


def test_joint_that_is_not_streamed_leaves_arm_and_trunk_unobserved() -> None:
    config = RecoveryConfig(arms={"arm": {"shoulder": 0.69, "wrist": 0.1}})
    for _, said in play(Motion(), 0.1, config=config):
        assert {kind for kind, _ in said} == {BREACH}


def test_human_without_a_body_is_nowhere_and_not_far_away() -> None:
    def people(_: float):
        return (person("ann", 1.0), HumanPose("bob", (), None, 0.02))

    for _, said in play(Motion(SWING, people=people), 0.3):
        assert {kind for kind, _ in said} == {ARM, TORSO}


def test_no_false_alarm_in_three_minutes_of_work_beside_a_human() -> None:
    """Planned lifting at up to 1 rad/s, tracked to 0.2 rad/s; sway of the trunk at 0.3 rad/s; a human at 0.4 m."""
    work = {"shoulder": lambda t: math.sin(2.0 * t), "elbow": lambda t: -math.sin(2.0 * t)}
    actual = {"shoulder": lambda t: math.sin(2.0 * t - 0.1), "elbow": lambda t: -math.sin(2.0 * t - 0.1)}
    sway = lambda t: 0.3 * math.sin(3.0 * t)  # noqa: E731  # one expression
    motion = Motion({**actual, "hip": sway}, work, sway, lambda t: 0.4 * math.sin(2.0 * t), seed=5)
    assert present(play(motion, 180.0)) == set()


def test_distance_to_a_capsule_is_that_to_the_nearest_of_many_points_of_it() -> None:
    rng = np.random.default_rng(1)
    for _ in range(50):
        a, b, p = rng.uniform(-1.0, 1.0, (3, 3))
        along = a + np.linspace(0.0, 1.0, 20001)[:, None] * (b - a)
        expected = np.linalg.norm(along - p, axis=1).min() - 0.1
        human = HumanPose(
            "h", (Capsule("chest", tuple(a), tuple(b), 0.1), Capsule("hand", (9.0, 9.0, 9.0), (9.0, 9.0, 9.0), 0.1))
        )
        assert distance_to(tuple(p), human) == pytest.approx(expected, abs=1e-6)


def test_separation_distance_by_hand() -> None:
    """1 m/s: S_r 0.1 m, S_s 0.15 m; a human at 0.4 m/s: S_h 0.16 m; Z_d 0.05 m as stated, Z_r 0.01 m: 0.47 m."""
    hand = Odometry((0.0, 0.0, 1.0), (0.0, 0.0, 0.0, 1.0), (0.6, 0.0, -0.8), (0.0, 0.0, 0.0))
    human = HumanPose("h", (), (0.0, -0.4, 0.0), 0.05)
    assert protective_separation(RecoveryConfig(), hand, human) == pytest.approx(0.47)
    unmeasured = HumanPose("h", (), None, 0.05)
    assert protective_separation(RecoveryConfig(), hand, unmeasured) == pytest.approx(0.47 + 1.6 * 0.4)


@pytest.mark.parametrize(
    ("settings", "place"),
    [
        ({"arm_speed_m_s": 0.0}, "recovery.arm_speed_m_s"), ({"arms": {}}, "recovery"),
        ({"arms": {"left": {"elbow": math.nan}}}, "recovery.arms.left.elbow"),
        ({"arms": {"left": {}}}, "recovery.arms.left"),
        ({"torso_rate_rad_s": 3.0}, "recovery.torso_rate_rad_s"), ({"release_ratio": 1.5}, "recovery.release_ratio"),
    ],
)  # fmt: skip
def test_bad_setting_is_named(settings: dict[str, object], place: str) -> None:
    with pytest.raises(ConfigError, match=place.replace(".", r"\.")):
        RecoveryConfig(**settings)
