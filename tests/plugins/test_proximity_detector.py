"""What the detector says of people who come, pass, leave and vanish, and of input that is not right."""

from __future__ import annotations

import math
from collections.abc import Callable

import msgspec
import numpy as np
import pinocchio as pin
import pytest

from foreshock.detector import Inputs
from foreshock.messages import Capsule, HumanPose, Humans, JointState, Odometry
from foreshock.records import Sample
from foreshock_detectors.proximity import SPEC, ProximityConfig
from foreshock_detectors.proximity._closed_form import segment_distance_m
from foreshock_detectors.proximity._files import talos_files

BREACH, NARROWING = SPEC.kinds
MS = 1_000_000

MAN = (
    ("face", (0, 0, 1.55), (0, 0, 1.65), 0.1),
    ("chest", (0, 0, 1.25), (0, 0, 1.3), 0.15),
    ("abdomen", (0, 0, 1.1), (0, 0, 1.1), 0.16),
    ("pelvis", (0, 0, 0.95), (0, 0, 1.0), 0.17),
    *(("upper-arm", (0, s * 0.22, 1.1), (0, s * 0.22, 1.37), 0.055) for s in (1, -1)),
    *(("forearm", (0, s * 0.22, 0.85), (0, s * 0.22, 1.1), 0.05) for s in (1, -1)),
    *(("hand", (0, s * 0.22, 0.7), (0, s * 0.22, 0.85), 0.045) for s in (1, -1)),
    *(("thigh", (0, s * 0.16, 0.5), (0, s * 0.16, 0.93), 0.1) for s in (1, -1)),
    *(("lower-leg", (0, s * 0.16, 0.07), (0, s * 0.16, 0.5), 0.06) for s in (1, -1)),
)
"""14 capsules of a standing man, half width 0.275 m, facing +x."""


def man(x: float, y: float, ident: str = "man", velocity=None, uncertainty: float = 0.0, turn=None) -> HumanPose:
    turn = np.eye(3) if turn is None else turn
    capsules = tuple(
        Capsule(region, *(tuple((turn @ (np.add(p, (x, y, 0.0)))).tolist()) for p in (a, b)), r)
        for region, a, b, r in MAN
    )
    return HumanPose(ident, capsules, velocity, uncertainty)


class Scene:
    """TALOS standing half sitting at 200 Hz, with noise of encoders and odometry, and one man tracked at 20 Hz.

    Args:
        human: his place (x, y) at time t, or None where he is not seen.
        noise_m: of his place, the same for all his capsules.
        measured: whether his velocity is given, with 0.05 m/s of noise.
        arm: position and velocity added to the joint arm_left_4_joint.
        encoder_rad: noise of the encoders; that of the odometry is a tenth of it, in m.
    """

    def __init__(
        self,
        human: Callable[[float], tuple[float, float] | None],
        noise_m: float = 0.0,
        measured: bool = True,
        arm: Callable[[float], tuple[float, float]] = lambda t: (0.0, 0.0),
        encoder_rad: float = 1e-4,
    ) -> None:
        self.human, self.noise_m, self.measured, self.arm, self.encoder_rad = human, noise_m, measured, arm, encoder_rad
        urdf, srdf = talos_files()
        self.model = pin.buildModelFromUrdf(str(urdf), pin.JointModelFreeFlyer())
        pin.loadReferenceConfigurations(self.model, str(srdf), False)
        self.q = self.model.referenceConfigurations["half_sitting"].copy()
        self.names = tuple(self.model.names)[2:]

    def samples(self, seconds: float, seed: int = 1) -> list[Sample]:
        rng, drift, out = np.random.default_rng(seed), np.random.default_rng((seed, 1)), []
        upright = tuple(self.q[3:7].tolist())
        k = self.names.index("arm_left_4_joint")
        for tick in range(round(seconds * 200) + 1):
            t, stamp = tick / 200, tick * 5 * MS
            position = self.q[7:] + self.encoder_rad * rng.standard_normal(32)
            velocity = 100 * self.encoder_rad * rng.standard_normal(32)
            position[k] += self.arm(t)[0]
            velocity[k] += self.arm(t)[1]
            joints = JointState(self.names, tuple(position.tolist()), tuple(velocity.tolist()))
            out.append(Sample(stamp, "talos/joints/state", joints, tick, stamp))
            place = self.q[:3] + 0.1 * self.encoder_rad * drift.standard_normal(3)
            pose = Odometry(tuple(place.tolist()), upright, (0.0,) * 3, (0.0,) * 3)
            out.append(Sample(stamp, "talos/base/odometry", pose, tick, stamp))
            if tick % 10 == 0:
                out.append(Sample(stamp, "talos/humans/pose", self._humans(t, rng), tick // 10, stamp))
        return out

    def _humans(self, t: float, rng) -> Humans:
        noise, drift = self.noise_m * rng.standard_normal(2), 0.05 * rng.standard_normal(2)
        place = self.human(t)
        if place is None:
            return Humans(())
        x, y = place
        velocity = None
        if self.measured:
            after, before = self.human(t + 1e-3) or place, self.human(max(0.0, t - 1e-3)) or place
            span = 2e-3 if t else 1e-3
            velocity = (*(np.subtract(after, before) / span + drift * (self.noise_m > 0)).tolist(), 0.0)
        return Humans((man(x + noise[0], y + noise[1], velocity=velocity),))


@pytest.fixture(scope="module")
def build(tmp_path_factory):
    folder = str(tmp_path_factory.mktemp("capsules"))
    return lambda **settings: SPEC.build(ProximityConfig(cache_dir=folder, **settings))


def play(detector, samples, every_ns=5 * MS):
    """(time s, indications) of every tick, as the core would call it."""
    latest, new, answers = {}, {}, []
    names = {f"talos/{i.channel}": i.name for i in SPEC.inputs}
    ticks = sorted({s.received_ns for s in samples})
    by_tick = {t: [s for s in samples if s.received_ns == t] for t in ticks}
    for t in ticks:
        for s in by_tick[t]:
            latest[names[s.channel]] = s
            new.setdefault(names[s.channel], []).append(s)
        if len(latest) == 3 and t % every_ns == 0:
            answers.append((t / 1e9, list(detector.update(t, Inputs(dict(latest), dict(new))))))
            new = {}
    return answers


def of(answers, kind, subject="man"):
    """(time, indication) of one kind and subject."""
    return [(t, i) for t, said in answers for i in said if i.kind == kind and i.subject == subject]


def walk(speed, start, stop=None):
    """Along -x towards the robot, from t = 0."""
    return lambda t: (max(start - speed * t, stop if stop is not None else -math.inf), 0.4)


def test_a_breach_is_where_the_distance_falls_below_s_p(build):
    """d from all 280 pairs by the closed form; S_p = 1.3 * 0.7 + 0.2 + 0.02 + 0.01 with a measured walk of 1.3 m/s.

    Encoder velocities are zero, so that S_r = S_s = 0.
    """
    scene = Scene(walk(1.3, 4.0, 0.9), encoder_rad=0.0)
    detector = build(fall_reach=False, c_m=0.2)
    answers = play(detector, scene.samples(3.2))
    data = scene.model.createData()
    pin.forwardKinematics(scene.model, data, scene.q)
    places = [(data.oMi[scene.model.getJointId(c.joint)], c) for c in detector._robot.capsules]
    robot = [(p.act(np.array(c.a)), p.act(np.array(c.b)), c.radius) for p, c in places]
    checked = 0
    for t, i in of(answers, BREACH):
        if t >= 3.1 / 1.3 - 0.06:  # he stops within a measurement period
            break
        x, y = scene.human(t)
        d = min(
            segment_distance_m(tuple(a), tuple(b), c.a, c.b) - r - c.radius
            for a, b, r in robot
            for c in man(x, y).capsules
        )
        assert i.statistic == pytest.approx(d, abs=1e-9)
        assert i.threshold == pytest.approx(1.3 * 0.7 + 0.23, abs=1e-9)
        assert i.present is (d < i.threshold)
        assert i.severity == pytest.approx(max(0.0, 1 - d / i.threshold) if i.present else 0.0, abs=1e-9)
        assert sum(i.measures[f"{k}_m"] for k in ("s_h", "s_r", "s_s", "c", "z_d", "z_r", "s_f")) == pytest.approx(
            i.threshold, abs=1e-12
        )
        checked += i.present
    assert checked > 50


@pytest.mark.parametrize("measured", [True, False])
@pytest.mark.parametrize("seed", range(3))
def test_narrowing_is_said_before_the_breach_and_predicts_the_contact(build, measured, seed):
    """A walk of 1.2 m/s from 5 m, 20 mm of noise: the slope's noise is 0.04 m/s; six of it are 0.25 m/s.

    The horizon of 1.5 s is that of the estimated speed: at most 1.5 * 1.45 / 1.2 s, and a frame, before the breach.
    """
    answers = play(build(fall_reach=False), Scene(walk(1.2, 5.0), 0.02, measured).samples(3.0, seed))
    narrowing, breach = of(answers, NARROWING), of(answers, BREACH)
    first = next(t for t, i in narrowing if i.present)
    breached = next(t for t, i in breach if i.present)
    assert 0.3 < breached - first <= 1.5 * 1.45 / 1.2 + 0.05
    for t, i in narrowing:
        if t >= first:
            assert i.present
            assert i.statistic == pytest.approx(1.2, abs=0.25)
            d = i.measures["distance_m"]
            assert i.time_to_event_s == pytest.approx(d / i.statistic, abs=1e-9)


@pytest.mark.parametrize("measured", [True, False])
def test_walking_past_in_parallel_is_not_narrowing(build, measured):
    """Along y at 1.3 m/s and 2.5 m away: the distance is nearly stationary abeam, where he is nearest."""
    scene = Scene(lambda t: (2.5, -0.65 + 1.3 * t), 0.02, measured)
    said = of(play(build(fall_reach=False), scene.samples(1.0)), NARROWING)
    assert said
    assert not any(i.present for _, i in said)


@pytest.mark.parametrize("measured", [True, False])
def test_standing_and_leaving_are_not_narrowing(build, measured):
    for place in (lambda t: (1.0, 0.3), lambda t: (1.0 + 1.2 * t, 0.3)):
        said = of(play(build(), Scene(place, 0.02, measured).samples(2.0)), NARROWING)
        assert len(said) > 300
        assert not any(i.present for _, i in said)


def test_an_arm_that_moves_away_adds_nothing_and_one_that_comes_near_does(build):
    """The left elbow at 1 rad/s: bending lifts the hand towards a man in front, stretching takes it away from him."""

    def term(rate):
        scene = Scene(lambda t: (1.2, 0.25), arm=lambda t: (rate * t, rate), encoder_rad=0.0)
        said = of(play(build(fall_reach=False), scene.samples(0.3)), BREACH)
        return [(i.measures["s_r_m"], i.measures["s_s_m"], i.measures["robot_speed_m_s"]) for _, i in said]

    near, away = term(-0.5), term(0.5)
    toward = near if near[0][2] > away[0][2] else away
    other = away if toward is near else near
    assert all(s_r > 0.005 for s_r, _, _ in toward)
    assert all(s_r <= 0.1 * 0.02 and s_s <= 0.3 * 0.02 for s_r, s_s, _ in other)
    for s_r, s_s, v in toward:
        assert (s_r, s_s) == pytest.approx((0.1 * v, 0.5 * 0.6 * v), abs=1e-12)


def test_the_robot_walking_up_to_a_standing_man_is_narrowing(build):
    """Odometry at 0.6 m/s towards him; v_r is the same 0.6 m/s of every part."""
    scene = Scene(lambda t: (4.0, 0.0), encoder_rad=0.0)
    samples = []
    for s in scene.samples(4.0):
        if isinstance(s.value, Odometry):
            x, y, z = s.value.position
            moved = msgspec.structs.replace(
                s.value, position=(x + 0.6 * s.stamp_ns / 1e9, y, z), linear=(0.6, 0.0, 0.0)
            )
            s = msgspec.structs.replace(s, value=moved)
        samples.append(s)
    answers = play(build(fall_reach=False), samples)
    i = next(i for _, i in of(answers, NARROWING) if i.present)
    assert i.statistic == pytest.approx(0.6, abs=0.01)
    _, b = of(answers, BREACH)[0]
    assert b.measures["robot_speed_m_s"] == pytest.approx(0.6, abs=0.02)  # the man is not abeam of every part: cosines


def test_nobody_is_absence_with_finite_numbers(build):
    for _, said in play(build(), Scene(lambda t: None).samples(0.2)):
        assert [(i.kind, i.subject, i.present) for i in said] == [(BREACH, "", False), (NARROWING, "", False)]
        assert all(math.isfinite(i.statistic) and i.statistic >= 0.0 for i in said)
        assert said[0].statistic > said[0].threshold


def test_who_has_left_is_reported_absent_for_a_while(build):
    """Seen until 1.0 s; carried on for 0.15 s more, then absent for 3 s, then forgotten."""
    answers = play(build(), Scene(lambda t: (1.0, 0.0) if t < 1.0 else None).samples(4.5))
    state = [(t, i.present) for t, i in of(answers, BREACH)]
    assert all(p for t, p in state if t < 1.0)
    assert not any(p for t, p in state if t >= 1.2)
    assert state[-1][0] == pytest.approx(1.15 + 3.0, abs=0.06)
    assert all(of([a], BREACH, "") for a in answers if a[0] >= 1.2)


def test_one_missing_frame_is_not_a_departure(build):
    """The frame at 1.0 s does not show him."""
    answers = play(build(), Scene(lambda t: None if 0.99 < t < 1.01 else (1.0, 0.0)).samples(1.5))
    assert all(i.present for _, i in of(answers, BREACH))
    assert not of(answers, BREACH, "")


def test_of_a_man_just_found_near_narrowing_is_not_known_yet(build):
    """He appears at 0.6 s, 1.2 m away, velocity unknown: no absence is claimed until his slope is, 0.3 s later."""
    detector = build()
    answers = play(detector, Scene(lambda t: None if t < 0.6 else (1.2, 0.0), measured=False).samples(1.2))
    silent = [t for t, said in answers if not any(i.kind == NARROWING for i in said)]
    assert silent[0] == pytest.approx(0.6, abs=1e-9)
    assert silent[-1] == pytest.approx(0.9 - 0.005, abs=1e-9)  # the first frame that is 0.6 * 0.5 s from his first
    assert all(of([a], BREACH)[0][1].present for a in answers if a[0] >= 0.6)


def test_several_people_are_judged_apart(build):
    scene = Scene(lambda t: (1.0, 0.0))
    samples = [
        msgspec.structs.replace(
            s, value=Humans((man(9.0, 0.0, "far", (0.0, 0.0, 0.0)), man(0.9, 0.3, "near", (0.0, 0.0, 0.0))))
        )
        if isinstance(s.value, Humans)
        else s
        for s in scene.samples(0.6)
    ]
    _, said = play(build(), samples)[-1]
    assert {(i.kind, i.subject): i.present for i in said} == {
        (BREACH, "far"): False,
        (BREACH, "near"): True,
        (NARROWING, "far"): False,
        (NARROWING, "near"): False,
    }


def test_an_unmeasured_velocity_costs_distance_with_age(build):
    """S_h grows by v_h for every second that the position is old: 1.6 m/s * 0.04 s between two ticks."""
    detector = build(fall_reach=False)
    samples = Scene(lambda t: (3.0, 0.0), measured=False).samples(0.3)
    s_h = {round(t, 3): i.measures["s_h_m"] for t, i in of(play(detector, samples), BREACH)}
    assert s_h[0.2] == pytest.approx(1.6 * 0.7, abs=1e-12)
    assert s_h[0.24] == pytest.approx(1.6 * 0.74, abs=1e-12)


def test_turning_and_moving_the_whole_scene_changes_nothing(build):
    """The frame is a convention: odom turned about z by 2 rad and moved by a kilometre."""
    turn, shift = pin.utils.rotate("z", 2.0), np.array([1000.0, -700.0, 0.0])
    scene = Scene(walk(1.2, 3.0), encoder_rad=0.0)
    here, there = scene.samples(1.5), []
    quaternion = pin.Quaternion(turn)
    for s in here:
        value = s.value
        if isinstance(value, Odometry):
            q = quaternion * pin.Quaternion(np.array(value.orientation))
            value = msgspec.structs.replace(
                value,
                position=tuple((turn @ value.position + shift).tolist()),
                orientation=tuple(q.coeffs().tolist()),
            )
        elif isinstance(value, Humans):
            poses = []
            for pose in value.humans:
                moved = tuple(
                    msgspec.structs.replace(
                        c, a=tuple((turn @ c.a + shift).tolist()), b=tuple((turn @ c.b + shift).tolist())
                    )
                    for c in pose.capsules
                )
                velocity = tuple((turn @ pose.velocity).tolist())
                poses.append(msgspec.structs.replace(pose, capsules=moved, velocity=velocity))
            value = Humans(tuple(poses))
        there.append(msgspec.structs.replace(s, value=value))
    for (_, one), (_, other) in zip(play(build(), here), play(build(), there), strict=True):
        for i, j in zip(one, other, strict=True):
            assert (i.kind, i.subject, i.present) == (j.kind, j.subject, j.present)
            # a kilometre costs three of sixteen digits
            assert (i.statistic, i.threshold) == pytest.approx((j.statistic, j.threshold), abs=1e-9)


def poison(samples, kind, change):
    return [msgspec.structs.replace(s, value=change(s.value)) if isinstance(s.value, kind) else s for s in samples]


def first_capsule(humans, **changes):
    (pose,) = humans.humans
    bent = (msgspec.structs.replace(pose.capsules[0], **changes), *pose.capsules[1:])
    return Humans((msgspec.structs.replace(pose, capsules=bent),))


NAN = float("nan")


@pytest.mark.parametrize(
    ("kind", "change", "said"),
    [
        (JointState, lambda v: msgspec.structs.replace(v, position=(NAN, *v.position[1:])), "leg_left_1_joint"),
        (JointState, lambda v: msgspec.structs.replace(v, velocity=()), "0 velocities"),
        (Odometry, lambda v: msgspec.structs.replace(v, linear=(0.0, NAN, 0.0)), "linear is not finite"),
        (Odometry, lambda v: msgspec.structs.replace(v, orientation=(0.0, 0.0, 0.0, 1.02)), "norm 1.0200"),
        (Humans, lambda v: msgspec.structs.replace(v, frame_id="map"), "frame 'map', base/odometry in 'odom'"),
        (Humans, lambda v: Humans(v.humans * 2), "two humans have the id 'man'"),
        (Humans, lambda v: Humans((HumanPose("man", ()),)), "no capsules"),
        (Humans, lambda v: first_capsule(v, radius=0.0), "not a capsule"),
        (Humans, lambda v: first_capsule(v, a=(NAN, 0.0, 0.0)), "not a capsule"),
        (Humans, lambda v: Humans((msgspec.structs.replace(v.humans[0], uncertainty=-1.0),)), "uncertainty"),
        (Humans, lambda v: Humans((msgspec.structs.replace(v.humans[0], velocity=(NAN, 0.0, 0.0)),)), "velocity"),
    ],
)
def test_what_is_malformed_raises(build, kind, change, said):
    with pytest.raises(ValueError, match=said):
        play(build(), poison(Scene(lambda t: (2.0, 0.0)).samples(0.01), kind, change))


def test_the_same_again_after_reset(build):
    samples = Scene(walk(1.2, 3.0), 0.02).samples(1.0)
    detector = build()
    first = play(detector, samples)
    detector.reset(7)
    assert play(detector, samples) == first
    assert play(build(), samples) == first


def test_late_and_repeated_samples_change_nothing(build):
    """A joint state and a tracker's frame from the past, and the present ones once more."""
    samples = Scene(walk(1.2, 3.0)).samples(0.5)
    detector = build()
    *_, (_, last) = play(detector, samples)
    names = {f"talos/{i.channel}": i.name for i in SPEC.inputs}
    newest = {names[s.channel]: s for s in samples}
    assert list(detector.update(500 * MS, Inputs(newest, {}))) == last
    old = {names[s.channel]: s for s in samples if s.stamp_ns <= 100 * MS}
    again = detector.update(500 * MS, Inputs(old, {}))
    assert [(i.statistic, i.threshold) for i in again] == [(i.statistic, i.threshold) for i in last]


def test_without_an_input_nothing_is_said(build):
    assert list(build().update(0, Inputs({}, {}))) == []
