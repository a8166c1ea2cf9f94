"""The people detector: each kind on its definition, silent on its nearest look-alike."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import msgspec
import numpy as np
import pytest
from people_scene import MS, PERIOD_MS, scene, straight

from foreshock.detector import Inputs
from foreshock.errors import ConfigError
from foreshock.messages import Capsule, HumanPose, Humans, Odometry
from foreshock.records import Indication, Sample
from foreshock_detectors import people
from foreshock_detectors.people import PeopleConfig

SPEC = people.foreshock_detectors()[0]
REACH, DIVERT, NEGLECT, LOWER = SPEC.kinds
NAMES = {"talos/humans/pose": "humans", "talos/human-1/gaze": "gaze", "talos/base/odometry": "base"}
History = list[tuple[float, dict[str, Indication]]]


def play(samples: Sequence[Sample], config: PeopleConfig | None = None, max_age_s: float = 0.2) -> History:
    """Deliver by arrival to a detector that ticks at 50 Hz; what is stale is left out as the supervisor does it."""
    detector = SPEC.build(config or PeopleConfig())
    latest: dict[str, Sample] = {}
    out, k, now = [], 0, 0
    while k < len(samples):
        now += PERIOD_MS * MS
        new: dict[str, list[Sample]] = {}
        while k < len(samples) and samples[k].received_ns <= now:
            name = NAMES[samples[k].channel]
            latest[name] = samples[k]
            new.setdefault(name, []).append(samples[k])
            k += 1
        fresh = {n: s for n, s in latest.items() if now - s.stamp_ns <= max_age_s * 1e9}
        out.append((now * 1e-9, {i.kind: i for i in detector.update(now, Inputs(fresh, new))}))
    return out


def present(history: History) -> set[str]:
    return {kind for _, said in history for kind, i in said.items() if i.present}


def first(history: History, kind: str) -> float:
    return next(t for t, said in history if kind in said and said[kind].present)


# --- hands


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize(("speed", "found"), [(1.4, set()), (3.0, {REACH})])
def test_a_hand_faster_than_iso_13855_is_a_rapid_reach_in(speed: float, found: set[str], seed: int) -> None:
    history = play(scene(4.0, hand=straight(2.0, speed), seed=seed))
    assert present(history) == found
    if found:
        assert first(history, REACH) < 2.25  # it is there after 0.23 s
        assert not history[-1][1][REACH].present


def test_a_hand_drawn_back_as_fast_is_none() -> None:
    history = play(scene(4.0, hand=lambda t: (0.25 + min(0.65, 3.0 * max(0.0, t - 2.0)), 0.0, 1.0)))
    assert present(history) == set()


def two_hands(samples: Sequence[Sample], kept: Callable[[float], Sequence[int]]) -> list[Sample]:
    """The same with a second hand, 0.25 m nearer to the workspace; of both, those that kept(t) gives, in its order."""

    def hands(t: float, human: HumanPose) -> HumanPose:
        head, hand = human.capsules
        (x, y, z) = hand.a
        near = msgspec.structs.replace(hand, a=(x - 0.25, y, z), b=(x - 0.25, y, z))
        return msgspec.structs.replace(human, capsules=(head, *[(hand, near)[i] for i in kept(t)]))

    return [
        msgspec.structs.replace(s, value=Humans(tuple(hands(s.stamp_ns * 1e-9, h) for h in s.value.humans)))
        if isinstance(s.value, Humans)
        else s
        for s in samples
    ]


@pytest.mark.parametrize("kept", [lambda t: (0, 1) if t < 2.0 else (1,), lambda t: (0, 1) if t < 2.0 else (1, 0)])
def test_a_hand_that_is_lost_or_listed_in_another_place_has_not_moved(kept: Callable[[float], Sequence[int]]) -> None:
    still = scene(4.0, hand=lambda t: (0.7, 0.0, 1.0))
    history = play(two_hands(still, kept))
    assert present(history) == set()
    silent = [t for t, said in history if t > 0.15 and REACH not in said]
    assert len(silent) <= 3  # the new estimate needs 60 ms


def test_the_other_hand_is_found_to_reach_in_whatever_the_order() -> None:
    moving = scene(4.0, hand=straight(2.0, 3.0))
    assert present(play(two_hands(moving, lambda t: (0, 1) if round(50.0 * t) % 2 else (1, 0)))) == {REACH}


def test_without_a_tracked_hand_a_reach_in_is_unobserved_where_it_matters() -> None:
    assert set(play(two_hands(scene(2.0), lambda t: ()))[-1][1]) == {DIVERT, NEGLECT, LOWER}
    assert set(play(two_hands(scene(2.0, x=lambda t: 4.0), lambda t: ()))[-1][1]) == set(SPEC.kinds)


def test_a_fast_hand_far_from_the_workspace_is_none() -> None:
    history = play(scene(4.0, x=lambda t: 2.0, hand=straight(2.0, 3.0, start=1.9, end=1.2)))
    assert REACH not in present(history)


def test_walking_up_at_1_6_m_s_is_no_reach_in() -> None:
    def walk(t: float) -> float:
        return 2.4 - min(1.6, 1.6 * max(0.0, t - 1.0))

    history = play(scene(4.0, x=walk, hand=lambda t: (walk(t) - 0.1, 0.2, 1.0)))
    assert present(history) == set()


# --- eyes


@pytest.mark.parametrize(("away_s", "found"), [(0.15, set()), (0.4, set()), (0.8, {DIVERT}), (3.0, {DIVERT, NEGLECT})])
def test_blink_glance_diversion_and_inattentiveness_differ_by_their_length(away_s: float, found: set[str]) -> None:
    history = play(scene(8.0, angle=lambda t: 1.2 if 2.0 <= t < 2.0 + away_s else 0.0))
    assert present(history) == found
    if NEGLECT in found:
        assert first(history, NEGLECT) == pytest.approx(4.0 + 0.03, abs=0.05)  # 80 % of 2.5 s
        assert not history[-1][1][NEGLECT].present


def test_glances_add_up_to_inattentiveness_only_if_there_is_little_between_them() -> None:
    def glancing(share: float) -> set[str]:
        return present(play(scene(12.0, angle=lambda t: 1.2 if t > 2.0 and t % 0.4 < 0.4 * share else 0.0)))

    assert glancing(0.5) == set()
    assert NEGLECT in glancing(0.95)


def test_looking_beside_the_robot_within_the_field_of_view_is_neither() -> None:
    assert present(play(scene(8.0, angle=lambda t: 0.4))) == set()


def test_outside_the_shared_space_nobody_need_look() -> None:
    history = play(scene(8.0, angle=lambda t: 2.0, x=lambda t: 4.0))
    assert present(history) == set()
    assert history[-1][1][NEGLECT].present is False


def test_closed_eyes_without_confidence_are_unobserved_and_a_blink_changes_nothing() -> None:
    long = play(scene(4.0, confidence=lambda t: 0.0 if t > 2.0 else 1.0))
    assert {REACH, LOWER} == set(long[-1][1])
    blink = play(scene(4.0, confidence=lambda t: 0.0 if 2.0 < t < 2.2 else 1.0))
    assert all(len(said) == 4 for t, said in blink if t > 0.1)
    assert present(blink) == set()


def test_without_gaze_its_kinds_are_unobserved_and_the_others_are_not() -> None:
    history = play([s for s in scene(2.0) if s.channel != "talos/human-1/gaze"])
    assert set(history[-1][1]) == {REACH, LOWER}


def also(samples: Sequence[Sample], x: float, name: str = "human-2") -> list[Sample]:
    """The same with another, who stands at x (m)."""
    other = Capsule("face", (x, 0.0, 1.6), (x, 0.0, 1.7), 0.1), Capsule("hand", (x, 0.3, 0.8), (x, 0.3, 0.8), 0.05)
    return [
        msgspec.structs.replace(s, value=Humans((*s.value.humans, HumanPose(name, other))))
        if isinstance(s.value, Humans)
        else s
        for s in samples
    ]


@pytest.mark.parametrize("alone", [True, False])
def test_beside_somebody_without_a_gaze_channel_the_gaze_is_unobserved_and_not_absent(alone: bool) -> None:
    samples = scene(2.0, there=lambda t: not alone)
    near, far = play(also(samples, 0.9)), play(also(samples, 4.0))
    assert all(set(said) == {REACH, LOWER} for t, said in near if t > 0.15)
    assert all(set(said) == set(SPEC.kinds) for t, said in far if t > 0.15)
    diverted = play(also(scene(4.0, angle=lambda t: 1.2), 0.9))
    assert diverted[-1][1][DIVERT].present  # what is seen of another is said


# --- posture


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(("depth_m", "found"), [(0.06, set()), (0.2, set()), (0.4, {LOWER})])
def test_a_crouch_is_lowering_and_bent_knees_are_not(depth_m: float, found: set[str], seed: int) -> None:
    def lowered(t: float) -> float:
        return depth_m * min(1.0, max(0.0, (t - 2.0) / 0.4)) if t < 5.0 else 0.0

    history = play(scene(7.0, lowered=lowered, seed=seed))
    assert present(history) == found
    assert not history[-1][1][LOWER].present


def test_a_short_person_who_stands_has_not_lowered() -> None:
    assert LOWER not in present(play(scene(4.0, lowered=lambda t: 0.35)))


# --- people who come and go, a workspace that moves


def test_nobody_is_absence_and_somebody_who_left_is_reported_absent() -> None:
    history = play(scene(6.0, angle=lambda t: 1.2 if t > 1.0 else 0.0, there=lambda t: 0.5 < t < 4.0))
    assert all(not i.present and i.subject == "" for i in history[5][1].values())
    assert set(history[5][1]) == set(SPEC.kinds)
    assert present(history) == {DIVERT, NEGLECT}
    gone = next(said for t, said in history if t > 4.4)
    assert {i.subject for i in gone.values()} == {"human-1"}
    assert not any(i.present for i in gone.values())


def test_a_workspace_in_the_base_frame_moves_with_the_robot() -> None:
    """The robot has turned round and stands 3 m behind the human: he looks at where it was."""

    def base(sample: Sample) -> Sample:
        pose = Odometry((3.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
        return Sample(sample.stamp_ns, "talos/base/odometry", pose, sample.seq, sample.received_ns)

    samples = scene(4.0)
    poses = [s for s in samples if s.channel == "talos/humans/pose"]
    both = sorted([*samples, *map(base, poses)], key=lambda s: (s.received_ns, s.channel))
    config = PeopleConfig(workspace_m=(0.5, 0.0, 1.0), workspace_frame="base")
    history = play(both, config)
    assert history[-1][1][DIVERT].statistic == pytest.approx(math.pi, abs=1.2)
    assert present(history) == {DIVERT, NEGLECT}


def test_ten_minutes_of_attentive_work_raise_nothing() -> None:
    """Short glances, slow reaches, bent knees: a human who works well."""
    glances = np.random.default_rng(4).uniform(0.1, 0.35, 400)

    def angle(t: float) -> float:
        return 1.2 if t % 2.0 < glances[int(t / 2.0)] else 0.0

    def hand(t: float) -> tuple[float, float, float]:
        return (0.55 + 0.35 * math.cos(2.0 * math.pi * t / 2.0), 0.0, 1.0)  # up to 1.1 m/s

    samples = scene(600.0, angle=angle, hand=hand, lowered=lambda t: 0.05 * (1.0 - math.cos(t)))
    assert present(play(samples)) == set()


@pytest.mark.parametrize(
    ("wrong", "what"),
    [
        ({"reach_m_s": 0.0}, "reach_m_s"),
        ({"look_release_rad": 1.0}, "look_release_rad"),
        ({"humans": ("a", "a")}, "humans"),
    ],
)
def test_settings_that_make_no_sense_are_refused(wrong: dict[str, object], what: str) -> None:
    with pytest.raises(ConfigError, match=what):
        PeopleConfig(**wrong)
