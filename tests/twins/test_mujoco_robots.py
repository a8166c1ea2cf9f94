"""Another humanoid in the MuJoCo twin: Unitree's G1 from its URDF, and a humanoid of boxes from MJCF."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip("mujoco")
pytest.importorskip("pinocchio")

from mujoco_runs import new_twin, run

from foreshock.messages import Imu, JointState
from foreshock_twins.mujoco import MujocoTwinConfig, RobotConfig
from foreshock_twins.mujoco._robot import share_folder

G1 = RobotConfig(
    model=str(share_folder() / "example-robot-data/robots/g1_description/urdf/g1_29dof_rev_1_0.urdf"),
    torso="torso_link",
    left_foot="left_ankle_roll_link",
    right_foot="right_ankle_roll_link",
    left_hand="",
    right_hand="",
    sole_z_m=-0.035,
    sole_x_min_m=-0.05,
    sole_x_max_m=0.12,
    sole_y_half_m=0.03,
    posture={
        f"{side}_{joint}_joint": angle
        for side in ("left", "right")
        for joint, angle in (("hip_pitch", -0.2), ("knee", 0.42), ("ankle_pitch", -0.22))
    },
)

LEG = """
<body name="{side}_hip" pos="0 {y} 0">
  <joint name="{side}_hip_roll" axis="1 0 0" range="-1 1" actuatorfrcrange="-80 80"/>
  <inertial pos="0 0 0" mass="1" diaginertia="0.002 0.002 0.002"/>
  <body name="{side}_thigh" pos="0 0 -0.05">
    <joint name="{side}_hip_pitch" axis="0 1 0" range="-2 2" actuatorfrcrange="-120 120"/>
    <geom type="capsule" fromto="0 0 0 0 0 -0.3" size="0.05" mass="3"/>
    <body name="{side}_shin" pos="0 0 -0.3">
      <joint name="{side}_knee" axis="0 1 0" range="-0.1 2.4" actuatorfrcrange="-150 150"/>
      <geom type="capsule" fromto="0 0 0 0 0 -0.3" size="0.04" mass="2"/>
      <body name="{side}_ankle" pos="0 0 -0.3">
        <joint name="{side}_ankle_pitch" axis="0 1 0" range="-1 1" actuatorfrcrange="-90 90"/>
        <inertial pos="0 0 0" mass="0.3" diaginertia="0.001 0.001 0.001"/>
        <body name="{side}_foot" pos="0 0 -0.06">
          <joint name="{side}_ankle_roll" axis="1 0 0" range="-1 1" actuatorfrcrange="-60 60"/>
          <geom type="box" pos="0.02 0 0.01" size="0.1 0.05 0.01" mass="0.8"/>
        </body>
      </body>
    </body>
  </body>
</body>
"""
MJCF = f"""
<mujoco model="boxes"><compiler angle="radian"/><worldbody>
<body name="pelvis" pos="0 0 0.8"><freejoint/>
  <geom type="box" size="0.08 0.12 0.06" mass="8"/>
  <body name="chest" pos="0 0 0.1">
    <joint name="waist" axis="0 0 1" range="-1 1" actuatorfrcrange="-60 60"/>
    <geom type="box" pos="0 0 0.15" size="0.1 0.15 0.15" mass="12"/>
  </body>
  {LEG.format(side="left", y="0.09")}{LEG.format(side="right", y="-0.09")}
</body></worldbody></mujoco>
"""
BOXES = {
    "torso": "chest",
    "left_foot": "left_foot",
    "right_foot": "right_foot",
    "left_hand": "",
    "right_hand": "",
    "sole_x_min_m": -0.08,
    "sole_x_max_m": 0.12,
    "sole_y_half_m": 0.05,
    "posture": {
        f"{side}_{joint}": angle
        for side in ("left", "right")
        for joint, angle in (("hip_pitch", -0.3), ("knee", 0.6), ("ankle_pitch", -0.3))
    },
}


def stands(robot: RobotConfig, joints: int) -> None:
    twin = new_twin(MujocoTwinConfig(robot=robot))
    seen = run(twin, 3.0, stepping=0.0)
    assert not seen.events
    weight = seen.truth[-1]["load_left"] + seen.truth[-1]["load_right"]
    assert weight == pytest.approx(9.81 * twin._body.mass_kg, rel=0.01)
    state = list(seen.values("joints/state").values())[-1]
    assert isinstance(state, JointState)
    assert len(state.name) == joints
    imu = list(seen.values("imu/torso").values())[-1]
    assert isinstance(imu, Imu)
    assert imu.frame_id == robot.torso
    pushed = run(twin, 4.0, stepping=0.0, push_impulse=2.0 * twin._body.mass_kg, push_time=1.0)
    assert pushed.fell  # at 2 m/s


def test_a_g1_stands_feels_and_falls() -> None:
    stands(G1, 29)


def test_a_robot_from_mjcf_stands_feels_and_falls(tmp_path: Path) -> None:
    path = tmp_path / "boxes.xml"
    path.write_text(MJCF)
    stands(RobotConfig(model=str(path), **BOXES), 11)  # type: ignore[arg-type]  # of several types
