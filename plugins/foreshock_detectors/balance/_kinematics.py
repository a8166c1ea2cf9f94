"""From joint state and base odometry to what balance depends on: one pass of Pinocchio, then plain numbers."""

from __future__ import annotations

import math
from typing import Any, TypeAlias

import msgspec
import pinocchio as pin

from foreshock.messages import JointState, Odometry, Vec3
from foreshock_detectors._body_state import BodyVectors
from foreshock_detectors.balance._model import RobotModel

__all__ = ["BodyState", "Kinematics", "SolePose"]

Matrix3: TypeAlias = "list[list[float]]"


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


class _Frame:
    """A frame's id, and live views on its placement in Pinocchio's data: to make them anew costs as much as to read."""

    def __init__(self, data: Any, frame: int) -> None:
        self.id = frame
        self.translation, self.rotation = data.oMf[frame].translation, data.oMf[frame].rotation


class Kinematics:
    """Evaluates a RobotModel. Holds Pinocchio's data and the names of the stream seen last; no history."""

    def __init__(self, robot: RobotModel) -> None:
        self._model = robot.model
        self._data: Any = robot.model.createData()
        # live views as well
        self._com, self._velocity, self._momentum = self._data.com[0], self._data.vcom[0], self._data.hg.vector
        self._left, self._right, self._torso = (_Frame(self._data, f) for f in (robot.left, robot.right, robot.torso))
        self._vectors = BodyVectors(robot)
        self._frames: dict[str, int] = {}

    def evaluate(self, stamp_ns: int, joints: JointState, odometry: Odometry, odometry_lag_ns: int) -> BodyState:
        """The state at the joint state's stamp; for the other arguments and errors see BodyVectors.write."""
        vectors = self._vectors
        position, quaternion = vectors.write(joints, odometry, odometry_lag_ns)
        q = vectors.q
        q[:3] = position
        data = self._data
        pin.computeCentroidalMomentum(self._model, data, q, vectors.v)
        x, y, z, w = quaternion
        c, s = 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z)
        n = math.hypot(c, s)
        c, s = (c / n, s / n) if n > 1e-6 else (1.0, 0.0)
        pin.updateFramePlacement(self._model, data, self._torso.id)
        (_, _, tx), (_, _, ty), (_, _, tz) = self._torso.rotation.tolist()
        return BodyState(
            stamp_ns,
            tuple(self._com.tolist()),
            tuple(self._velocity.tolist()),
            tuple(self._momentum.tolist()),
            self._sole(self._left),
            self._sole(self._right),
            (c, s),
            math.atan2(s * tx - c * ty, tz),
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

    def _sole(self, frame: _Frame) -> SolePose:
        pin.updateFramePlacement(self._model, self._data, frame.id)
        velocity = pin.getFrameVelocity(self._model, self._data, frame.id, pin.LOCAL_WORLD_ALIGNED)
        x, y, z = frame.translation.tolist()
        vx, vy, _ = velocity.linear.tolist()
        return SolePose(x, y, z, vx, vy, frame.rotation.tolist())
