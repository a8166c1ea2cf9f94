"""What the sensor streams say agrees with MuJoCo's own values while nobody pushes."""

from __future__ import annotations

import math

import numpy as np
import pytest

pytest.importorskip("mujoco")
pytest.importorskip("pinocchio")

import mujoco
import pinocchio as pin
from mujoco_runs import TICK_NS, new_twin

from foreshock.messages import Imu, JointState, Odometry, WrenchStamped
from foreshock_twins.mujoco._twin import MujocoTwin

QUIET = dict.fromkeys(
    (
        "encoder_noise",
        "joint_rate_noise",
        "effort_noise",
        "base_noise",
        "base_rate_noise",
        "attitude_noise",
        "gyro_noise",
        "accelerometer_noise",
        "force_noise",
        "torque_noise",
        "latency",
    ),
    0.0,
)


@pytest.fixture(scope="module")
def twin() -> MujocoTwin:
    return new_twin()


def streamed(twin: MujocoTwin, samples: list) -> dict[str, object]:
    return {s.channel.removeprefix("talos/"): s.value for s in samples}


def state(twin: MujocoTwin, now: dict[str, object]) -> tuple[np.ndarray, np.ndarray]:
    """q and v of Pinocchio from joints/state and base/odometry, as a detector builds them."""
    joints, base = now["joints/state"], now["base/odometry"]
    assert isinstance(joints, JointState)
    assert isinstance(base, Odometry)
    model = twin._body.pin_model
    q, v = np.zeros(model.nq), np.zeros(model.nv)
    q[:7], v[:6] = (*base.position, *base.orientation), (*base.linear, *base.angular)
    for name, at, rate in zip(joints.name, joints.position, joints.velocity, strict=True):
        joint = model.joints[model.getJointId(name)]
        q[joint.idx_q], v[joint.idx_v] = at, rate
    return q, v


def contact_pressure(twin: MujocoTwin) -> tuple[float, float]:
    """Centre of pressure by MuJoCo's contacts: the sum of f_z p over that of f_z, tangential forces at height 0."""
    data, load, moment, force = twin._data, 0.0, np.zeros(2), np.empty(6)
    for k in range(data.ncon):
        mujoco.mj_contactForce(twin.model, data, k, force)
        sign = 1.0 if twin.model.geom_bodyid[data.contact.geom[k, 0]] == 0 else -1.0
        world = sign * data.contact.frame[k].reshape(3, 3).T @ force[:3]
        p = data.contact.pos[k]
        load += world[2]
        moment += p[:2] * world[2] - p[2] * world[:2]
    return moment[0] / load, moment[1] / load


def wrench_pressure(twin: MujocoTwin, q: np.ndarray, now: dict[str, object]) -> tuple[float, float]:
    """Centre of pressure by the sole wrenches, with the soles where the kinematics has them."""
    model = twin._body.pin_model
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)
    total, moment = np.zeros(3), np.zeros(3)
    for side in ("left", "right"):
        wrench = now[f"{side}_sole/wrench"]
        assert isinstance(wrench, WrenchStamped)
        place = data.oMf[model.getFrameId(wrench.frame_id)]
        force = place.rotation @ wrench.force
        total += force
        moment += place.rotation @ wrench.torque + np.cross(place.translation, force)
    return -moment[1] / total[2], moment[0] / total[2]


def test_without_noise_com_capture_point_and_zmp_are_mujocos_own(twin: MujocoTwin) -> None:
    twin.reset({**QUIET, "step_length": 0.15, "start_time": 0.2}, 1)
    model, kinematics = twin._body.pin_model, twin._body.pin_model.createData()
    omega = twin._control.gait.omega
    for k in range(500):
        now = streamed(twin, list(twin.advance((k + 1) * TICK_NS)))
        if k % 10:
            continue
        q, v = state(twin, now)
        com = pin.centerOfMass(model, kinematics, q, v)
        truth = twin._data.subtree_com[twin._body.base_id]
        # two programs, double precision, the same masses: 1e-9 m is a hundred thousand roundings of 1 m
        assert com == pytest.approx(truth, abs=1e-9)
        mujoco.mj_subtreeVel(twin.model, twin._data)
        rate = twin._data.subtree_linvel[twin._body.base_id]
        assert kinematics.vcom[0] == pytest.approx(rate, abs=1e-9)
        xi = com[:2] + kinematics.vcom[0][:2] / omega
        probes = twin.probes()
        assert xi == pytest.approx((probes["xi_x"], probes["xi_y"]), abs=1e-9)
        zmp = contact_pressure(twin)
        # the same contacts, summed in another order
        assert wrench_pressure(twin, q, now) == pytest.approx(zmp, abs=1e-9)
        assert (probes["zmp_x"], probes["zmp_y"]) == pytest.approx(zmp, abs=1e-9)


def test_with_noise_they_agree_within_what_the_noise_explains(twin: MujocoTwin) -> None:
    """Five standard deviations: J S J' from the noise of every stream; 400 x 6 values exceed it with p = 1e-3."""
    twin.reset({"latency": 0.0, "step_length": 0.15, "start_time": 0.2}, 2)
    p, model = twin._p, twin._body.pin_model
    kinematics, omega = model.createData(), twin._control.gait.omega
    position = np.array([p["base_noise"]] * 3 + [p["attitude_noise"]] * 3 + [p["encoder_noise"]] * (model.nv - 6))
    rate = np.array([p["base_rate_noise"]] * 3 + [p["gyro_noise"]] * 3 + [p["joint_rate_noise"]] * (model.nv - 6))
    worst = 0.0
    for k in range(400):
        now = streamed(twin, list(twin.advance((k + 1) * TICK_NS)))
        q, v = state(twin, now)
        jacobian = pin.jacobianCenterOfMass(model, kinematics, q)
        com_sd = np.sqrt((jacobian**2) @ position**2)[:2]
        rate_sd = np.sqrt((jacobian**2) @ rate**2)[:2]
        com = pin.centerOfMass(model, kinematics, q, v)[:2].copy()
        probes = twin.probes()
        xi = com + kinematics.vcom[0][:2] / omega
        xi_sd = np.hypot(com_sd, rate_sd / omega)
        for found, true, sd in ((com, "com", com_sd), (xi, "xi", xi_sd)):
            off = np.abs(found - (probes[f"{true}_x"], probes[f"{true}_y"])) / sd
            worst = max(worst, float(off.max()))
        zmp = wrench_pressure(twin, q, now)
        load = probes["load_left"] + probes["load_right"]
        lever = 0.15 + abs(probes["com_x"]) + abs(probes["com_y"])
        zmp_sd = math.sqrt(2.0) * math.hypot(p["torque_noise"], p["force_noise"] * lever) / load + 2.0 * p["base_noise"]
        for a, name in zip(zmp, ("zmp_x", "zmp_y"), strict=True):
            worst = max(worst, abs(a - probes[name]) / zmp_sd)
    assert 2.0 < worst < 5.0


def test_the_soles_carry_the_weight_and_the_inertial_unit_feels_gravity(twin: MujocoTwin) -> None:
    twin.reset({**QUIET, "stepping": 0.0}, 1)
    now = streamed(twin, list(twin.advance(2_000_000_000)))
    load = sum(now[f"{s}_sole/wrench"].force[2] for s in ("left", "right"))  # type: ignore[attr-defined]
    assert load == pytest.approx(9.81 * twin._body.mass_kg, rel=1e-3)  # at rest but for a residual sway
    imu = now["imu/torso"]
    assert isinstance(imu, Imu)
    assert math.hypot(*imu.linear_acceleration) == pytest.approx(9.81, rel=2e-3)
    joints = now["joints/state"]
    assert isinstance(joints, JointState)
    knee = joints.name.index("leg_left_4_joint")
    assert abs(joints.effort[knee]) > 20.0  # bent knees carry the body


def test_contact_torque_of_a_push_shows_as_zmp_beside_the_model(twin: MujocoTwin) -> None:
    """The wrenches keep to MuJoCo's contacts also while pushed; the state alone does not know of the push."""
    twin.reset({**QUIET, "stepping": 0.0, "push_impulse": 20.0, "push_duration": 0.4, "push_time": 0.5}, 1)
    now = streamed(twin, list(twin.advance(800_000_000)))
    q, _ = state(twin, now)
    assert wrench_pressure(twin, q, now) == pytest.approx(contact_pressure(twin), abs=1e-6)


def test_hands_feel_see_and_plan_the_same_attitude(twin: MujocoTwin) -> None:
    twin.reset({**QUIET, "stepping": 0.0, "object_tilt_noise": 0.0, "object_noise": 0.0, "arms_forward": 1.0}, 1)
    now = streamed(twin, list(twin.advance(2_000_000_000)))
    for side in ("left", "right"):
        imu, seen, command, arm = (
            now[f"{side}_{name}"]
            for name in ("gripper/imu", "gripper/object", "gripper/object_command", "arm/odometry")
        )
        assert isinstance(imu, Imu)
        assert isinstance(seen, Odometry)
        assert isinstance(command, Odometry)
        assert isinstance(arm, Odometry)
        assert imu.orientation == seen.orientation
        # MuJoCo's site and Pinocchio's frame; q and -q are one rotation
        assert abs(np.dot(seen.orientation, arm.orientation)) == pytest.approx(1.0, abs=1e-9)
        assert seen.position == pytest.approx(arm.position, abs=1e-9)
        # servos that carry the arms leave some milliradians, and the legs some millimetres
        assert abs(np.dot(seen.orientation, command.orientation)) > np.cos(0.5 * 0.02)
        assert seen.position == pytest.approx(command.position, abs=0.015)
        assert math.hypot(*imu.linear_acceleration) == pytest.approx(9.81, rel=5e-3)
