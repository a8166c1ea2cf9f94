"""TALOS swaying, stepping and slipping by closed-form kinematics, and the noisy samples that its sensors would give.

Angles: phi is the lean of a leg towards +y, theta the roll of pelvis and torso about +x. TALOS has no torso roll joint.
With hip roll = -phi - theta and ankle roll = +phi the sole stays flat. Velocities come from Pinocchio's difference on
the Lie group, ground wrenches from rnea: neither is computed by the detector in this way.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np
import pinocchio as pin

from foreshock.detector import Inputs
from foreshock.messages import Imu, JointState, MotionPlan, Odometry, WrenchStamped
from foreshock.records import Indication, Sample
from foreshock_detectors.balance import BalanceConfig
from foreshock_detectors.balance._detector import BalanceDetector
from foreshock_detectors.balance._model import RobotModel

ROBOT = RobotModel(BalanceConfig())
MODEL = ROBOT.model
Q0 = ROBOT.reference
NAMES = tuple(MODEL.names)[2:]
LEG_M, BASE_M, ANKLE_M = 0.6412, 0.2711, 0.107
SOLES = {side: MODEL.getFrameId(f"{side}_sole_link") for side in ("left", "right")}
IMU_FRAME = MODEL.getFrameId("imu_link")
CHANNELS = {
    "joints": "joints/state",
    "odometry": "base/odometry",
    "imu": "imu/torso",
    "left_wrench": "left_sole/wrench",
    "right_wrench": "right_sole/wrench",
    "plan": "plan/motion",
}
H = 1e-4
DATA = MODEL.createData()

Signal = Callable[[float], float]


def zero(t: float) -> float:
    return 0.0


def _index(name: str) -> int:
    return MODEL.joints[MODEL.getJointId(name)].idx_q


@dataclass
class Noise:
    """Standard deviations of white noise; a gyroscope bias in rad/s on every axis."""

    position_m: float = 7e-4
    orientation_rad: float = 2e-4
    linear_m_s: float = 2e-3
    angular_rad_s: float = 2e-3
    encoder_rad: float = 1e-4
    joint_rad_s: float = 2e-3
    gyro_rad_s: float = 5e-3
    gyro_bias_rad_s: float = 0.01
    force_n: float = 3.0
    torque_nm: float = 0.2

    @classmethod
    def none(cls) -> Noise:
        return cls(*[0.0] * 10)


@dataclass
class Motion:
    """What TALOS does over time: CoM sway by leaning, roll, where each foot has moved, and how the load is shared."""

    com_y: Signal = zero
    theta: Signal = zero
    left_y: Signal = zero
    right_y: Signal = zero
    left_share: Signal = lambda t: 0.5
    plan_y: Signal | None = None
    push_n: Signal = zero
    noise: Noise = field(default_factory=Noise)
    rate_hz: float = 200.0
    seed: int = 0

    def q(self, t: float) -> np.ndarray:
        """Configuration: the CoM's 0.5416 sin(phi) of the closed form sets the lean."""
        lean, theta = math.asin((self.com_y(t) - 0.00125) / 0.54162), self.theta(t)
        q = Q0.copy()
        base_y = LEG_M * math.sin(lean) - BASE_M * math.sin(theta)
        q[1] = base_y
        q[2] = ANKLE_M + LEG_M * math.cos(lean) + BASE_M * math.cos(theta)
        q[3:7] = (math.sin(theta / 2), 0.0, 0.0, math.cos(theta / 2))
        for side, shift in (("left", self.left_y(t)), ("right", self.right_y(t))):
            phi = math.asin(math.sin(lean) - shift / LEG_M)
            q[_index(f"leg_{side}_2_joint")] = -phi - theta
            q[_index(f"leg_{side}_6_joint")] = phi
        return q

    def v(self, t: float) -> np.ndarray:
        return pin.difference(MODEL, self.q(t - H), self.q(t + H)) / (2 * H)

    def a(self, t: float) -> np.ndarray:
        return (self.v(t + H) - self.v(t - H)) / (2 * H)

    def samples(self, t_end: float, t_start: float = 0.0) -> Iterator[dict[str, Sample]]:
        """All channels at each instant, by input name."""
        rng = np.random.default_rng(self.seed)
        n, data = self.noise, MODEL.createData()
        for k in range(round((t_end - t_start) * self.rate_hz)):
            t = t_start + k / self.rate_hz
            stamp = round(t * 1e9)
            q, v, a = self.q(t), self.v(t), self.a(t)
            pin.forwardKinematics(MODEL, data, q, v, a)
            pin.updateFramePlacements(MODEL, data)
            gyro = pin.getFrameVelocity(MODEL, data, IMU_FRAME, pin.LOCAL).angular
            orientation = pin.Quaternion(data.oMf[IMU_FRAME].rotation).coeffs()
            left, right = self._wrenches(t, q, v, a)
            turn = pin.exp3(rng.normal(0.0, n.orientation_rad, 3)) if n.orientation_rad else np.eye(3)
            base = pin.Quaternion(pin.Quaternion(q[3:7]).toRotationMatrix() @ turn).coeffs()
            value = {
                "joints": JointState(
                    NAMES,
                    _tuple(q[7:] + rng.normal(0.0, n.encoder_rad, len(NAMES))),
                    _tuple(v[6:] + rng.normal(0.0, n.joint_rad_s, len(NAMES))),
                ),
                "odometry": Odometry(
                    _tuple(q[:3] + rng.normal(0.0, n.position_m, 3)),
                    _tuple(base),
                    _tuple(v[:3] + rng.normal(0.0, n.linear_m_s, 3)),
                    _tuple(v[3:6] + rng.normal(0.0, n.angular_rad_s, 3)),
                ),
                "imu": Imu(
                    _tuple(orientation),
                    _tuple(gyro + n.gyro_bias_rad_s + rng.normal(0.0, n.gyro_rad_s, 3)),
                    (0.0, 0.0, 9.81),
                ),
                "left_wrench": _noisy(left, rng, n, "left_sole_link"),
                "right_wrench": _noisy(right, rng, n, "right_sole_link"),
            }
            if self.plan_y is not None:
                value["plan"] = MotionPlan((0.0, self.plan_y(t), 0.87), ("left", "right"))
            yield {name: Sample(stamp, f"talos/{CHANNELS[name]}", v) for name, v in value.items()}

    def _wrenches(self, t: float, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> tuple[pin.Force, pin.Force]:
        """Ground wrenches in the sole frames: rnea's root wrench, less a push on the CoM, shared by left_share."""
        data = DATA
        root = pin.rnea(MODEL, data, q, v, a)[:6]
        pin.framesForwardKinematics(MODEL, data, q)
        total = data.oMi[1].act(pin.Force(root))
        push = np.array([0.0, self.push_n(t), 0.0])
        com = pin.centerOfMass(MODEL, data, q)
        total = total - pin.Force(push, np.cross(com, push))
        share, wrenches = self.left_share(t), []
        for side, part in (("left", share), ("right", 1.0 - share)):
            # the share acts as a force at the common CoP's projection: each sole gets its part of the whole wrench
            wrenches.append(data.oMf[SOLES[side]].actInv(pin.Force(total.linear * part, total.angular * part)))
        return wrenches[0], wrenches[1]


def _tuple(x: np.ndarray) -> tuple[float, ...]:
    return tuple(x.tolist())


def _noisy(wrench: pin.Force, rng: np.random.Generator, noise: Noise, frame: str) -> WrenchStamped:
    force = wrench.linear + rng.normal(0.0, noise.force_n, 3)
    return WrenchStamped(_tuple(force), _tuple(wrench.angular + rng.normal(0.0, noise.torque_nm, 3)), frame)


def inputs(samples: dict[str, Sample]) -> Inputs:
    return Inputs(dict(samples), {name: (s,) for name, s in samples.items()})


def now(samples: dict[str, Sample]) -> int:
    return max(s.stamp_ns for s in samples.values())


def run(
    motion: Motion, t_end: float, detector: BalanceDetector | None = None, t_start: float = 0.0
) -> list[tuple[float, dict[tuple[str, str], Indication]]]:
    """Indications by (kind, subject) at each instant."""
    detector = detector or BalanceDetector(BalanceConfig())
    out = []
    for samples in motion.samples(t_end, t_start):
        answer = detector.update(now(samples), inputs(samples))
        out.append((samples["joints"].stamp_ns / 1e9, {(i.kind, i.subject): i for i in answer}))
    return out


def onsets(log: list[tuple[float, dict[tuple[str, str], Indication]]]) -> dict[tuple[str, str], float]:
    """First time at which each (kind, subject) is present."""
    first: dict[tuple[str, str], float] = {}
    for t, answer in log:
        for key, indication in answer.items():
            if indication.present:
                first.setdefault(key, t)
    return first


def smooth_step(t: float, start: float, duration: float) -> float:
    """0 before, 1 after, with continuous second derivative (quintic)."""
    s = min(1.0, max(0.0, (t - start) / duration))
    return s * s * s * (10.0 - 15.0 * s + 6.0 * s * s)


def stepping(t: float) -> float:
    """Left foot's share of the load: single support 0.45 s, double support 0.15 s, starting on both feet."""
    return min(1.0, max(0.0, 0.5 + 0.6 * math.sin(math.pi * t / 0.6) / math.sin(math.pi * 0.125) / 1.2))


def stepping_com(t: float) -> float:
    """Lateral CoM of stepping in place at 0.6 s a step: LIPM amplitude a (1 - 1 / cosh(w0 T / 2)) for a = 75 mm."""
    return 0.026 * math.sin(math.pi * t / 0.6)


def roll_pulse(t: float) -> float:
    """Roll by 0.15 rad with a peak rate of 15/8 * 0.15 / 0.3 = 0.94 rad/s."""
    return 0.15 * smooth_step(t, 2.0, 0.3)
