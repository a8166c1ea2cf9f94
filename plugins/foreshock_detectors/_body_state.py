"""From joint state and base odometry to Pinocchio's q and v, with every number checked."""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from foreshock.clock import NS_PER_S
from foreshock.messages import JointState, Odometry, Vec3
from foreshock_detectors._floating_base import FloatingBase
from foreshock_detectors._quaternion import Quaternion, unit

__all__ = ["BodyVectors"]

Array: TypeAlias = NDArray[np.float64]


class BodyVectors:
    """q and v as they were written last.

    Attributes:
        q: configuration, shape (nq,). The base's position in it is the owner's business; it is 0 at first.
        v: velocity, shape (nv,); the base's twist in its own axes.
    """

    def __init__(self, robot: FloatingBase) -> None:
        self._robot = robot
        self._names: tuple[str, ...] | None = None
        self.q: Array = robot.reference.copy()
        self.q[:3] = 0.0
        self.v: Array = np.zeros(robot.model.nv)

    def write(self, joints: JointState, odometry: Odometry, odometry_lag_ns: int) -> tuple[Vec3, Quaternion]:
        """Fill q, but for the base's position, and v. Gives the base's position (m) and unit orientation in odom.

        Args:
            joints: positions and velocities of the model's joints, in any order.
            odometry: pose and twist of the model's root link; its child frame is Pinocchio's local frame.
            odometry_lag_ns: by how much the joint state is newer; the pose is carried over this time by its own twist.

        Raises:
            ConfigError: joint names do not fit the model.
            ValueError: a number is missing or not finite, or the quaternion is not of unit length.
        """
        if joints.name != self._names:
            self._index(joints.name)
        _check(joints, odometry)
        position, quaternion = odometry.position, _unit(odometry.orientation)
        if odometry_lag_ns:
            position, quaternion = _carried(position, quaternion, odometry, odometry_lag_ns / NS_PER_S)
        q, v = self.q, self.v
        q[3:7] = quaternion
        v[:6] = odometry.linear + odometry.angular
        v[self._to_v] = joints.velocity
        if self._round:
            angles = np.array(joints.position)
            q[self._to_q] = angles[self._plain]
            for k, i in self._round:
                q[i], q[i + 1] = math.cos(angles[k]), math.sin(angles[k])
        else:
            q[self._to_q] = joints.position
        return position, quaternion

    def _index(self, names: tuple[str, ...]) -> None:
        joints = self._robot.streamed(names)
        plain = [k for k, j in enumerate(joints) if j.nq == 1]
        # an unlimited joint has cosine and sine in q
        self._round = [(k, int(j.idx_q)) for k, j in enumerate(joints) if j.nq == 2]
        self._plain = np.array(plain, dtype=np.intp)
        self._to_q = np.array([joints[k].idx_q for k in plain], dtype=np.intp)
        self._to_v = np.array([j.idx_v for j in joints], dtype=np.intp)
        self._names = names


def _check(joints: JointState, odometry: Odometry) -> None:
    position, velocity, n = joints.position, joints.velocity, len(joints.name)
    if len(position) != n or len(velocity) != n:
        counts = f"{n} names, {len(position)} positions, {len(velocity)} velocities"
        raise ValueError(f"joints/state: {counts}; expected as many of each")
    # a sum is finite only if every term is (or it overflows, which no physical state does)
    if not math.isfinite(sum(position) + sum(velocity)):
        rows = zip(joints.name, position, velocity, strict=True)
        bad = [name for name, x, v in rows if not (math.isfinite(x) and math.isfinite(v))]
        raise ValueError(f"joints/state: not finite: {', '.join(bad) or 'the sum of all values'}")
    if not math.isfinite(sum(odometry.position + odometry.orientation + odometry.linear + odometry.angular)):
        for field in ("position", "orientation", "linear", "angular"):
            value = getattr(odometry, field)
            if not math.isfinite(sum(value)):
                raise ValueError(f"base/odometry: {field} is not finite: {value}")
        raise ValueError("base/odometry: the sum of all values is not finite")


def _unit(quaternion: Quaternion) -> Quaternion:
    found = unit(quaternion)
    if found is None:
        raise ValueError(f"base/odometry: orientation has norm {math.hypot(*quaternion):.4f}, not 1")
    return found


def _carried(position: Vec3, quaternion: Quaternion, odometry: Odometry, dt_s: float) -> tuple[Vec3, Quaternion]:
    """Pose after dt_s at constant twist in the base frame: exact for the screw motion (Pinocchio's exponential)."""
    pose = pin.XYZQUATToSE3([*position, *quaternion])
    twist = pin.Motion(np.array(odometry.linear) * dt_s, np.array(odometry.angular) * dt_s)
    x, y, z, qx, qy, qz, qw = pin.SE3ToXYZQUAT(pose * pin.exp6(twist)).tolist()
    return (x, y, z), (qx, qy, qz, qw)
