"""From measurements and plans to messages: which channels there are, how often, and what they hold."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pinocchio as pin

from foreshock.messages import AnyMessage, Imu, JointState, MotionPlan, Odometry, PlannedPath, WrenchStamped
from foreshock.twin import Channel
from foreshock_twins.mujoco._control import Controller
from foreshock_twins.mujoco._model import SIDES, Body
from foreshock_twins.mujoco._sensors import Measured

__all__ = ["PERIOD_NS", "Channels"]

PERIOD_NS = 5_000_000
"""Tick of control and sensors: 200 Hz."""

_PATH_POINTS, _PATH_S = 16, 3.0
_STILL = (0.0, 0.0, 0.0)


class Channels:
    """Makes the messages of the robot's own channels.

    Attributes:
        declared: all of them.
        measured: name and period in ticks of those that show a measurement, with what makes the message from it.
        planned: the same for those that show what control intends now.
    """

    def __init__(self, body: Body, control: Controller) -> None:
        self._body, self._control = body, control
        self._data = body.pin_model.createData()
        self._names = body.joints
        self.measured: list[tuple[str, str, int, Callable[[Measured], AnyMessage]]] = [
            ("joints/state", "JointState", 1, self._joints),
            ("base/odometry", "Odometry", 1, self._base),
            ("imu/torso", "Imu", 1, self._imu),
            ("left_sole/wrench", "WrenchStamped", 1, lambda m: self._wrench(m, 0)),
            ("right_sole/wrench", "WrenchStamped", 1, lambda m: self._wrench(m, 1)),
            ("left_foot/odometry", "Odometry", 4, lambda m: self._link(m, body.soles[0], "left_sole")),
            ("right_foot/odometry", "Odometry", 4, lambda m: self._link(m, body.soles[1], "right_sole")),
        ]
        self._frames = [body.pin_model.getFrameId(link) for _, link in body.hands]
        for k, (side, link) in enumerate(body.hands):
            self.measured.append((f"{side}_arm/odometry", "Odometry", 2, self._hand(self._frames[k], link)))
            self.measured.append((f"{side}_gripper/imu", "Imu", 2, self._hand_imu(k, link)))
            self.measured.append((f"{side}_gripper/object", "Odometry", 2, self._held(k, f"{side}_object")))
        self.planned: list[tuple[str, str, int, Callable[[], AnyMessage]]] = [
            ("joints/plan", "JointState", 2, self._joint_plan),
            ("plan/motion", "MotionPlan", 1, self._motion_plan),
            ("left_foot/plan", "Odometry", 4, lambda: self._foot_plan(0)),
            ("right_foot/plan", "Odometry", 4, lambda: self._foot_plan(1)),
            ("plan/path", "PlannedPath", 20, self._path),
        ]
        for k, (side, _) in enumerate(body.hands):
            command = self._commanded(self._frames[k], f"{side}_object")
            self.planned.append((f"{side}_gripper/object_command", "Odometry", 2, command))
        self.declared = tuple(Channel(n, t, every * PERIOD_NS) for n, t, every, _ in (*self.measured, *self.planned))

    def _joints(self, m: Measured) -> AnyMessage:
        body = self._body
        return JointState(
            self._names, tuple(m.q[body.pin_q].tolist()), tuple(m.v[body.pin_v].tolist()), tuple(m.effort.tolist())
        )

    def _base(self, m: Measured) -> AnyMessage:
        q, v = m.q.tolist(), m.v.tolist()
        return Odometry(tuple(q[:3]), tuple(q[3:7]), tuple(v[:3]), tuple(v[3:6]), "odom", self._body.base_name)

    def _imu(self, m: Measured) -> AnyMessage:
        return Imu(_vector(m.attitude), _vector(m.gyro), _vector(m.acceleration), self._body.robot.torso)

    def _wrench(self, m: Measured, side: int) -> AnyMessage:
        """On and about the sole, which is a link of the robot's model only where it lies in the frame of the foot."""
        w, robot = m.wrenches[side].tolist(), self._body.robot
        frame = f"{SIDES[side]}_sole" if robot.sole_z_m else getattr(robot, f"{SIDES[side]}_foot")
        return WrenchStamped((w[0], w[1], w[2]), (w[3], w[4], w[5]), frame)

    def _hand(self, frame: int, link: str) -> Callable[[Measured], AnyMessage]:
        return lambda m: self._link(m, frame, link)

    def _hand_imu(self, hand: int, link: str) -> Callable[[Measured], AnyMessage]:
        def message(m: Measured) -> AnyMessage:
            h = m.hands[hand]
            return Imu(_vector(h.attitude), _vector(h.gyro), _vector(h.acceleration), link)

        return message

    def _held(self, hand: int, name: str) -> Callable[[Measured], AnyMessage]:
        """What the hand holds, as a camera sees it; it is held firmly, in the hand's axes."""

        def message(m: Measured) -> AnyMessage:
            h = m.hands[hand]
            return Odometry(_vector(h.place), _vector(h.attitude), _STILL, _STILL, "odom", name)

        return message

    def _commanded(self, frame: int, name: str) -> Callable[[], AnyMessage]:
        """The same as the plan has it."""

        def message() -> AnyMessage:
            place, twist = self._control.planned_link(frame)
            plane = self._control.frame
            x, y = plane.out(float(place.translation[0]), float(place.translation[1]))
            turned = pin.Quaternion(pin.AngleAxis(plane.yaw, np.array([0.0, 0.0, 1.0]))) * pin.Quaternion(
                place.rotation
            )
            at = (x, y, float(place.translation[2]))
            return Odometry(at, _vector(turned.coeffs()), _vector(twist.linear), _vector(twist.angular), "odom", name)

        return message

    def _link(self, m: Measured, frame: int, name: str) -> AnyMessage:
        """Pose and twist of a frame by kinematics from what was measured."""
        model, data = self._body.pin_model, self._data
        if self._of is not m:
            pin.forwardKinematics(model, data, m.q, m.v)
            self._of = m
        place = pin.updateFramePlacement(model, data, frame)
        twist = pin.getFrameVelocity(model, data, frame, pin.LOCAL)
        attitude = pin.Quaternion(place.rotation).coeffs()
        return Odometry(
            _vector(place.translation), _vector(attitude), _vector(twist.linear), _vector(twist.angular), "odom", name
        )

    _of: Measured | None = None

    def _joint_plan(self) -> AnyMessage:
        q, v = self._control.planned
        return JointState(self._names, tuple(q.tolist()), tuple(v.tolist()))

    def _motion_plan(self) -> AnyMessage:
        """The centre of mass relative to the middle between the soles, in axes that point where the feet point."""
        gait = self._control.gait
        (a, _, _), (b, _, _) = gait.foot(0), gait.foot(1)
        yaw = 0.5 * (a.yaw + b.yaw)
        dx, dy = gait.com[0] - 0.5 * (a.x + b.x), gait.com[1] - 0.5 * (a.y + b.y)
        c, s = math.cos(yaw), math.sin(yaw)
        com = (c * dx + s * dy, c * dy - s * dx, self._control.com_z_m)
        return MotionPlan(com, tuple(SIDES[k] for k in gait.support), self._control.speed_m_s)

    def _foot_plan(self, side: int) -> AnyMessage:
        """Feet are kept level, so that the twist is in the axes of the position, like the measured one."""
        frame = self._control.frame
        place, height, velocity = self._control.gait.foot(side)
        x, y = frame.out(place.x, place.y)
        vx, vy = frame.vector_out(velocity[0], velocity[1])
        half = 0.5 * (place.yaw + frame.yaw)
        return Odometry(
            (x, y, height),
            (0.0, 0.0, math.sin(half), math.cos(half)),
            (vx, vy, velocity[2]),
            (0.0, 0.0, 0.0),
            "odom",
            f"{SIDES[side]}_sole",
        )

    def _path(self) -> AnyMessage:
        frame = self._control.frame
        points = [(t, *frame.out(x, y)) for t, x, y in self._control.gait.path(_PATH_S, _PATH_POINTS)]
        return PlannedPath(tuple(p[1] for p in points), tuple(p[2] for p in points), tuple(p[0] for p in points))


def _vector(a: np.ndarray[Any, Any]) -> Any:
    return tuple(a.tolist())
