"""A human beside the robot: capsules as mocap bodies that the robot can hit, moved by a function of time.

Sizes are those of the template that the FMU plants use too (foreshock_twins.fmi._adult, after Drillis and Contini,
1966, and ANSUR II), jointed, and with feet of 0.152 statures (Winter, fig. 4.1). The human is kinematic: he pushes and
is never pushed. To MuJoCo's own contact solver a mocap body is a rigid wall at rest that is elsewhere at each step; the
twin lets it compute no force and takes the body model of foreshock_twins.mujoco._contact instead.
"""

from __future__ import annotations

import math
from typing import Any, Literal

import msgspec
import mujoco
import numpy as np
from numpy.typing import NDArray

from foreshock.clock import seconds
from foreshock.errors import ConfigError
from foreshock.messages import Capsule, HumanPose, Vec3
from foreshock_twins.fmi._adult import STANDING_ADULT, STATURE_M
from foreshock_twins.mujoco._human_gait import FIRST_PHASE, Gait, smooth

__all__ = ["PARTS", "HumanMotion", "HumanSettings", "MovedHuman", "Part", "add_human", "apply"]

Array = NDArray[np.float64]

_TRUNK, _LIMBS = STANDING_ADULT[:4], STANDING_ADULT[4:]
_ARMS = (_LIMBS[0:3], _LIMBS[5:8])
_LEGS = (_LIMBS[3:5], _LIMBS[8:10])
_THIGH, _SHANK = (math.dist(c.a, c.b) for c in _LEGS[0])
_ANKLE = _LEGS[0][1].a[2]
_FOOT_RADIUS = 0.5 * _ANKLE
"""The foot reaches from the floor up to the ankle."""
_FOOT = 0.152 * STATURE_M - 2.0 * _FOOT_RADIUS
_HEEL = 0.25 * 0.152 * STATURE_M - _FOOT_RADIUS
"""The ankle lies a quarter of the foot before its heel."""
_LEG = 0.995 * (_THIGH + _SHANK)
_UPPER_ARM, _FOREARM, _HAND = (math.dist(c.a, c.b) for c in _ARMS[0])
_TO_HAND = _FOREARM + 0.5 * _HAND
_BENT_RAD = 0.25
"""The elbow of an arm that hangs, and rather more of one that swings."""
_ARM_SWING_RAD = 0.45
_RAMP_S = 0.8
"""From standing to the full speed."""

_SKIN, _SHIRT, _TROUSERS, _SHOE = (0.87, 0.67, 0.53), (0.16, 0.42, 0.66), (0.19, 0.21, 0.27), (0.09, 0.09, 0.10)


class Part(msgspec.Struct, frozen=True):
    """A capsule of the human.

    Attributes:
        name: of its body and geom, after ``human-``.
        region: of ISO/TS 15066 Annex A; a foot, which the standard does not list, counts as lower leg.
        length: between the middles of its ends, m.
        radius: m.
        colour: red, green, blue, 0..1.
    """

    name: str
    region: str
    length: float
    radius: float
    colour: tuple[float, float, float]


def _parts() -> tuple[Part, ...]:
    colours = {"face": _SKIN, "hand": _SKIN, "forearm": _SKIN}
    colours |= {"pelvis": _TROUSERS, "thigh": _TROUSERS, "lower-leg": _TROUSERS}
    parts = []
    for k, c in enumerate(STANDING_ADULT):
        side = "" if k < 4 else "left-" if k < 9 else "right-"
        colour = colours.get(c.region, _SHIRT)
        parts.append(Part(f"{side}{c.region}", c.region, math.dist(c.a, c.b), c.radius, colour))
    parts += [Part(f"{side}-foot", "lower-leg", _FOOT, _FOOT_RADIUS, _SHOE) for side in ("left", "right")]
    return tuple(parts)


PARTS: tuple[Part, ...] = _parts()


class HumanSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What the human does.

    Attributes:
        motion: ``stand``, ``walk-past`` (straight on from where he stands) or ``reach-in`` (with the right hand).
        x_m: where he stands at first, in odom, on the floor.
        y_m: the same; of a human who walks along x this is the lateral distance.
        yaw_rad: where he faces and walks to, from the x axis.
        start_s: when he begins to walk or to reach.
        speed_m_s: of the walk, up to 2; reached after 0.8 s. 1.6 m/s is the walking speed of ISO 13855.
        reach_m: where the middle of the hand goes, in odom; at most an arm's length (0.60 m) from the right shoulder.
        reach_s: how long the hand takes; its highest speed is 1.875 times the way over this time.
    """

    motion: Literal["stand", "walk-past", "reach-in"] = "stand"
    x_m: float = 1.0
    y_m: float = 0.0
    yaw_rad: float = math.pi
    start_s: float = 0.0
    speed_m_s: float = 1.3
    reach_m: Vec3 = (0.45, 0.1, 1.1)
    reach_s: float = 0.6

    def __post_init__(self) -> None:
        for name in ("x_m", "y_m", "yaw_rad"):
            if not math.isfinite(getattr(self, name)):
                raise ConfigError(f"human.{name}", f"{getattr(self, name)!r} is not a finite number")
        if not 0.0 <= self.start_s < math.inf:
            raise ConfigError("human.start_s", f"{self.start_s!r} is not a time from 0 s on")
        if not 0.1 <= self.speed_m_s <= 2.0:
            raise ConfigError("human.speed_m_s", f"{self.speed_m_s!r} is not a walking speed of 0.1 to 2 m/s")
        if not 0.1 <= self.reach_s < math.inf:
            raise ConfigError("human.reach_s", f"{self.reach_s!r} is not a time of 0.1 s or more")
        if self.motion == "reach-in":
            far = math.dist(_to_body(self, self.reach_m), _shoulder(1))
            if not far <= 0.99 * (_UPPER_ARM + _TO_HAND):
                reach = f"; an arm reaches {0.99 * (_UPPER_ARM + _TO_HAND):.2f} m: place the human nearer"
                raise ConfigError("human.reach_m", f"{self.reach_m!r} is {far:.2f} m from the right shoulder", reach)


class MovedHuman(msgspec.Struct, frozen=True):
    """The human at one time, in odom.

    Attributes:
        ends: both ends of each capsule of PARTS, shape (16, 2, 3), m.
        velocity: of the trunk over the floor, m/s.
    """

    ends: Array
    velocity: Vec3

    @property
    def pos(self) -> Array:
        """Positions of the mocap bodies, shape (16, 3): the middles of the capsules."""
        middles: Array = self.ends.mean(axis=1)
        return middles

    @property
    def quat(self) -> Array:
        """Their orientations w x y z, shape (16, 4): the shortest turn of the z axis into the capsule's axis."""
        axis = self.ends[:, 1] - self.ends[:, 0]
        length = np.linalg.norm(axis, axis=1, keepdims=True)
        axis = np.where(length > 1e-9, axis / np.maximum(length, 1e-9), (0.0, 0.0, 1.0))
        q = np.stack((1.0 + axis[:, 2], -axis[:, 1], axis[:, 0], np.zeros(len(axis))), axis=1)
        q[q[:, 0] < 1e-9] = (0.0, 1.0, 0.0, 0.0)  # upside down: any horizontal axis will do
        unit: Array = q / np.linalg.norm(q, axis=1, keepdims=True)
        return unit

    def truth(self, name: str = "human", uncertainty_m: float = 0.0) -> HumanPose:
        """What a perfect perception would say, for the channel ``humans/pose``."""
        rows = self.ends.tolist()
        capsules = tuple(Capsule(p.region, tuple(a), tuple(b), p.radius) for p, (a, b) in zip(PARTS, rows, strict=True))
        return HumanPose(name, capsules, self.velocity, uncertainty_m)


class HumanMotion:
    """Where the human is at any time: a function of settings and time alone."""

    def __init__(self, settings: HumanSettings) -> None:
        self._settings = settings
        hip = _LEGS[0][0].b[2]
        self._gait = Gait(settings.speed_m_s, hip, _ANKLE, _LEG, _HEEL, _FOOT - _HEEL, _FOOT_RADIUS)

    def pose(self, time_ns: int) -> MovedHuman:
        """The human at this time."""
        s = self._settings
        walked, speed = self._walked(seconds(time_ns) - s.start_s)
        c, sn = math.cos(s.yaw_rad), math.sin(s.yaw_rad)
        body = self._body(walked, seconds(time_ns) - s.start_s)
        turn = np.array(((c, sn, 0.0), (-sn, c, 0.0), (0.0, 0.0, 1.0)))
        return MovedHuman(body @ turn + (s.x_m, s.y_m, 0.0), (c * speed, sn * speed, 0.0))

    def _walked(self, t_s: float) -> tuple[float, float]:
        """Way gone (m) and speed (m/s); the speed rises as 3 u^2 - 2 u^3 over the ramp."""
        s = self._settings
        if s.motion != "walk-past" or t_s <= 0.0:
            return 0.0, 0.0
        u = min(t_s / _RAMP_S, 1.0)
        way = _RAMP_S * (u**3 - 0.5 * u**4) + max(t_s - _RAMP_S, 0.0)
        return s.speed_m_s * way, s.speed_m_s * smooth(u)

    def _body(self, walked: float, t_s: float) -> Array:
        """Ends of all capsules with x forward from where he stood, y left, z up."""
        gait, phase = self._gait, FIRST_PHASE + walked / self._gait.step_m
        x, hip = gait.pelvis(phase)
        rise = hip - _LEGS[0][0].b[2]
        ends: list[tuple[Vec3, Vec3]] = [((x, 0.0, c.a[2] + rise), (x, 0.0, c.b[2] + rise)) for c in _TRUNK]
        feet: list[tuple[Vec3, Vec3]] = []
        for side in (0, 1):
            ends += self._arm(side, x, rise, phase, t_s)
            y = _leg_y(side)
            ax, az, pitch = gait.foot(side, phase)
            kx, kz = _bent((x, hip), (ax, az), _THIGH, _SHANK)
            ends += [((kx, y, kz), (x, y, hip)), ((ax, y, az), (kx, y, kz))]
            feet.append(_foot(ax, az, pitch, y))
        return np.array(ends + feet)

    def _arm(self, side: int, x: float, rise: float, phase: float, t_s: float) -> list[tuple[Vec3, Vec3]]:
        sx, sy, sz = _shoulder(side)
        shoulder = (x + sx, sy, sz + rise)
        ahead = self._gait.swing(phase)
        back = ahead if side == 0 else -ahead
        if side == 1 and self._settings.motion == "reach-in":
            return self._reaching(shoulder, t_s)
        upper = -_ARM_SWING_RAD * back
        lower = upper + _BENT_RAD * (1.0 + ahead**2)
        elbow = _hung(shoulder, upper, _UPPER_ARM)
        wrist = _hung(elbow, lower, _FOREARM)
        return [(elbow, shoulder), (wrist, elbow), (_hung(wrist, lower, _HAND), wrist)]

    def _reaching(self, shoulder: Vec3, t_s: float) -> list[tuple[Vec3, Vec3]]:
        """The hand on a straight way with the least jerk (Flash and Hogan, J. Neurosci. 5, 1985); the elbow below."""
        s = self._settings
        u = min(max(t_s / s.reach_s, 0.0), 1.0)
        part = u**3 * (10.0 - 15.0 * u + 6.0 * u * u)
        begin = np.array(_hung(_hung(shoulder, 0.0, _UPPER_ARM), _BENT_RAD, _TO_HAND))
        root = np.array(shoulder)
        hand = begin + part * (np.array(_to_body(s, s.reach_m)) - begin)
        way = hand - root
        far = float(np.linalg.norm(way))
        along = (_UPPER_ARM**2 - _TO_HAND**2 + far**2) / (2.0 * far)
        below = np.array((-0.5, -0.3, -1.0))
        below -= way * (below @ way) / far**2
        out = math.sqrt(max(_UPPER_ARM**2 - along**2, 0.0)) / np.linalg.norm(below)
        elbow = root + way * (along / far) + out * below
        axis = (hand - elbow) / _TO_HAND
        points = [tuple(p.tolist()) for p in (elbow, elbow + _FOREARM * axis, elbow + (_FOREARM + _HAND) * axis)]
        return [(points[0], shoulder), (points[1], points[0]), (points[2], points[1])]


def _to_body(s: HumanSettings, p: Vec3) -> Vec3:
    """A point of odom in the frame of the human where he stands at first."""
    c, sn = math.cos(s.yaw_rad), math.sin(s.yaw_rad)
    dx, dy = p[0] - s.x_m, p[1] - s.y_m
    return c * dx + sn * dy, c * dy - sn * dx, p[2]


def _shoulder(side: int) -> Vec3:
    """Where the upper arm begins, standing; the template hangs the arm's axis from the acromion, 2 cm too far out."""
    x, y, z = _ARMS[side][0].b
    return x, y - math.copysign(0.02, y), z


def _leg_y(side: int) -> float:
    """The template puts the axes of the legs at the outside of the hips; here it is their surface that ends there."""
    y = _LEGS[side][0].b[1]
    return y - math.copysign(_LEGS[side][0].radius, y)


def _hung(top: Vec3, angle: float, length: float) -> Vec3:
    """The lower end of a link that hangs from the top at an angle to the vertical, forward positive (rad)."""
    return top[0] + length * math.sin(angle), top[1], top[2] - length * math.cos(angle)


def _bent(hip: tuple[float, float], ankle: tuple[float, float], thigh: float, shank: float) -> tuple[float, float]:
    """The knee, ahead of the line from hip to ankle, all (x, z)."""
    dx, dz = ankle[0] - hip[0], ankle[1] - hip[1]
    far = math.hypot(dx, dz)
    along = (thigh**2 - shank**2 + far**2) / (2.0 * far)
    out = math.sqrt(max(thigh**2 - along**2, 0.0))
    ux, uz = dx / far, dz / far
    return hip[0] + along * ux - out * uz, hip[1] + along * uz + out * ux


def _foot(x: float, z: float, pitch: float, y: float) -> tuple[Vec3, Vec3]:
    """Heel and tip of a foot, from its ankle and pitch."""
    c, s, down = math.cos(pitch), math.sin(pitch), _ANKLE - _FOOT_RADIUS
    mx, mz = x + s * down, z - c * down
    toe = _FOOT - _HEEL
    return (mx - c * _HEEL, y, mz - s * _HEEL), (mx + c * toe, y, mz + s * toe)


def add_human(spec: Any, contype: int, friction: float = 0.6) -> None:
    """Put the human's mocap bodies into a MjSpec, far away until apply places them.

    Args:
        spec: a MjSpec that is not compiled yet.
        contype: bits of the human in the contact filter; his conaffinity is 0: what shall touch him has one of these
            bits in its conaffinity.
        friction: sliding coefficient of clothes and skin; MuJoCo takes the larger one of two geoms that touch.
    """
    for part in PARTS:
        body = spec.worldbody.add_body(name=f"human-{part.name}", mocap=True, pos=(0.0, 0.0, -10.0))
        body.add_geom(
            name=f"human-{part.name}",
            type=mujoco.mjtGeom.mjGEOM_CAPSULE,
            size=(part.radius, max(0.5 * part.length, 1e-6), 0.0),
            contype=contype,
            conaffinity=0,
            friction=(friction, 0.005, 0.0001),
            rgba=(*part.colour, 1.0),
        )


def apply(model: Any, data: Any, moved: MovedHuman) -> None:
    """Place the mocap bodies of a MjData; kinematics follow at its next step or forward.

    Raises:
        KeyError: the model has no human.
    """
    body = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, f"human-{PARTS[0].name}")
    if body < 0:
        raise KeyError("the model has no human: add_human comes before compile")
    first = int(model.body_mocapid[body])  # those of the others follow, as they were added
    data.mocap_pos[first : first + len(PARTS)] = moved.pos
    data.mocap_quat[first : first + len(PARTS)] = moved.quat
