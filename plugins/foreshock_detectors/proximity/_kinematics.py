"""From joint state and base odometry to the robot's capsules and how they move: one pass of Pinocchio, then arrays."""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from foreshock.clock import NS_PER_S
from foreshock.messages import JointState, Odometry, Vec3
from foreshock_detectors.proximity._bulk import JointArrays
from foreshock_detectors.proximity._robot import Robot

__all__ = ["CapsuleKinematics"]

Array: TypeAlias = NDArray[np.float64]
Quaternion: TypeAlias = tuple[float, float, float, float]

QUATERNION_TOLERANCE = 0.01
"""A base quaternion farther off unit length than this is no orientation; below, it is normalised."""


class CapsuleKinematics:
    """The robot's n capsules at the instant evaluated last. Axes of odom; positions are relative to the base's origin.

    The base's origin is taken off so that a robot kilometres from odom's origin loses no digits.

    Attributes:
        origin: base position in odom (m).
        q: configuration with the base's position at 0, shape (nq,).
        ends: both ends of each segment, shape (n, 2, 3), m.
        velocities: theirs, shape (n, 2, 3), m/s.
        length2: squared length of each segment, shape (n,), m^2; 1e-30 for a ball.
        radius: shape (n,), m; grows where a merged joint is beyond the range that its capsule covers.
        speed: by how much points inside may be faster than the capsule, from merged joints, shape (n,), m/s.
    """

    def __init__(self, robot: Robot) -> None:
        self._robot, self._model = robot, robot.model
        self._arrays = JointArrays(robot.model)
        self.q: Array = robot.reference.copy()
        self._v: Array = np.zeros(robot.model.nv)
        self._names: tuple[str, ...] | None = None
        capsules = robot.capsules
        n = len(capsules)
        self._joint = np.array([robot.model.getJointId(c.joint) for c in capsules], dtype=np.intp)
        a, b = np.array([c.a for c in capsules]), np.array([c.b for c in capsules])
        self._local = np.zeros((n, 2, 4))
        self._local[:, 0, :3], self._local[:, 1, :3], self._local[:, :, 3] = a, b, 1.0
        self._twist = np.zeros((n, 6, 6))  # (v, w) of the joint to both ends' velocities, in its axes
        for k in range(n):
            self._twist[k, :3, :3] = self._twist[k, 3:, :3] = np.eye(3)
            self._twist[k, :3, 3:], self._twist[k, 3:, 3:] = -pin.skew(a[k]), -pin.skew(b[k])
        # a ball has no direction, and every product with its length is 0, so that any divisor will do
        self.length2: Array = np.maximum(((b - a) ** 2).sum(axis=1), 1e-30)
        self._fitted = np.array([c.radius for c in capsules])
        self._swept(robot)
        self.origin: Vec3 = (0.0, 0.0, 0.0)
        self._places = np.zeros((n, 4, 3))
        self.ends, self.velocities = np.zeros((n, 2, 3)), np.zeros((n, 2, 3))
        self.radius, self.speed = self._fitted.copy(), np.zeros(n)

    def evaluate(self, joints: JointState, odometry: Odometry, odometry_lag_ns: int) -> None:
        """Move the capsules to the joint state's instant.

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
        self.origin = position
        q, v = self.q, self._v
        q[:7] = (0.0, 0.0, 0.0, *quaternion)
        v[:6] = odometry.linear + odometry.angular
        v[self._to_v] = joints.velocity
        if self._round:
            angles = np.array(joints.position)
            q[self._to_q] = angles[self._plain]
            for k, i in self._round:
                q[i], q[i + 1] = math.cos(angles[k]), math.sin(angles[k])
        else:
            q[self._to_q] = joints.position
        arrays = self._arrays
        pin.forwardKinematics(self._model, arrays.data, q, v)
        places = arrays.placements.take(self._joint, 0, self._places, "clip")
        np.matmul(self._local, places, self.ends)
        rates = np.matmul(self._twist, arrays.velocities.take(self._joint, 0)[:, :, None])
        np.matmul(rates.reshape(-1, 2, 3), places[:, :3], self.velocities)
        if self._reach is not None:
            self._widen(self._reach, q, v)

    def _index(self, names: tuple[str, ...]) -> None:
        joints = self._robot.stream(names)
        plain = [k for k, j in enumerate(joints) if j.nq == 1]
        self._round = [(k, int(j.idx_q)) for k, j in enumerate(joints) if j.nq == 2]
        self._plain = np.array(plain, dtype=np.intp)
        self._to_q = np.array([joints[k].idx_q for k in plain], dtype=np.intp)
        self._to_v = np.array([j.idx_v for j in joints], dtype=np.intp)
        self._names = names

    def _swept(self, robot: Robot) -> None:
        """Index the merged joints: which capsule they move points of, by how much, and over which range."""
        pairs = [(k, s) for k, c in enumerate(robot.capsules) for s in c.swept]
        self._reach: Array | None = None
        if not pairs:
            return
        self._reach = np.zeros((len(robot.capsules), len(pairs)))
        for column, (k, s) in enumerate(pairs):
            self._reach[k, column] = s.reach
        joints = [robot.joint(s.joint) for _, s in pairs]
        # an unlimited joint is never beyond its range; its first q (a cosine) is within any infinite one
        self._swept_q = np.array([j.idx_q for j in joints], dtype=np.intp)
        self._swept_v = np.array([j.idx_v for j in joints], dtype=np.intp)
        self._lower = np.array([-math.inf if s.lower is None else s.lower for _, s in pairs])
        self._upper = np.array([math.inf if s.upper is None else s.upper for _, s in pairs])

    def _widen(self, reach: Array, q: Array, v: Array) -> None:
        """A point at distance p of an axis moves at most p times the excess angle, with p times the joint's speed."""
        at = q.take(self._swept_q)
        np.matmul(reach, np.abs(v.take(self._swept_v)), self.speed)
        beyond = np.maximum(at - self._upper, self._lower - at)
        if beyond.max() > 0.0:
            self.radius = self._fitted + reach @ np.maximum(beyond, 0.0)
        elif self.radius is not self._fitted:
            self.radius = self._fitted


def _check(joints: JointState, odometry: Odometry) -> None:
    n = len(joints.name)
    if len(joints.position) != n or len(joints.velocity) != n:
        counts = f"{n} names, {len(joints.position)} positions, {len(joints.velocity)} velocities"
        raise ValueError(f"joints/state: {counts}; expected as many of each")
    # a sum is finite only if every term is (or it overflows, which no physical state does)
    if not math.isfinite(sum(joints.position) + sum(joints.velocity)):
        rows = zip(joints.name, joints.position, joints.velocity, strict=True)
        bad = [name for name, x, v in rows if not (math.isfinite(x) and math.isfinite(v))]
        raise ValueError(f"joints/state: not finite: {', '.join(bad) or 'the sum of all values'}")
    for field in ("position", "orientation", "linear", "angular"):
        value = getattr(odometry, field)
        if not math.isfinite(sum(value)):
            raise ValueError(f"base/odometry: {field} is not finite: {value}")


def _unit(quaternion: Quaternion) -> Quaternion:
    x, y, z, w = quaternion
    norm = math.sqrt(x * x + y * y + z * z + w * w)
    if abs(norm - 1.0) > QUATERNION_TOLERANCE:
        raise ValueError(f"base/odometry: orientation has norm {norm:.4f}, not 1 within {QUATERNION_TOLERANCE:.0%}")
    return x / norm, y / norm, z / norm, w / norm


def _carried(position: Vec3, quaternion: Quaternion, odometry: Odometry, dt_s: float) -> tuple[Vec3, Quaternion]:
    """Pose after dt_s at constant twist in the base frame: exact for the screw motion (Pinocchio's exponential)."""
    pose = pin.XYZQUATToSE3([*position, *quaternion])
    twist = pin.Motion(np.array(odometry.linear) * dt_s, np.array(odometry.angular) * dt_s)
    x, y, z, *rest = pin.SE3ToXYZQUAT(pose * pin.exp6(twist)).tolist()
    qx, qy, qz, qw = rest
    return (x, y, z), (qx, qy, qz, qw)
