"""Distances: closed form, python-fcl and coal agree, the closest pair is the closest, and points move as they must."""

from __future__ import annotations

import math

import coal
import numpy as np
import pinocchio as pin
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from foreshock.errors import ConfigError
from foreshock.messages import Capsule, HumanPose, Humans, JointState, Odometry
from foreshock_detectors.proximity import _pair
from foreshock_detectors.proximity._closed_form import segment_distance_m
from foreshock_detectors.proximity._config import ProximityConfig
from foreshock_detectors.proximity._kinematics import CapsuleKinematics
from foreshock_detectors.proximity._nearest import NearestPairs, approach_speeds
from foreshock_detectors.proximity._pair import PlacedCapsule, checked_distance_m
from foreshock_detectors.proximity._people import People
from foreshock_detectors.proximity._robot import Robot
from foreshock_detectors.proximity._scene import ClosestPair, Scene

points = st.tuples(*[st.floats(-2.0, 2.0).map(lambda x: round(x, 3))] * 3)  # whole mm: parallel and touching ones too
segments = st.tuples(points, points)

CLOSE_M = 1e-6  # both libraries work in doubles; a near-parallel pair loses half the digits


@settings(max_examples=200, deadline=None)
@given(segments, segments)
@example(((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)), ((1.0, 2.0, 2.0), (1.0, 2.0, 2.0)))
@example(((0.0, 0.0, 0.0), (2.0, 0.0, 0.0)), ((1.0, 1.0, 0.0), (1.8, 1.0, 0.0)))
@example(((-1.0, 0.0, 0.0), (1.0, 0.0, 0.0)), ((0.0, -1.0, 0.0), (0.0, 1.0, 0.0)))
def test_the_closed_form_against_a_dense_grid(s1, s2):
    """A grid of 201 points a side bounds the distance from above, and misses it by less than its own spacing."""
    (a, b), (c, d) = s1, s2
    steps = np.linspace(0.0, 1.0, 201)[:, None]
    left, right = np.array(a) * (1 - steps) + np.array(b) * steps, np.array(c) * (1 - steps) + np.array(d) * steps
    grid = float(np.sqrt(((left[:, None] - right[None]) ** 2).sum(axis=2)).min())
    spacing = (math.dist(a, b) + math.dist(c, d)) / 400
    found = segment_distance_m(a, b, c, d)
    assert grid - spacing - 1e-9 <= found <= grid + 1e-9


@settings(max_examples=200, deadline=None)
@given(segments, segments, st.floats(0.01, 0.5), st.floats(0.01, 0.5))
def test_fcl_and_the_closed_form_agree_with_coal_apart_and_in_overlap(s1, s2, r1, r2):
    one, two = PlacedCapsule(*s1, r1), PlacedCapsule(*s2, r2)
    found = checked_distance_m(one, two, 1e-3)
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    expected = coal.distance(*shape(one), *shape(two), request, result)
    assert found == pytest.approx(expected, abs=CLOSE_M)
    assert found == pytest.approx(segment_distance_m(*s1, *s2) - r1 - r2, abs=CLOSE_M)


def shape(capsule):
    a, b = np.array(capsule.a), np.array(capsule.b)
    length = float(np.linalg.norm(b - a))
    turn = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), b - a).matrix() if length else np.eye(3)
    return coal.Capsule(capsule.radius, length), coal.Transform3s(turn, (a + b) / 2)


@pytest.mark.parametrize("wrong", [1.0021, float("nan"), float("inf")])
def test_disagreement_is_a_fault(monkeypatch, wrong):
    one, two = (
        PlacedCapsule((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 0.1),
        PlacedCapsule((1.2, 0.0, 0.0), (1.2, 0.0, 1.0), 0.1),
    )
    assert checked_distance_m(one, two, 1e-3) == pytest.approx(1.0, abs=1e-9)
    monkeypatch.setattr(_pair, "segment_distance_m", lambda *ends: wrong + 0.2)
    with pytest.raises(ValueError, match="closed form"):
        checked_distance_m(one, two, 1e-3)


@pytest.fixture(scope="module")
def robot(tmp_path_factory):
    return Robot(ProximityConfig(cache_dir=str(tmp_path_factory.mktemp("capsules"))))


def random_state(robot, rng, far_m=0.0):
    names = tuple(robot.model.names)[2:]
    q = pin.integrate(robot.model, robot.reference, rng.normal(size=robot.model.nv) * 0.3)
    lower, upper = robot.model.lowerPositionLimit[7:], robot.model.upperPositionLimit[7:]
    q[7:] = np.clip(q[7:], lower, upper)
    q[:3] += far_m
    v = rng.normal(size=robot.model.nv) * 0.5
    joints = JointState(names, tuple(q[7:].tolist()), tuple(v[6:].tolist()))
    pose = Odometry(tuple(q[:3].tolist()), tuple(q[3:7].tolist()), tuple(v[:3].tolist()), tuple(v[3:6].tolist()))
    return q, v, joints, pose


def ends_of(robot, q):
    """Ends of all capsules in odom through Pinocchio's own objects."""
    data = robot.model.createData()
    pin.forwardKinematics(robot.model, data, q)
    places = [data.oMi[robot.model.getJointId(c.joint)] for c in robot.capsules]
    return np.array([(p.act(np.array(c.a)), p.act(np.array(c.b))) for p, c in zip(places, robot.capsules, strict=True)])


def test_ends_and_velocities_against_finite_differences(robot):
    rng, body, h = np.random.default_rng(4), CapsuleKinematics(robot), 1e-6
    for _ in range(20):
        q, v, joints, pose = random_state(robot, rng)
        body.evaluate(joints, pose, 0)
        np.testing.assert_allclose(body.ends + body.origin, ends_of(robot, q), atol=1e-12)
        after, before = (ends_of(robot, pin.integrate(robot.model, q, s * h * v)) for s in (1, -1))
        np.testing.assert_allclose(body.velocities, (after - before) / (2 * h), atol=1e-7)


def test_a_pose_that_lags_is_carried_on_by_its_twist(robot):
    rng, body, lag_s = np.random.default_rng(5), CapsuleKinematics(robot), 0.02
    q, v, joints, pose = random_state(robot, rng)
    body.evaluate(joints, pose, round(lag_s * 1e9))
    base = np.zeros_like(v)
    base[:6] = v[:6]
    np.testing.assert_allclose(
        body.ends + body.origin, ends_of(robot, pin.integrate(robot.model, q, base * lag_s)), atol=1e-9
    )


def person(rng, at, n=14):
    """n capsules scattered over a body's volume; two are balls."""
    ends = rng.uniform(-1, 1, (n, 2, 3)) * (0.3, 0.3, 0.8) + at
    ends[:2, 1] = ends[:2, 0]
    rows = zip(ends.tolist(), rng.uniform(0.04, 0.2, n).tolist(), strict=True)
    return HumanPose("p", tuple(Capsule("chest", tuple(a), tuple(b), r) for (a, b), r in rows))


@pytest.mark.parametrize("far_m", [0.0, 3000.0])
def test_the_closest_pair_of_random_scenes_by_brute_force(robot, far_m):
    """All 280 pairs by the closed form on ends from Pinocchio's own objects; near, far and overlapping."""
    rng, body, people = np.random.default_rng(6), CapsuleKinematics(robot), People(ProximityConfig())
    scene, gaps = None, []
    for k in range(40):
        q, _, joints, pose = random_state(robot, rng, far_m)
        body.evaluate(joints, pose, 0)
        pose_p = person(rng, q[:3] + rng.uniform(-1, 1, 3) * (1.5, 1.5, 0.3))
        people.take(k, Humans((pose_p,)))
        (p,) = people.present
        scene = scene or Scene(robot, p)
        scene.measure(p)
        centre = people.centre(p, k, body.origin)
        found = scene.closest(body, centre)
        all_m = [
            [segment_distance_m(*map(tuple, e), c.a, c.b) - r.radius - c.radius for c in pose_p.capsules]
            for e, r in zip(ends_of(robot, q).tolist(), robot.capsules, strict=True)
        ]
        assert all_m[found.robot][found.human] == pytest.approx(np.min(all_m), abs=1e-6)
        gaps.append(np.min(all_m))
    assert min(gaps) < -0.05
    assert max(gaps) > 0.3


def test_a_pair_that_is_not_the_closest_is_found_out(robot, monkeypatch):
    """The search is made to answer capsules 0 and 0 always; within 280 updates the turn comes to a closer pair."""
    rng, body, people = np.random.default_rng(10), CapsuleKinematics(robot), People(ProximityConfig())
    q, _, joints, pose = random_state(robot, rng)
    body.evaluate(joints, pose, 0)
    people.take(0, Humans((person(rng, np.add(q[:3], (1.5, 0.0, 0.0))),)))
    honest = NearestPairs(ProximityConfig(), robot)
    for _ in range(280):
        honest.evaluate(body, 0.0, people, 0)
    monkeypatch.setattr(Scene, "closest", lambda *_: ClosestPair(0, 0, np.zeros(3)))
    misled = NearestPairs(ProximityConfig(), robot)

    def every_turn():
        for _ in range(280):
            misled.evaluate(body, 0.0, people, 0)

    with pytest.raises(ValueError, match="the closest are said to be"):
        every_turn()


def test_joints_beyond_their_range_widen_the_merged_capsule(robot):
    """The gripper, opened 0.3 rad further than its limit, is still inside the hand's capsule."""
    body = CapsuleKinematics(robot)
    names = tuple(robot.model.names)[2:]
    q = robot.reference.copy()
    home = next(k for k, c in enumerate(robot.capsules) if any(s.joint == "gripper_left_joint" for s in c.swept))
    (swept,) = robot.capsules[home].swept
    index = 7 + names.index("gripper_left_joint")
    for beyond in (0.0, 0.3):
        q[index] = robot.model.upperPositionLimit[index] + beyond
        joints = JointState(names, tuple(q[7:].tolist()), (0.0,) * len(names))
        body.evaluate(joints, Odometry((0.0, 0.0, 1.0), (0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)), 0)
        wider = body.radius - [c.radius for c in robot.capsules]
        expected = np.zeros(len(robot.capsules))
        expected[home] = max(0.0, beyond - 0.02) * swept.reach  # 0.02 rad of margin is part of the range
        np.testing.assert_allclose(wider, expected, atol=1e-12)


def test_approach_speed_of_a_capsule_against_the_derivative_of_its_distance():
    """A translating capsule and a fixed point: -d/dt of the distance, by central difference of the closed form."""
    rng, h = np.random.default_rng(7), 1e-6
    for _ in range(50):
        ends, velocity, point = rng.normal(size=(2, 3)), rng.normal(size=3), rng.normal(size=3) * 2

        def distance(t, ends=ends, velocity=velocity, at=point):
            a, b, c = (tuple(p) for p in (*(ends + t * velocity).tolist(), at.tolist()))
            return segment_distance_m(a, b, c, c)

        length2 = ((ends[1] - ends[0]) ** 2).sum(keepdims=True)
        (found,) = approach_speeds(ends[None], np.array([[velocity, velocity]]), length2, point)
        assert found == pytest.approx((distance(-h) - distance(h)) / (2 * h), abs=1e-6)


def test_joint_names_that_do_not_fit(robot):
    body = CapsuleKinematics(robot)
    names = tuple(robot.model.names)[2:]
    pose = Odometry((0.0, 0.0, 1.0), (0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    zeros = (0.0,) * len(names)
    with pytest.raises(ConfigError, match="did you mean 'arm_left_1_joint'"):
        body.evaluate(JointState(("arm_left_1_jont", *names[1:]), zeros, zeros), pose, 0)
    with pytest.raises(ConfigError, match=r"missing.*leg_left_1_joint"):
        body.evaluate(JointState(names[1:], zeros[1:], zeros[1:]), pose, 0)
    with pytest.raises(ConfigError, match="named twice"):
        body.evaluate(JointState((*names, names[0]), (*zeros, 0.0), (*zeros, 0.0)), pose, 0)
    with pytest.raises(ValueError, match="33 names" if len(names) == 33 else "names"):
        body.evaluate(JointState(names, zeros, ()), pose, 0)
