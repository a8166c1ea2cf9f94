"""The robot's own control: walk, inverse kinematics, balance feedback, and what interventions change in them.

Feedback acts on the capture point error e = xi - xi_ref of the *estimated* state, by turning the ankles of loaded feet,
and their hip rolls against it: ankle pitch + k e_x, ankle roll - k e_y, hip roll + k e_y. The measurement is compared
with the plan at the time of its stamp. xi comes from base odometry and encoders through Pinocchio.

The plan lives in a frame of its own, which is anchored to the measured stance foot at each lift-off: drift of odometry
or feet that turn on the floor are no error. Footholds steer it back onto the x axis of odom.

Each action's strength rises and falls by ramps; at 0 the robot is as if it had never been asked.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping
from typing import Any

import numpy as np
import pinocchio as pin

from foreshock.clock import NS_PER_S
from foreshock_twins.mujoco._ik import InverseKinematics
from foreshock_twins.mujoco._model import Body, Floats, rotation
from foreshock_twins.mujoco._sensors import Measured
from foreshock_twins.mujoco._walk import Foothold, Gait, GaitSettings, Wanted

__all__ = ["ACTIONS", "Controller", "Plane"]

ACTIONS = frozenset(
    {
        "announce",
        "arm-reconfiguration",
        "balance-lock",
        "compliance-tuning",
        "hold",
        "impact-mitigation",
        "minimal-risk",
        "protective-stop",
        "shorten-step",
        "soften-arms",
        "speed-scale",
        "step-suppression",
        "withdraw-arm",
    }
)

_GAIN = 0.5
"""rad of ankle per m of capture point error."""
_LIMIT_RAD = (0.35, 0.3)
_LOCK_GAIN = 1.0
"""Balance lock: added to the gain, and there without the walking control's own feedback."""
_LANDING_S = 0.15
_RESUME_S = 1.0
_VELOCITY_FILTER_S = 0.01
_FORWARD_FILTER_S = 0.02
_STIFFER, _DAMPER = 0.5, 0.67
_SHORTER, _LOWER = 0.6, 0.5
_ARMS_SOFTER = 0.9
_KNEES_SOFTER = 0.7
_RISE_S = {"arm-reconfiguration": 0.3, "withdraw-arm": 0.3, "protective-stop": 0.1, "hold": 0.1}
_RISE_DEFAULT_S, _RELEASE_S = 0.02, 0.5
_TURN_RAD, _ASIDE_M = 0.1, 0.02
_FALLING_TILT = 0.6
"""rad; beyond, the controller knows that it falls and stops balancing."""


class Plane:
    """Where one frame of the ground lies in another: place (m) and heading (rad)."""

    def __init__(self, x: float = 0.0, y: float = 0.0, yaw: float = 0.0) -> None:
        self.x, self.y, self.yaw = x, y, yaw
        self._c, self._s = math.cos(yaw), math.sin(yaw)

    def out(self, x: float, y: float) -> tuple[float, float]:
        """A point of the inner frame in the outer."""
        return self.x + self._c * x - self._s * y, self.y + self._s * x + self._c * y

    def into(self, x: float, y: float) -> tuple[float, float]:
        """A point of the outer frame in the inner."""
        dx, dy = x - self.x, y - self.y
        return self._c * dx + self._s * dy, self._c * dy - self._s * dx

    def vector_out(self, x: float, y: float) -> tuple[float, float]:
        """A vector of the inner frame in the outer."""
        return self._c * x - self._s * y, self._s * x + self._c * y

    def vector_into(self, x: float, y: float) -> tuple[float, float]:
        """A vector of the outer frame in the inner."""
        return self._c * x + self._s * y, self._c * y - self._s * x


class Controller:
    """One tick every period: measurements in, joint targets and servo gains out.

    Attributes:
        gait: the walk.
        frame: where the plan's frame lies in odom.
        target: joint positions asked of the servos (rad), as joints.
        planned: joint positions and velocities of the plan, without feedback.
        strengths: of all actions, ramped, 0..1.
        error: capture point error that was last fed back (m), in the plan's frame.
        soles: estimated poses of the soles in odom: place (x, y, z) and heading, left and right.
        com: estimated centre of mass (m) and its velocity (m/s) in odom.
    """

    def __init__(self, body: Body, period_ns: int) -> None:
        self._body, self._dt = body, period_ns / NS_PER_S
        self._ik = InverseKinematics(body)
        self._data, self._plan_data = body.pin_model.createData(), body.pin_model.createData()
        self._arms_out = body.change(body.robot.arms("arms_out"), "arms_out")
        self._arms_in = body.change(body.robot.arms("arms_in"), "arms_in")
        self._arms_forward = body.change(body.robot.arms("arms_forward"), "arms_forward")

    def reset(self, parameters: Mapping[str, float]) -> Floats:
        """Begin a run; the configuration to start in (Pinocchio, nq)."""
        body, p = self._body, parameters
        self._p = p
        scale = body.com_height_m / 0.877
        robot = body.robot
        middle = 0.5 * (robot.sole_x_min_m + robot.sole_x_max_m)
        settings = GaitSettings(
            single_s=p["single_support"],
            double_s=p["double_support"],
            lift_m=p["step_height"],
            com_z_m=body.com_height_m - 0.015 * scale,
            sole_x_m=middle,
            inset_m=0.13 * robot.sole_y_half_m,
            reach_m=(0.415 * (robot.sole_x_max_m - robot.sole_x_min_m), 0.75 * robot.sole_y_half_m),
        )
        self._settings = settings
        self._ik.reset()
        self._arms: Floats = p["arms_forward"] * self._arms_forward
        self._ik.q[body.pin_q] += self._arms
        model, data = body.pin_model, self._data
        pin.framesForwardKinematics(model, data, self._ik.q)
        feet = [Foothold(float(t[0]), float(t[1]), 0.0) for t in (data.oMf[f].translation for f in body.soles)]
        x = 0.5 * (feet[0].x + feet[1].x)
        feet = [Foothold(x, f.y, 0.0) for f in feet]
        com = (x + middle, 0.5 * (feet[0].y + feet[1].y))
        self.gait = Gait(settings, (feet[0], feet[1]), com, 1 if p["first_support"] > 0.0 else 0)
        self._ik.solve(self._com_target(), [(f, 0.0) for f in feet], 0.0, 25)
        self.frame = Plane()
        q = self._ik.q[body.pin_q].copy()
        self.planned = (q, np.zeros_like(q))
        self.asked: dict[str, float] = dict.fromkeys(ACTIONS, 0.0)
        self.strengths: dict[str, float] = dict.fromkeys(ACTIONS, 0.0)
        self.error = (0.0, 0.0)
        self.falling = False
        self._references: deque[tuple[int, tuple[float, float]]] = deque(maxlen=256)
        self._velocity: Floats | None = None
        self._plan_rate: Floats = np.zeros(body.pin_model.nv)
        self._plan_acceleration: Floats = np.zeros(body.pin_model.nv)
        self._torque = self._ik.torques(self._plan_rate, self._plan_acceleration, (0.5, 0.5))[body.pin_v]
        self._released_s = self._length_m = 0.0
        self._jumps = 0
        self._stiffness, self._damping = body.stiffness.copy(), body.damping.copy()
        self.target = q + self._torque / self._stiffness
        self.soles: list[tuple[float, float, float, float]] = [(f.x, f.y, 0.0, 0.0) for f in feet]
        self.com: tuple[Floats, Floats] = (np.array([*com, settings.com_z_m]), np.zeros(3))
        return self._ik.q.copy()

    def ask(self, action: str, strength: float) -> None:
        """An intervention, from now on."""
        self.asked[action] = strength

    def tick(self, now_ns: int, measured: Measured, *, blind: bool) -> tuple[Floats, Floats, Floats]:
        """Targets (rad), stiffness (N m/rad) and damping (N m s/rad) of all joints until the next tick."""
        self._ramp()
        self._estimate(measured)
        if not self.falling:
            self._go_on(now_ns)
            self._feed_back(measured, blind)
        return self.target, *self._gains()

    @property
    def com_z_m(self) -> float:
        """Planned height of the centre of mass."""
        return self._settings.com_z_m

    @property
    def speed_m_s(self) -> float:
        """Planned speed of travel; 0 while it stands."""
        return 0.0 if self.gait.standing else abs(self._length_m) / (self._settings.single_s + self._settings.double_s)

    def planned_link(self, frame: int) -> tuple[Any, Any]:
        """Pose of a frame in the plan's frame, and its twist in its own axes, as planned (Pinocchio's SE3, Motion)."""
        model, data = self._body.pin_model, self._plan_data
        pin.forwardKinematics(model, data, self._ik.q, self._plan_rate)
        place = pin.updateFramePlacement(model, data, frame)
        return place, pin.getFrameVelocity(model, data, frame, pin.LOCAL)

    # --- state -----------------------------------------------------------------------------------------------------

    def _ramp(self) -> None:
        for action, asked in self.asked.items():
            now = self.strengths[action]
            if asked != now:
                step = self._dt / (_RISE_S.get(action, _RISE_DEFAULT_S) if asked > now else _RELEASE_S)
                self.strengths[action] = min(asked, now + step) if asked > now else max(asked, now - step)

    def _strength(self, *actions: str) -> float:
        return max(self.strengths[a] for a in actions)

    def _estimate(self, measured: Measured) -> None:
        """Centre of mass, its velocity, and the soles from what was measured."""
        body, data = self._body, self._data
        com = pin.centerOfMass(body.pin_model, data, measured.q, measured.v).copy()
        rate = data.vcom[0].copy()
        if self._velocity is None:
            self._velocity = rate
        self._velocity = self._velocity + self._dt / (self._dt + _VELOCITY_FILTER_S) * (rate - self._velocity)
        self.com = (com, self._velocity)
        for k, frame in enumerate(body.soles):
            place = pin.updateFramePlacement(body.pin_model, data, frame)
            t, r = place.translation, place.rotation
            self.soles[k] = (float(t[0]), float(t[1]), float(t[2]), math.atan2(r[1, 0], r[0, 0]))
        up = float(rotation(measured.q[3:7])[2, 2])
        if up < math.cos(_FALLING_TILT) or com[2] < 0.7 * self._settings.com_z_m:
            self.falling = True

    def _com_target(self) -> Floats:
        return np.array([*self.gait.com, self._settings.com_z_m])

    def _measured_xi(self) -> tuple[float, float]:
        """Capture point in the plan's frame."""
        (c, v), w = self.com, self.gait.omega
        return self.frame.into(float(c[0] + v[0] / w), float(c[1] + v[1] / w))

    # --- walk ------------------------------------------------------------------------------------------------------

    def _wanted(self, now_ns: int) -> Wanted:
        p, t = self._p, now_ns / NS_PER_S - self._p["start_time"]
        walk = p["stepping"] > 0.5 and t >= 0.0
        if walk and p["walk_time"] > 0.0:
            walk = t % (p["walk_time"] + p["stand_time"]) < p["walk_time"]
        shorter, slower = self.strengths["shorten-step"], self.strengths["speed-scale"]
        self._length_m = p["step_length"] * (1.0 - _SHORTER * shorter) * (1.0 - slower)
        left, right = self.soles
        heading = 0.5 * (left[3] + right[3])
        aside = 0.5 * (left[1] + right[1])
        return Wanted(
            walk=walk,
            length_m=self._length_m,
            lift=1.0 - _LOWER * shorter,
            turn_rad=_clip(-0.5 * heading - 0.5 * aside, _TURN_RAD),
            aside_m=_clip(-0.3 * aside, _ASIDE_M),
        )

    def _go_on(self, now_ns: int) -> None:
        """The plan goes on by a tick; a stop makes its time stand still, wherever the feet are."""
        gait = self.gait
        suppressed = self._strength("step-suppression", "minimal-risk")
        if suppressed > 0.0 and not gait.settling:
            (c, v), f = self.com, self.frame
            asked = max(self.asked["step-suppression"], self.asked["minimal-risk"])
            place, rate = f.into(float(c[0]), float(c[1])), f.vector_into(float(v[0]), float(v[1]))
            gait.suppress(asked, _LANDING_S, place, rate)
            self._jumps = 2
        elif gait.settling:
            self._released_s = self._released_s + self._dt if suppressed == 0.0 and gait.settled() else 0.0
            if self._released_s >= _RESUME_S:
                self._released_s = 0.0
                gait.resume()
        pace = 1.0 if gait.settling else 1.0 - self._strength("protective-stop", "hold")
        if pace > 0.0:
            gait.advance(pace * self._dt, self._wanted(now_ns))
        if gait.lifted:
            self._anchor()
        self._references.append((now_ns, gait.xi))
        out, drawn = self.strengths["arm-reconfiguration"], self.strengths["withdraw-arm"]
        forward = (1.0 - drawn) * self._p["arms_forward"]
        arms = forward * self._arms_forward + out * self._arms_out + drawn * self._arms_in
        self._ik.q[self._body.pin_q] += arms - self._arms
        self._arms = arms
        feet = [gait.foot(k) for k in (0, 1)]
        yaw = 0.5 * (feet[0][0].yaw + feet[1][0].yaw)
        before = self._ik.q.copy()
        full = self._ik.solve(self._com_target(), [(place, height) for place, height, _ in feet], yaw)
        q = full[self._body.pin_q]
        self.planned = (q, (q - self.planned[0]) / self._dt)
        self._feed_forward(pin.difference(self._body.pin_model, before, full) / self._dt)

    def _feed_forward(self, v: Floats) -> None:
        """Torques that the plan needs; the targets lead the plan by so much that the servos give them."""
        if self._jumps:  # the plan starts anew from where the robot is: no motion to give torques for
            self._jumps -= 1
            self._plan_rate = v
            return
        a = (v - self._plan_rate) / self._dt
        self._plan_rate = v
        weight = self._dt / (self._dt + _FORWARD_FILTER_S)
        self._plan_acceleration = self._plan_acceleration + weight * (a - self._plan_acceleration)
        torque = self._ik.torques(v, self._plan_acceleration, self.gait.shares)[self._body.pin_v]
        torque += self._body.damping * v[self._body.pin_v]
        self._torque = self._torque + weight * (torque - self._torque)

    def _anchor(self) -> None:
        """Lay the plan's frame so that the foot that stands now is where it was measured."""
        stance = 1 - self.gait.swing
        x, y, _, yaw = self.soles[stance]
        foot = self.gait.feet[stance]
        turn = math.remainder(yaw - foot.yaw, 2.0 * math.pi)
        c, s = math.cos(turn), math.sin(turn)
        self.frame = Plane(x - c * foot.x + s * foot.y, y - s * foot.x - c * foot.y, turn)

    # --- balance ---------------------------------------------------------------------------------------------------

    def _feed_back(self, measured: Measured, blind: bool) -> None:
        body, gait = self._body, self.gait
        q = self.planned[0] + self._torque / self._stiffness
        reference = next((xi for stamp, xi in reversed(self._references) if stamp <= measured.stamp_ns), gait.xi)
        xi = self._measured_xi()
        self.error = error = (xi[0] - reference[0], xi[1] - reference[1])
        own = 0.0 if blind else _GAIN * (1.0 - self.strengths["protective-stop"])
        gain = own + _LOCK_GAIN * self._strength("balance-lock", "minimal-risk")
        feet = gait.feet
        yaw = 0.5 * (feet[0].yaw + feet[1].yaw)
        c, s = math.cos(yaw), math.sin(yaw)
        dx = _clip(gain * (c * error[0] + s * error[1]), _LIMIT_RAD[0])
        dy = _clip(gain * (c * error[1] - s * error[0]), _LIMIT_RAD[1])
        for foot in gait.support:
            pitch, roll = body.ankles[foot]
            pitch_sign, roll_sign, hip_sign = body.axis_signs[foot]
            q[pitch] += pitch_sign * dx
            q[roll] -= roll_sign * dy
            q[body.hip_rolls[foot]] += hip_sign * dy
        self.target = q

    def _gains(self) -> tuple[Floats, Floats]:
        s, body = self.strengths, self._body
        np.copyto(self._stiffness, body.stiffness)
        np.copyto(self._damping, body.damping)
        if s["compliance-tuning"] > 0.0:
            self._stiffness[body.legs] *= 1.0 + _STIFFER * s["compliance-tuning"]
            self._damping[body.legs] *= 1.0 + _DAMPER * s["compliance-tuning"]
        if s["soften-arms"] > 0.0:
            self._stiffness[body.others] *= 1.0 - _ARMS_SOFTER * s["soften-arms"]
        if s["impact-mitigation"] > 0.0 and self.falling:
            self._stiffness[body.legs] *= 1.0 - _KNEES_SOFTER * s["impact-mitigation"]
        return self._stiffness, self._damping


def _clip(value: float, limit: float) -> float:
    return max(-limit, min(limit, value))
