"""Whole-body quantities on random states, against finite differences, sums over links and rnea."""

from __future__ import annotations

import math

import numpy as np
import pinocchio as pin
import pytest
from balance_motion import MODEL, NAMES, Q0, ROBOT, SOLES, Motion

from foreshock.errors import ConfigError
from foreshock.messages import JointState, Odometry
from foreshock_detectors.balance import BalanceConfig
from foreshock_detectors.balance._kinematics import Kinematics, SolePose
from foreshock_detectors.balance._model import RobotModel, talos_files
from foreshock_detectors.balance._zmp import zmp_from_momentum, zmp_from_wrenches


def random_state(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Around half-sitting, leaned by up to about 0.3 rad on every axis, with lively velocities."""
    rng = np.random.default_rng(seed)
    q = pin.integrate(MODEL, Q0, rng.normal(0.0, 0.15, MODEL.nv))
    return q, rng.normal(0.0, 0.5, MODEL.nv), rng.normal(0.0, 2.0, MODEL.nv)


def messages(q: np.ndarray, v: np.ndarray) -> tuple[JointState, Odometry]:
    joints = JointState(NAMES, tuple(q[7:].tolist()), tuple(v[6:].tolist()))
    parts = [tuple(x.tolist()) for x in (q[:3], q[3:7], v[:3], v[3:6])]
    return joints, Odometry(*parts)


def evaluate(q, v, lag_ns=0):
    return Kinematics(ROBOT).evaluate(1, *messages(q, v), lag_ns)


def link_com(q: np.ndarray) -> np.ndarray:
    """Sum over links of mass times place, without Pinocchio's centre-of-mass algorithms."""
    data = MODEL.createData()
    pin.forwardKinematics(MODEL, data, q)
    moments = [body.mass * data.oMi[i].act(body.lever) for i, body in enumerate(MODEL.inertias) if i]
    return np.sum(moments, axis=0) / sum(body.mass for i, body in enumerate(MODEL.inertias) if i)


@pytest.mark.parametrize("seed", range(5))
def test_com_its_velocity_and_sole_velocities(seed):
    q, v, _ = random_state(seed)
    body, h = evaluate(q, v), 1e-6
    before, after = pin.integrate(MODEL, q, -v * h), pin.integrate(MODEL, q, v * h)
    assert body.com == pytest.approx(link_com(q), abs=1e-12)
    # central differences with h = 1e-6: truncation 1e-11, rounding 1e-10
    assert body.velocity == pytest.approx((link_com(after) - link_com(before)) / (2 * h), abs=1e-7)
    for side, sole in (("left", body.left), ("right", body.right)):
        places = []
        for state in (before, after):
            data = MODEL.createData()
            pin.framesForwardKinematics(MODEL, data, state)
            places.append(data.oMf[SOLES[side]].translation.copy())
        assert (sole.vx, sole.vy) == pytest.approx(((places[1] - places[0]) / (2 * h))[:2], abs=1e-7)
        assert (sole.x, sole.y, sole.z) == pytest.approx((places[0] + places[1]) / 2, abs=1e-9)


@pytest.mark.parametrize("phi", [-0.2, 0.0, 0.15])
def test_talos_lean_has_the_closed_form_com(phi):
    y = 0.54162 * math.sin(phi) + 0.00125
    q = Motion(com_y=lambda t: y).q(0.0)
    body = evaluate(q, np.zeros(MODEL.nv))
    assert body.com[1] == pytest.approx(y, abs=2e-5)
    assert (body.left.z, body.right.z) == pytest.approx((0.0, 0.0), abs=1e-3)
    assert (body.left.y, body.right.y) == pytest.approx((0.085, -0.085), abs=1e-3)


@pytest.mark.parametrize(("roll", "yaw"), [(0.2, 0.0), (-0.1, 0.7), (0.15, -2.5)])
def test_torso_roll_and_heading(roll, yaw):
    q = Q0.copy()
    q[3:7] = pin.Quaternion(pin.rpy.rpyToMatrix(roll, 0.0, yaw)).coeffs()
    body = evaluate(q, np.zeros(MODEL.nv))
    assert body.heading == pytest.approx((math.cos(yaw), math.sin(yaw)))
    assert body.torso_roll_rad == pytest.approx(roll, abs=1e-9)


@pytest.mark.parametrize("seed", range(5))
def test_zmp_from_momentum_and_from_split_wrenches_agree_with_rnea(seed):
    q, v, a = random_state(seed)
    data, ground = MODEL.createData(), -0.02
    pin.computeCentroidalMomentumTimeVariation(MODEL, data, q, v, a)
    rate = data.dhg.vector.tolist()
    com = tuple(data.com[0].tolist())
    root = pin.rnea(MODEL, data, q, v, a)[:6]
    total = data.oMi[1].act(pin.Force(root))
    force, moment = total.linear, total.angular - np.cross([0, 0, ground], total.linear)
    expected = (-moment[1] / force[2], moment[0] / force[2])
    assert zmp_from_momentum(com, rate[:3], rate[3:], ROBOT.mass_kg, 9.81, ground) == pytest.approx(expected, abs=1e-12)

    rng = np.random.default_rng(seed)
    part = pin.Force(rng.normal(0, 50, 6) + 0.5 * total.vector)
    contacts = []
    for wrench in (part, total - part):
        placement = pin.SE3(pin.exp3(rng.normal(0, 0.1, 3)), rng.normal(0, 0.1, 3))
        local = placement.actInv(wrench)
        x, y, z = placement.translation
        sole = SolePose(x, y, z, 0.0, 0.0, placement.rotation.tolist())
        contacts.append((sole, tuple(local.linear), tuple(local.angular)))
    assert zmp_from_wrenches(contacts, ground, 100.0) == pytest.approx(expected, abs=1e-9)


def test_zmp_is_undefined_without_load():
    assert zmp_from_momentum((0, 0, 0.9), (0, 0, -880.0), (0, 0, 0), 90.0, 9.81, 0.0) is None
    flat = SolePose(0, 0, 0, 0, 0, np.eye(3).tolist())
    assert zmp_from_wrenches([(flat, (0, 0, 20.0), (0, 0, 0))], 0.0, 100.0) is None


def test_joint_order_of_the_stream_does_not_matter():
    q, v, _ = random_state(1)
    joints, odometry = messages(q, v)
    order = np.random.default_rng(0).permutation(len(NAMES))
    shuffled = JointState(
        *(tuple(field[k] for k in order) for field in (joints.name, joints.position, joints.velocity))
    )
    assert Kinematics(ROBOT).evaluate(1, shuffled, odometry, 0) == Kinematics(ROBOT).evaluate(1, joints, odometry, 0)


@pytest.mark.parametrize("lag_ns", [4_000_000, -3_000_000])
def test_older_odometry_is_carried_to_the_joint_state_by_its_twist(lag_ns):
    q, v, _ = random_state(2)
    base = np.concatenate([v[:6], np.zeros(MODEL.nv - 6)])
    moved = pin.integrate(MODEL, q, base * lag_ns / 1e9)
    assert evaluate(q, v, lag_ns).com == pytest.approx(evaluate(moved, v).com, abs=1e-12)


def test_continuous_joints_are_cosine_and_sine(tmp_path):
    urdf = tmp_path / "wheel.urdf"
    inertia = "<inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/>"
    inertial = f"<inertial><mass value='1'/><origin xyz='0.1 0 0'/>{inertia}</inertial>"
    links = "".join(f"<link name='{n}'>{inertial}</link>" for n in ("base", "left", "right"))
    joints = "".join(
        f"<joint name='j_{n}' type='{t}'><parent link='base'/><child link='{n}'/><axis xyz='0 0 1'/>{limit}</joint>"
        for n, t, limit in (
            ("left", "continuous", ""),
            ("right", "revolute", "<limit lower='-3' upper='3' effort='1' velocity='1'/>"),
        )
    )
    urdf.write_text(f"<robot name='wheel'>{links}{joints}</robot>")
    config = BalanceConfig(urdf=str(urdf), left_sole_frame="left", right_sole_frame="right", torso_frame="base")
    still = Odometry((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    angle = 2.0
    body = Kinematics(RobotModel(config)).evaluate(
        1, JointState(("j_right", "j_left"), (0.3, angle), (0.0, 0.0)), still, 0
    )
    expected = [(0.1 + 0.1 * f(angle) + 0.1 * f(0.3)) / 3 for f in (math.cos, math.sin)]
    expected[1] -= 0.1 / 3
    assert body.com[:2] == pytest.approx(expected)


def with_field(message, **changes):
    return type(message)(**{f: getattr(message, f) for f in message.__struct_fields__} | changes)


@pytest.mark.parametrize(
    ("changes", "error", "words"),
    [
        ({"position": lambda x: (math.nan, *x[1:])}, ValueError, "leg_left_1_joint"),
        ({"velocity": lambda x: (*x[:-1], math.inf)}, ValueError, "head_2_joint"),
        ({"velocity": lambda x: ()}, ValueError, "0 velocities"),
        ({"name": lambda x: ("leg_left_1_jnt", *x[1:])}, ConfigError, "did you mean 'leg_left_1_joint'"),
        ({"name": lambda x: (x[1], *x[1:])}, ConfigError, "named twice: leg_left_2_joint"),
        ({f: lambda x: x[:-1] for f in ("name", "position", "velocity")}, ConfigError, "missing: head_2_joint"),
    ],
)
def test_malformed_joint_states_are_named(changes, error, words):
    joints, odometry = messages(Q0, np.zeros(MODEL.nv))
    bad = with_field(joints, **{k: f(getattr(joints, k)) for k, f in changes.items()})
    with pytest.raises(error, match=words):
        Kinematics(ROBOT).evaluate(1, bad, odometry, 0)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"orientation": (0.0, 0.0, 0.0, 1.02)}, "norm 1.0200"),
        ({"orientation": (0.0, 0.0, 0.0, 0.0)}, "norm 0.0000"),
        ({"position": (0.0, math.nan, 0.0)}, "position is not finite"),
        ({"angular": (0.0, math.inf, 0.0)}, "angular is not finite"),
    ],
)
def test_malformed_odometry_is_named(changes, words):
    joints, odometry = messages(Q0, np.zeros(MODEL.nv))
    with pytest.raises(ValueError, match=words):
        Kinematics(ROBOT).evaluate(1, joints, with_field(odometry, **changes), 0)


def test_held_joints_stay_at_the_reference_configuration():
    joints, odometry = messages(Q0, np.zeros(MODEL.nv))
    fewer = JointState(joints.name[:-2], joints.position[:-2], joints.velocity[:-2])
    robot = RobotModel(BalanceConfig(held_joints=("head_1_joint", "head_2_joint")))
    body = Kinematics(robot).evaluate(1, fewer, odometry, 0)
    assert body.com == pytest.approx(link_com(Q0), abs=1e-12)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"left_sole_frame": "left_sole"}, "did you mean 'left_sole_link'"),
        ({"torso_frame": "torso"}, "balance.torso_frame"),
        ({"imu_frame": "imu"}, "balance.imu_frame: talos_reduced.urdf has no frame 'imu'"),
        ({"reference": "half_siting"}, "did you mean 'half_sitting'|known: half_sitting"),
        ({"held_joints": ("head_joint",)}, "did you mean 'head_[12]_joint'"),
        ({"urdf": "/nowhere/robot.urdf"}, "balance.urdf: /nowhere/robot.urdf: no such file"),
        ({"srdf": "/nowhere/robot.srdf"}, "balance.srdf"),
        ({"urdf": str(talos_files()[1])}, "not a URDF"),
    ],
)
def test_a_wrong_name_or_file_in_the_configuration_is_one_clear_error(settings, words):
    with pytest.raises(ConfigError, match=words):
        RobotModel(BalanceConfig(**settings))


@pytest.mark.parametrize(
    "settings",
    [
        {"slip_m": math.nan},
        {"slip_m": 0.0},
        {"gap_s": -1.0},
        {"contact_off_n": 200.0},
        {"release_ratio": 1.5},
        {"sway_ratio": 0.9},
        {"sole_x_min_m": 0.2},
        {"gyro_bias_limit_rad_s": 0.7},
    ],
)
def test_settings_out_of_range_are_refused_by_name(settings):
    with pytest.raises(ConfigError, match=next(iter(settings))):
        BalanceConfig(**settings)
