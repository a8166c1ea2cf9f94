"""The robot in MuJoCo and in Pinocchio, and the maps between the two.

MuJoCo computes the world; Pinocchio is the robot's own model of itself, for inverse kinematics and state estimation. A
payload or a weak joint changes the first and not the second.

Actuators are position servos with the effort limits of the model file. Their stiffness follows from M g h (mass,
height of the centre of mass), so that another robot needs no tuning: legs 10.4, ankles 6.5, trunk 3.9, others 0.39.
For TALOS (M g h = 770 N m) these are the values that walking was found with. Reflected rotor inertia 1.3e-4 of it.
"""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from foreshock.errors import ConfigError, nearest
from foreshock_twins.mujoco._robot import RobotConfig, robot_files, share_folder

__all__ = ["FLOOR_BIT", "HUMAN_BIT", "SIDES", "Body", "Floats"]

Floats = NDArray[np.float64]
SIDES = ("left", "right")
FLOOR_BIT, HUMAN_BIT = 1, 2
"""Contact types: the floor and what lies on it, and humans. The robot's parts touch both, and not each other."""

STEP_S = 0.001
"""MuJoCo's time step."""

_GRAVITY = 9.81
_STIFFNESS = {"leg": 10.4, "ankle": 6.5, "torso": 3.9, "other": 0.39}
_DAMPING_S = {"leg": 0.019, "ankle": 0.018, "torso": 0.027, "other": 0.05}
_ARMATURE = 1.3e-4
_JOINT_DAMPING = 6.5e-4
_SOLE_THICKNESS_M = 0.02


class Body:
    """What is fixed about the robot and the things in its world, compiled.

    Attributes:
        model: compiled mujoco.MjModel; never changed: every run works on a copy.
        pin_model: Pinocchio's model, without payload, its root a free flyer.
        joints: joint names in Pinocchio's order; positions and velocities of a robot state are in this order.
        q0: configuration of the reference posture with the soles on the ground (Pinocchio, nq).
        mass_kg: of the robot without payload.
        com_height_m: in the reference posture.
        legs: indices into joints of both legs.
        ankles: of each side, (pitch, roll) indices into joints.
        hip_rolls: of each side, index into joints.
        soles: Pinocchio's frame ids of the soles, left and right.
        torso: Pinocchio's frame id of the torso.

    Args:
        robot: which robot.
        furnish: adds what else stands in the world, before the model is compiled.
        visual: keep meshes that are for show alone.
    """

    def __init__(self, robot: RobotConfig, furnish: Any = None, visual: bool = False) -> None:
        self.robot = robot
        path, srdf = robot_files(robot)
        self.pin_model, self.q0 = _pinocchio(robot, path, srdf)
        pm = self.pin_model
        self.joints = tuple(pm.names[2:])
        self.pin_q = np.array([pm.joints[pm.getJointId(n)].idx_q for n in self.joints])
        self.pin_v = np.array([pm.joints[pm.getJointId(n)].idx_v for n in self.joints])
        self.effort_limit: Floats = np.array(pm.upperEffortLimit[self.pin_v])
        self._place_soles(robot)
        data = pm.createData()
        com = pin.centerOfMass(pm, data, self.q0)
        self.mass_kg, self.com_height_m = float(pin.computeTotalMass(pm)), float(com[2])
        self._find_parts(robot)
        spec = self._spec(path, robot, visual)
        if furnish is not None:
            furnish(spec)
        try:
            self.model = spec.compile()
        except ValueError as e:
            raise ConfigError("twin.robot.model", f"{path}: MuJoCo does not compile it: {e}") from e
        self._map()

    def mujoco_q(self, q: Floats) -> Floats:
        """Pinocchio's configuration as the robot's part of MuJoCo's qpos: quaternion wxyz, joints in its order."""
        qpos: Floats = np.empty(7 + len(self.joints))
        qpos[:3] = q[:3]
        qpos[3:7] = q[[6, 3, 4, 5]]
        qpos[self.mj_q] = q[self.pin_q]
        return qpos

    def pinocchio_state(self, qpos: Floats, qvel: Floats) -> tuple[Floats, Floats]:
        """MuJoCo's qpos and qvel as Pinocchio's q and v, whose linear velocity is in the base's own axes."""
        q, v = np.empty(self.pin_model.nq), np.empty(self.pin_model.nv)
        q[:3] = qpos[:3]
        q[3:7] = qpos[[4, 5, 6, 3]]
        q[self.pin_q] = qpos[self.mj_q]
        v[:3] = rotation(q[3:7]).T @ qvel[:3]
        v[3:6] = qvel[3:6]
        v[self.pin_v] = qvel[self.mj_v]
        return q, v

    def change(self, table: dict[str, float], name: str) -> Floats:
        """A table of joint positions as a vector over joints.

        Raises:
            ConfigError: it names no joint of the robot.
        """
        result: Floats = np.zeros(len(self.joints))
        for joint, value in table.items():
            if joint not in self.joints:
                problem = f"the robot has no joint {joint!r}"
                raise ConfigError(f"twin.robot.{name}", problem, nearest(joint, self.joints))
            result[self.joints.index(joint)] = value
        return result

    def _place_soles(self, robot: RobotConfig) -> None:
        """Add a frame on the surface of each sole, and put the base so that they lie on the ground about x = y = 0."""
        pm, lift = self.pin_model, pin.SE3(np.eye(3), np.array([0.0, 0.0, robot.sole_z_m]))
        ids = []
        for side in SIDES:
            name = getattr(robot, f"{side}_foot")
            frame = pm.frames[self._frame(name, f"{side}_foot")]
            placed = pin.Frame(f"{side}-sole", frame.parentJoint, frame.placement * lift, pin.FrameType.OP_FRAME)
            ids.append(pm.addFrame(placed))
        self.soles = (ids[0], ids[1])
        self.torso = self._frame(robot.torso, "torso")
        data = pm.createData()
        pin.framesForwardKinematics(pm, data, self.q0)
        middle = 0.5 * (data.oMf[ids[0]].translation + data.oMf[ids[1]].translation)
        self.q0[:3] -= middle

    def _frame(self, name: str, key: str) -> int:
        """Id of a frame; getFrameId alone would answer nframes for an unknown name."""
        if not self.pin_model.existFrame(name):
            known = [f.name for f in self.pin_model.frames]
            raise ConfigError(f"twin.robot.{key}", f"the robot has no link {name!r}", nearest(name, known))
        return int(self.pin_model.getFrameId(name))

    def _supports(self, frame: int) -> list[int]:
        """Indices into joints of those between the base and a frame, from the base outwards."""
        pm = self.pin_model
        chain = list(pm.supports[pm.frames[frame].parentJoint])
        return [self.joints.index(pm.names[j]) for j in chain if j >= 2]

    def _find_parts(self, robot: RobotConfig) -> None:
        """Legs, and the joints that shift the centre of pressure, by the directions of their axes."""
        pm, data = self.pin_model, self.pin_model.createData()
        pin.computeJointJacobians(pm, data, self.q0)
        axes = [data.J[3:6, v] for v in self.pin_v]
        chains = [self._supports(f) for f in self.soles]
        self.chains = chains
        self.legs = np.array(chains[0] + chains[1])
        self.trunk = np.array([j for j in self._supports(self.torso) if j not in self.legs], dtype=int)
        self.others = np.array(
            [j for j in range(len(self.joints)) if j not in self.legs and j not in self.trunk], dtype=int
        )
        self.ankles: list[tuple[int, int]] = []
        self.hip_rolls: list[int] = []
        self.axis_signs: list[tuple[float, float, float]] = []
        for side, chain in zip(SIDES, chains, strict=True):
            about = {k: [j for j in chain if abs(axes[j][k]) > 0.7] for k in (0, 1)}
            if len(about[0]) < 2 or not about[1]:
                problem = f"the leg to {getattr(robot, f'{side}_foot')!r} has no two roll joints and a pitch joint"
                raise ConfigError(
                    f"twin.robot.{side}_foot", problem, f"; its joints: {[self.joints[j] for j in chain]}"
                )
            pitch, roll, hip = about[1][-1], about[0][-1], about[0][0]
            self.ankles.append((pitch, roll))
            self.hip_rolls.append(hip)
            self.axis_signs.append(
                (float(np.sign(axes[pitch][1])), float(np.sign(axes[roll][0])), float(np.sign(axes[hip][0])))
            )
        scale = self.mass_kg * _GRAVITY * self.com_height_m
        part = ["other"] * len(self.joints)
        for k in self.trunk:
            part[k] = "torso"
        for k in self.legs:
            part[k] = "leg"
        for pair in self.ankles:
            for k in pair:
                part[k] = "ankle"
        self.stiffness: Floats = np.array([_STIFFNESS[p] for p in part]) * scale
        self.damping: Floats = self.stiffness * np.array([_DAMPING_S[p] for p in part])
        self.armature = _ARMATURE * scale
        self.joint_damping = _JOINT_DAMPING * scale

    def _spec(self, path: Path, robot: RobotConfig, visual: bool) -> Any:
        spec = _mujoco_spec(path, robot, visual)
        base = spec.body(robot.base) if robot.base else spec.worldbody.first_body()
        if base is None:
            known = [b.name for b in spec.bodies if b.name != "world"]
            raise ConfigError("twin.robot.base", f"the model has no body {robot.base!r}", nearest(robot.base, known))
        if not any(j.type == mujoco.mjtJoint.mjJNT_FREE for j in base.joints):
            base.add_freejoint(name="root")
        base.pos = self.q0[:3]
        self.base_name = base.name
        option = spec.option
        option.timestep, option.gravity = STEP_S, [0.0, 0.0, -_GRAVITY]
        option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET  # a run that diverges must not begin anew
        option.cone, option.impratio = mujoco.mjtCone.mjCONE_ELLIPTIC, 10.0
        for actuator in list(spec.actuators):
            spec.delete(actuator)
        for sensor in list(spec.sensors):
            spec.delete(sensor)
        self._shape(spec)
        self._drive(spec)
        self._feet(spec, robot)
        self._hang_payloads(spec, robot)
        self._mount_sensors(spec)
        spec.worldbody.add_geom(
            name="floor",
            type=mujoco.mjtGeom.mjGEOM_PLANE,
            size=[0.0, 0.0, 0.1],
            contype=FLOOR_BIT,
            conaffinity=0,
            rgba=[0.6, 0.65, 0.7, 1.0],
        )
        block = spec.worldbody.add_body(name="block", mocap=True, pos=[0.0, 0.0, -1.0])
        block.add_geom(
            name="block",
            type=mujoco.mjtGeom.mjGEOM_BOX,
            size=[0.2, 0.1, 0.05],
            contype=FLOOR_BIT,
            conaffinity=0,
            rgba=[0.5, 0.35, 0.2, 1.0],
        )
        return spec

    def _shape(self, spec: Any) -> None:
        """Every collision mesh becomes the capsule that MuJoCo fits to it; what is for show alone touches nothing."""
        for geom in spec.geoms:
            if not (geom.contype or geom.conaffinity):
                continue
            if geom.type == mujoco.mjtGeom.mjGEOM_MESH:
                geom.type = mujoco.mjtGeom.mjGEOM_CAPSULE
            geom.contype, geom.conaffinity, geom.group = 0, FLOOR_BIT | HUMAN_BIT, 3

    def _drive(self, spec: Any) -> None:
        by_name = {j.name: j for j in spec.joints}
        for k, name in enumerate(self.joints):
            joint = by_name.get(name)
            if joint is None or joint.type != mujoco.mjtJoint.mjJNT_HINGE:
                raise ConfigError("twin.robot.model", f"joint {name!r} is no hinge; expected hinges only")
            joint.armature, joint.damping = self.armature, [self.joint_damping, 0.0, 0.0]
            actuator = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
            actuator.set_to_position(kp=self.stiffness[k], kv=self.damping[k])
            limit = float(self.effort_limit[k])
            if math.isfinite(limit) and limit > 0.0:
                actuator.forcelimited, actuator.forcerange = True, [-limit, limit]
            actuator.ctrllimited = False

    def _feet(self, spec: Any, robot: RobotConfig) -> None:
        """A box for each sole, whose friction counts alone; the foot's own shape no longer touches the floor."""
        half_x = 0.5 * (robot.sole_x_max_m - robot.sole_x_min_m)
        middle = np.array([0.5 * (robot.sole_x_max_m + robot.sole_x_min_m), 0.0, 0.5 * _SOLE_THICKNESS_M])
        for side, frame in zip(SIDES, self.soles, strict=True):
            body, placement = self._carrier(spec, frame)
            for geom in body.geoms:
                geom.conaffinity &= ~FLOOR_BIT
            body.add_geom(
                name=f"{side}-sole",
                type=mujoco.mjtGeom.mjGEOM_BOX,
                pos=placement.act(middle),
                quat=_wxyz(placement.rotation),
                size=[half_x, robot.sole_y_half_m, 0.5 * _SOLE_THICKNESS_M],
                mass=0.0,
                contype=0,
                conaffinity=FLOOR_BIT | HUMAN_BIT,
                priority=1,
                group=3,
                rgba=[0.2, 0.8, 0.2, 0.6],
            )

    def _hang_payloads(self, spec: Any, robot: RobotConfig) -> None:
        """Bodies without mass, which a payload gives its mass."""
        places = [("torso", robot.torso), ("left_hand", robot.left_hand), ("right_hand", robot.right_hand)]
        self.payloads: dict[str, str] = {}
        for key, link in places:
            if not link:
                continue
            body, placement = self._carrier(spec, self._frame(link, key))
            name = f"{key}-payload"
            child = body.add_body(name=name, pos=placement.translation)
            child.mass, child.inertia, child.explicitinertial = 0.0, [0.0, 0.0, 0.0], True
            # a body that a sensor refers to is not fused with the one that carries it
            kind, body_type = mujoco.mjtSensor.mjSENS_FRAMEPOS, mujoco.mjtObj.mjOBJ_BODY
            spec.add_sensor(name=name, type=kind, objtype=body_type, objname=name)
            self.payloads[key] = name
        _, placement = self._carrier(spec, self.torso)
        self.torso_offset = placement

    def _mount_sensors(self, spec: Any) -> None:
        """Inertial unit in the torso's frame, and sites on the soles."""
        places = [("torso-imu", self.torso), *((f"{s}-sole", f) for s, f in zip(SIDES, self.soles, strict=True))]
        self.hands = tuple((s, link) for s in SIDES if (link := getattr(self.robot, f"{s}_hand")))
        places += [(f"{s}-hand", self._frame(link, f"{s}_hand")) for s, link in self.hands]
        for name, frame in places:
            body, placement = self._carrier(spec, frame)
            body.add_site(name=name, pos=placement.translation, quat=_wxyz(placement.rotation), group=5)
        site = mujoco.mjtObj.mjOBJ_SITE
        units = [("torso", "torso-imu"), *((f"{s}-hand", f"{s}-hand") for s, _ in self.hands)]
        for name, place in units:
            for quantity, kind in (
                ("gyro", mujoco.mjtSensor.mjSENS_GYRO),
                ("accelerometer", mujoco.mjtSensor.mjSENS_ACCELEROMETER),
            ):
                spec.add_sensor(name=f"{name}-{quantity}", type=kind, objtype=site, objname=place)
        # computing a force sensor makes MuJoCo sum the contacts of every body (cfrc_ext)
        spec.add_sensor(name="sole-force", type=mujoco.mjtSensor.mjSENS_FORCE, objtype=site, objname="left-sole")

    def _carrier(self, spec: Any, frame: int) -> tuple[Any, Any]:
        """The body that moves with a frame of Pinocchio's, and the frame's placement in it."""
        pm = self.pin_model
        joint, placement = pm.frames[frame].parentJoint, pm.frames[frame].placement
        if joint == 1:
            return spec.body(self.base_name), placement
        name = pm.names[joint]
        return next(j for j in spec.joints if j.name == name).parent, placement

    def _map(self) -> None:
        m = self.model
        self.mj_q = np.array([m.joint(n).qposadr[0] for n in self.joints])
        self.mj_v = np.array([m.joint(n).dofadr[0] for n in self.joints])
        self.actuators = np.array([m.actuator(n).id for n in self.joints])
        self.base_id = m.body(self.base_name).id
        self.sole_geoms = tuple(m.geom(f"{s}-sole").id for s in SIDES)
        self.foot_bodies = tuple(int(m.geom_bodyid[g]) for g in self.sole_geoms)
        joint = self.pin_model.frames[self.torso].parentJoint
        self.torso_id = self.base_id if joint == 1 else int(m.jnt_bodyid[m.joint(self.pin_model.names[joint]).id])
        self.block_mocap = int(m.body_mocapid[m.body("block").id])


def rotation(xyzw: Floats) -> Floats:
    """Rotation matrix of a unit quaternion."""
    x, y, z, w = (float(c) for c in xyzw)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def _wxyz(r: Floats) -> list[float]:
    x, y, z, w = pin.Quaternion(r).coeffs()
    return [float(w), float(x), float(y), float(z)]


def _pinocchio(robot: RobotConfig, path: Path, srdf: Path | None) -> tuple[Any, Floats]:
    """Pinocchio's model and the reference posture."""
    try:
        if path.suffix == ".urdf":
            pm = pin.buildModelFromUrdf(str(path), pin.JointModelFreeFlyer())
        else:
            pm = pin.buildModelFromMJCF(str(path))
    except (ValueError, RuntimeError) as e:
        raise ConfigError("twin.robot.model", f"{path}: not a robot model: {e}") from e
    if pm.njoints < 3 or pm.joints[1].nq != 7 or any(j.nq != 1 for j in list(pm.joints)[2:]):
        odd = [pm.names[k] for k in range(2, pm.njoints) if pm.joints[k].nq != 1]
        raise ConfigError("twin.robot.model", f"{path}: expected a free root and hinges only; others: {odd}")
    q: Floats = np.array(pin.neutral(pm))
    if srdf is not None:
        try:
            pin.loadReferenceConfigurations(pm, str(srdf), False)
        except (ValueError, RuntimeError) as e:
            raise ConfigError("twin.robot.srdf", f"{srdf}: not an SRDF file: {e}") from e
        known = [entry.key() for entry in pm.referenceConfigurations]
        if robot.reference not in known:
            problem = f"{srdf.name} has no reference configuration {robot.reference!r}"
            raise ConfigError("twin.robot.reference", problem, nearest(robot.reference, known))
        q = np.array(pm.referenceConfigurations[robot.reference])
    for name, value in robot.posture.items():
        if not pm.existJointName(name):
            raise ConfigError("twin.robot.posture", f"the robot has no joint {name!r}", nearest(name, pm.names[2:]))
        q[pm.joints[pm.getJointId(name)].idx_q] = value
    q[:7] = [0, 0, 0, 0, 0, 0, 1]
    return pm, q


def _mujoco_spec(path: Path, robot: RobotConfig, visual: bool) -> Any:
    """MjSpec of the model file. In a URDF, package:// becomes a path, and MuJoCo is told how to read it."""
    try:
        if path.suffix == ".xml":
            return mujoco.MjSpec.from_file(str(path))
        text = path.read_text()
        folders = [*(Path(p) for p in robot.package_dirs), share_folder(), *path.resolve().parents]

        def located(match: re.Match[str]) -> str:
            found = next((f / match[1] for f in folders if (f / match[1]).exists()), None)
            if found is None:
                raise ConfigError("twin.robot.package_dirs", f"{path.name} names package://{match[1]}, found nowhere")
            return str(found)

        text = re.sub(r"package://([^\"']+)", located, text)
        discard = "false" if visual else "true"
        flags = f'strippath="false" discardvisual="{discard}" fusestatic="true" balanceinertia="true"'
        head = f"<mujoco><compiler {flags}/></mujoco>"
        text = re.sub(r"(<robot\b[^>]*>)", lambda m: m[1] + head, text, count=1)
        return mujoco.MjSpec.from_string(text)
    except ValueError as e:
        raise ConfigError("twin.robot.model", f"{path}: MuJoCo cannot read it: {e}") from e
