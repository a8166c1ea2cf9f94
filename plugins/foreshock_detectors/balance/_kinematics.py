"""From joint state and base odometry to what balance depends on: one pass of Pinocchio, then plain numbers."""

from __future__ import annotations

import math
from typing import Any, TypeAlias

import msgspec
import pinocchio as pin

from foreshock.clock import NS_PER_S
from foreshock.messages import JointState, Odometry, Vec3
from foreshock_detectors.balance._model import JointIndices, RobotModel

__all__ = ["BodyState", "Kinematics", "SolePose"]

Matrix3: TypeAlias = "list[list[float]]"

QUATERNION_TOLERANCE = 0.01
"""A base quaternion off unit length by 1 % already shifts TALOS's CoM by 0.8 mm."""


class SolePose(msgspec.Struct, frozen=True, gc=False):
    """One sole in the odom frame.

    Attributes:
        x: position of the sole frame (m).
        y: position (m).
        z: position (m).
        vx: its velocity (m/s), axes of odom.
        vy: its velocity (m/s).
        rotation: rows of R, sole to odom.
    """

    x: float
    y: float
    z: float
    vx: float
    vy: float
    rotation: Matrix3


class BodyState(msgspec.Struct, frozen=True, gc=False):
    """Where the robot is at one instant. Positions and axes are those of the odom frame.

    Attributes:
        stamp_ns: source time of the joint state.
        com: centre of mass (m).
        velocity: of the centre of mass (m/s).
        momentum: centroidal momentum, linear (kg m/s) then angular about the centre of mass (kg m^2/s).
        left: left sole.
        right: right sole.
        heading: (cos, sin) of the base's yaw: x axis of the base footprint.
        torso_roll_rad: lean of the torso's z axis to the right of the heading, positive about +x (REP 103).
    """

    stamp_ns: int
    com: Vec3
    velocity: Vec3
    momentum: tuple[float, float, float, float, float, float]
    left: SolePose
    right: SolePose
    heading: tuple[float, float]
    torso_roll_rad: float


class Kinematics:
    """Evaluates a RobotModel. Holds Pinocchio's data and the names of the stream seen last; no history."""

    def __init__(self, robot: RobotModel) -> None:
        self._robot = robot
        self._model = robot.model
        self._data: Any = robot.model.createData()
        self._q: Any = robot.reference.copy()
        self._v: Any = pin.utils.zero(robot.model.nv)
        self._names: tuple[str, ...] | None = None
        self._indices: JointIndices
        self._frames: dict[str, int] = {}

    def evaluate(self, stamp_ns: int, joints: JointState, odometry: Odometry, odometry_lag_ns: int) -> BodyState:
        """The state at the joint state's stamp.

        Args:
            stamp_ns: source stamp of the joint state.
            joints: positions and velocities of the model's joints, in any order.
            odometry: pose and twist of the model's root link; its child frame is Pinocchio's local frame.
            odometry_lag_ns: stamp_ns minus the odometry's stamp; the pose is carried over this time by its own twist.

        Raises:
            ConfigError: joint names do not fit the model.
            ValueError: a number is missing or not finite, or the quaternion is not of unit length.
        """
        if joints.name != self._names:
            self._indices = self._robot.joint_indices(joints.name)
            self._names = joints.name
        _check(joints, odometry)
        position, quaternion = odometry.position, _unit(odometry.orientation)
        if odometry_lag_ns:
            position, quaternion = _carry(position, quaternion, odometry, odometry_lag_ns / NS_PER_S)
        q, v = self._q, self._v
        q[:7] = position + quaternion
        v[:6] = odometry.linear + odometry.angular
        self._indices.write(q, v, joints.position, joints.velocity)
        data = self._data
        pin.computeCentroidalMomentum(self._model, data, q, v)
        x, y, z, w = quaternion
        c, s = 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z)
        n = math.hypot(c, s)
        c, s = (c / n, s / n) if n > 1e-6 else (1.0, 0.0)
        torso = pin.updateFramePlacement(self._model, data, self._robot.torso).rotation[:, 2].tolist()
        return BodyState(
            stamp_ns,
            tuple(data.com[0].tolist()),
            tuple(data.vcom[0].tolist()),
            tuple(data.hg.vector.tolist()),
            self._sole(self._robot.left),
            self._sole(self._robot.right),
            (c, s),
            math.atan2(s * torso[0] - c * torso[1], torso[2]),
        )

    def angular_velocity(self, frame: str) -> list[float] | None:
        """Angular velocity (rad/s) of a model frame in its own axes, as evaluated last; None for an unknown frame."""
        known = self._frames.get(frame)
        if known is None:
            known = self._model.getFrameId(frame) if self._model.existFrame(frame) else -1
            self._frames[frame] = known
        if known < 0:
            return None
        velocity = pin.getFrameVelocity(self._model, self._data, known, pin.LOCAL)
        angular: list[float] = velocity.angular.tolist()
        return angular

    def _sole(self, frame: int) -> SolePose:
        placement = pin.updateFramePlacement(self._model, self._data, frame)
        velocity = pin.getFrameVelocity(self._model, self._data, frame, pin.LOCAL_WORLD_ALIGNED)
        x, y, z = placement.translation.tolist()
        vx, vy, _ = velocity.linear.tolist()
        return SolePose(x, y, z, vx, vy, placement.rotation.tolist())


def _check(joints: JointState, odometry: Odometry) -> None:
    n = len(joints.name)
    if len(joints.position) != n or len(joints.velocity) != n:
        counts = f"{n} names, {len(joints.position)} positions, {len(joints.velocity)} velocities"
        raise ValueError(f"joints/state: {counts}; expected as many of each")
    # a sum is finite only if every term is (or it overflows, which no physical state does)
    if not math.isfinite(sum(joints.position) + sum(joints.velocity)):
        bad = [name for name, *x in zip(joints.name, joints.position, joints.velocity, strict=True) if not _finite(x)]
        raise ValueError(f"joints/state: not finite: {', '.join(bad) or 'the sum of all values'}")
    for field in ("position", "orientation", "linear", "angular"):
        value = getattr(odometry, field)
        if not math.isfinite(sum(value)):
            raise ValueError(f"base/odometry: {field} is not finite: {value}")


def _finite(values: list[float]) -> bool:
    return all(map(math.isfinite, values))


def _unit(quaternion: tuple[float, float, float, float]) -> tuple[float, float, float, float]:
    x, y, z, w = quaternion
    norm = math.sqrt(x * x + y * y + z * z + w * w)
    if abs(norm - 1.0) > QUATERNION_TOLERANCE:
        raise ValueError(f"base/odometry: orientation has norm {norm:.4f}, not 1 within {QUATERNION_TOLERANCE:.0%}")
    return x / norm, y / norm, z / norm, w / norm


def _carry(
    position: Vec3, quaternion: tuple[float, float, float, float], odometry: Odometry, dt_s: float
) -> tuple[Vec3, tuple[float, float, float, float]]:
    """Pose after dt_s at constant twist in the base frame: exact for the screw motion (Pinocchio's exponential)."""
    pose = pin.XYZQUATToSE3([*position, *quaternion])
    twist = pin.Motion(_vector(odometry.linear) * dt_s, _vector(odometry.angular) * dt_s)
    carried = pin.SE3ToXYZQUAT(pose * pin.exp6(twist)).tolist()
    return tuple(carried[:3]), tuple(carried[3:])


def _vector(value: Vec3) -> Any:
    vector = pin.utils.zero(3)
    vector[:] = value
    return vector
