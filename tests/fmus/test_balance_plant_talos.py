"""The balance plant streams a TALOS: Pinocchio on its q and v must find the plant's own truth."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from balance_bench import NOISELESS, bench

pin = pytest.importorskip("pinocchio")

H_M, MASS_KG, G = 0.87668, 90.272192, 9.81


@pytest.fixture(scope="module")
def talos():
    share = Path(pin.__file__).parents[4] / "share" / "example-robot-data" / "robots" / "talos_data"
    return pin.buildModelFromUrdf(str(share / "robots" / "talos_reduced.urdf"), pin.JointModelFreeFlyer())


@pytest.fixture(scope="module")
def default_run():
    """The default cascade, sensors without noise and latency, until the fall begins."""
    watch = (
        "q v com_y com_vy zmp_y foot_left_y foot_right_y upright left_force left_torque right_force right_torque "
        "imu_acceleration com_deviation com_ref_y load_left load_right"
    )
    # footfall pushes are external: Pinocchio's ZMP must leave them out
    _, log = bench().run({**NOISELESS, "footfall_push": 0.0}, t_end=6.0, h=0.005, watch=watch.split())
    standing = log["upright"] > 0.5
    assert standing.any()
    assert not standing.all(), "the default run falls"
    return {k: v[standing] for k, v in log.items()}


def test_com_and_its_velocity_equal_the_plants_within_a_millimetre(talos, default_run):
    data = talos.createData()
    for i in range(len(default_run["t"])):
        pin.centerOfMass(talos, data, default_run["q"][i], default_run["v"][i])
        assert data.com[0][1] == pytest.approx(default_run["com_y"][i], abs=1e-3)
        assert data.com[0][2] == pytest.approx(H_M, abs=1e-3)
        assert data.vcom[0][1] == pytest.approx(default_run["com_vy"][i], abs=1e-3)
        assert np.linalg.norm(default_run["q"][i][3:7]) == pytest.approx(1.0, abs=1e-12)


def test_soles_are_where_the_plants_feet_are_within_a_millimetre(talos, default_run):
    data = talos.createData()
    frames = [talos.getFrameId(f"{side}_sole_link") for side in ("left", "right")]
    down = np.stack([default_run["load_left"] > 0.0, default_run["load_right"] > 0.0], axis=1)
    for i in range(len(default_run["t"])):
        pin.framesForwardKinematics(talos, data, default_run["q"][i])
        for frame, foot, loaded in zip(frames, ("left", "right"), down[i], strict=True):
            sole = data.oMf[frame]
            assert sole.translation[1] == pytest.approx(default_run[f"foot_{foot}_y"][i], abs=1e-3)
            assert sole.rotation[2, 2] == pytest.approx(1.0, abs=1e-9)
            if loaded:
                assert sole.translation[2] == pytest.approx(0.0, abs=1e-3)
            else:
                assert -1e-3 < sole.translation[2] < 0.03


def test_v_is_the_derivative_of_q(talos, default_run):
    """Central differences over 10 ms of a motion with accelerations below 20 m/s^2, jerks below 1000: error < 0.02."""
    q, v = default_run["q"], default_run["v"]
    error = [
        np.abs(pin.difference(talos, q[i - 1], q[i + 1]) / 0.010 - v[i]).max()
        for i in range(1, len(q) - 1)
        if default_run["t"][i] < 2.5
    ]
    assert np.median(error) < 0.005
    assert np.percentile(error, 99) < 0.1  # footfalls change accelerations within a step


def test_zmp_of_pinocchios_momentum_is_the_plants_cop(talos, default_run):
    """Unpushed: ZMP = com - (m h com'' - L') / (m g). Left over: varying inertia, swing leg's lift: below 6 mm."""
    data, t = talos.createData(), default_run["t"]
    momentum = []
    for q, v in zip(default_run["q"], default_run["v"], strict=True):
        pin.computeCentroidalMomentum(talos, data, q, v)
        momentum.append(data.hg.angular[0])
    torque, force = np.gradient(np.array(momentum), t), MASS_KG * np.gradient(default_run["com_vy"], t)
    zmp = default_run["com_y"] - (H_M * force - torque) / (MASS_KG * G)
    error = np.abs(zmp - default_run["zmp_y"])[1:-1]
    assert np.percentile(error, 95) < 0.006
    assert np.percentile(error, 50) < 0.002


def test_wrenches_carry_the_cop_and_the_weight(default_run):
    total, moment = np.zeros(len(default_run["t"])), np.zeros(len(default_run["t"]))
    lateral = np.zeros(len(default_run["t"]))
    for foot in ("left", "right"):
        force, torque = default_run[f"{foot}_force"], default_run[f"{foot}_torque"]
        assert np.all(force[:, 2] >= 0.0)
        loaded = force[:, 2] > 1.0
        local = torque[loaded, 0] / force[loaded, 2]
        assert np.all(np.abs(local) <= 0.06 + 1e-9), "CoP inside the sole"
        assert np.all(np.abs(torque[loaded, 1] / force[loaded, 2]) < 0.1)
        total += force[:, 2]
        lateral += force[:, 1]
        moment += torque[:, 0] + default_run[f"foot_{foot}_y"] * force[:, 2]
    assert total == pytest.approx(MASS_KG * G, rel=1e-9)
    assert moment / total == pytest.approx(default_run["zmp_y"], abs=1e-6)
    acceleration = np.gradient(default_run["com_vy"], default_run["t"])
    assert np.percentile(np.abs(lateral / MASS_KG - acceleration), 95) < 0.05


def test_imu_agrees_with_pinocchio(talos, default_run):
    """Specific force at the torso: Pinocchio's classical acceleration with a from differences of v, plus gravity."""
    t = default_run["t"]
    frame = talos.addFrame(
        pin.Frame("imu_here", 1, 0, pin.SE3(np.eye(3), np.array([0.0497762, 0.0, 0.14987])), pin.FrameType.OP_FRAME)
    )
    data = talos.createData()
    error = []
    for i in range(1, len(t) - 1):
        if t[i] > 2.5:
            break
        a = (default_run["v"][i + 1] - default_run["v"][i - 1]) / (t[i + 1] - t[i - 1])
        pin.forwardKinematics(talos, data, default_run["q"][i], default_run["v"][i], a)
        pin.updateFramePlacements(talos, data)
        gravity = data.oMf[frame].rotation.T @ [0.0, 0.0, G]
        felt = pin.getFrameClassicalAcceleration(talos, data, frame, pin.LOCAL).linear + gravity
        error.append(np.abs(felt - default_run["imu_acceleration"][i]).max())
    assert np.median(error) < 0.01
    assert np.percentile(error, 95) < 0.1


def test_plan_is_where_the_com_is_while_nothing_disturbs(default_run):
    early = default_run["t"] < 2.5
    assert np.abs(default_run["com_deviation"][early]).max() < 0.02
    assert np.abs(default_run["com_ref_y"]).max() < 0.085
