"""From joint state and base odometry to the robot's capsules and how they move: one pass of Pinocchio, then arrays."""

from __future__ import annotations

import math

import numpy as np
import pinocchio as pin

from foreshock.messages import JointState, Odometry, Vec3
from foreshock_detectors._body_state import BodyVectors
from foreshock_detectors.proximity._axes import Array, capsule_placements
from foreshock_detectors.proximity._bulk import JointArrays
from foreshock_detectors.proximity._robot import Robot

__all__ = ["Array", "CapsuleKinematics"]


class CapsuleKinematics:
    """The robot's n capsules at the instant evaluated last. Axes of odom; positions are relative to the base's origin.

    The base's origin is taken off so that a robot kilometres from odom's origin loses no digits.

    Attributes:
        origin: base position in odom (m).
        ends: both ends of each segment, shape (n, 2, 3), m.
        placements: of the capsules, centred along their z axis: columns of the rotation, then the middle, (n, 4, 3), m.
        axes: the ends once more, laid out in memory with the capsules last, so that numpy's inner loops run over n
            rather than over three coordinates.
        velocities: of both ends, shape (n, 2, 3), m/s, in the same layout.
        length2: squared length of each segment, shape (n,), m^2; 1e-30 for a ball.
        half_m: half the length of each segment (m).
        radius: shape (n,), m; grows where a merged joint is beyond the range that its capsule covers.
        speed: by how much points inside may be faster than the capsule, from merged joints, shape (n,), m/s.
    """

    def __init__(self, robot: Robot) -> None:
        self._model = robot.model
        self._vectors = BodyVectors(robot)
        self._arrays = JointArrays(robot.model)
        self._motions = self._arrays.velocities[:, :, None]
        capsules = robot.capsules
        n = len(capsules)
        self._joint = np.array([robot.model.getJointId(c.joint) for c in capsules], dtype=np.intp)
        ends = np.array([(c.a, c.b) for c in capsules])
        places, half = capsule_placements(ends)
        # homogeneous coordinates in the joint's frame, 1 for points and 0 for directions: the placement, the ends and,
        # new at every instant, their velocities; all are turned to odom by one product
        self._local, self._moved = np.zeros((n, 8, 4)), np.zeros((n, 8, 3))
        self._local[:, :4, :3], self._local[:, 4:6, :3] = places, ends
        self._local[:, 3:6, 3] = 1.0
        self._rates = self._local.reshape(n, 32, 1)[:, 24:]
        self.placements, self.ends, self._both = self._moved[:, :4], self._moved[:, 4:6], self._moved[:, 4:]
        self._by_axis = np.zeros((4, 3, n)).transpose(2, 0, 1)
        self.axes, self.velocities = self._by_axis[:, :2], self._by_axis[:, 2:]
        # (v, w) of the joint to both ends' velocities in its axes, in homogeneous coordinates
        self._twist = np.zeros((n, 8, 6))
        for k, (a, b) in enumerate(ends):
            self._twist[k, :3, :3] = self._twist[k, 4:7, :3] = np.eye(3)
            self._twist[k, :3, 3:], self._twist[k, 4:7, 3:] = -pin.skew(a), -pin.skew(b)
        # a ball has no direction, and every product with its length is 0, so that any divisor will do
        self.length2: Array = np.maximum(((ends[:, 1] - ends[:, 0]) ** 2).sum(axis=1), 1e-30)
        self.half_m: list[float] = half.tolist()
        self._fitted = np.array([c.radius for c in capsules])
        self._swept(robot)
        self.origin: Vec3 = (0.0, 0.0, 0.0)
        self._places, self._velocities = np.zeros((n, 4, 3)), np.zeros((n, 6, 1))
        self.radius, self.speed = self._fitted, np.zeros(n)

    def evaluate(self, joints: JointState, odometry: Odometry, odometry_lag_ns: int) -> None:
        """Move the capsules to the joint state's instant; for the arguments and errors see BodyVectors.write."""
        vectors, arrays = self._vectors, self._arrays
        self.origin, _ = vectors.write(joints, odometry, odometry_lag_ns)
        q, v = vectors.q, vectors.v
        pin.forwardKinematics(self._model, arrays.data, q, v)
        places = arrays.placements.take(self._joint, 0, self._places, "clip")
        velocities = self._motions.take(self._joint, 0, self._velocities, "clip")
        np.matmul(self._twist, velocities, self._rates)
        np.matmul(self._local, places, self._moved)
        self._by_axis[:] = self._both
        if self._reach is not None:
            self._widen(self._reach, q, v)

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
        speeds = v.take(self._swept_v)
        reach.dot(np.abs(speeds, speeds), self.speed)
        beyond = np.maximum(at - self._upper, self._lower - at)
        if max(beyond.tolist()) > 0.0:
            self.radius = self._fitted + reach @ np.maximum(beyond, 0.0)
        elif self.radius is not self._fitted:
            self.radius = self._fitted
