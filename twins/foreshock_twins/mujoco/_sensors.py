"""What the robot measures of itself: true values at an instant, with noise, from a random stream of its own."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import msgspec
import mujoco
import numpy as np

from foreshock_twins.mujoco._model import Body, Floats

__all__ = ["Hand", "Measured", "Sensors", "noisy_quaternion"]


class Hand(msgspec.Struct, frozen=True):
    """A hand's angular velocity (rad/s) and specific force (m/s2) in its axes, its attitude (xyzw) and place (m)."""

    gyro: Floats
    acceleration: Floats
    attitude: Floats
    place: Floats


class Measured(msgspec.Struct, frozen=True):
    """One measurement of all of the robot's sensors.

    Attributes:
        stamp_ns: when.
        q: base pose and joint positions (Pinocchio, nq).
        v: base twist in its own axes and joint velocities (Pinocchio, nv).
        effort: joint torques (N m), as joints.
        attitude: of the torso, quaternion xyzw.
        gyro: of the torso, in its axes (rad/s).
        acceleration: specific force at the torso, in its axes (m/s2).
        wrenches: ground on each sole in its frame, shape (2, 6): force (N), torque (N m).
        hands: of each hand, by a unit of its own and as a camera sees it.
    """

    stamp_ns: int
    q: Floats
    v: Floats
    effort: Floats
    attitude: Floats
    gyro: Floats
    acceleration: Floats
    wrenches: Floats
    hands: tuple[Hand, ...] = ()


class Sensors:
    """Measures a MjData whose derived quantities are those of its state (after mj_forward)."""

    def __init__(self, body: Body) -> None:
        self._body = body
        m = body.model
        self._gyro, self._accelerometer = (int(m.sensor(n).adr[0]) for n in ("torso-gyro", "torso-accelerometer"))
        self.torso_site = m.site("torso-imu").id
        self.sole_sites = tuple(m.site(f"{s}-sole").id for s in ("left", "right"))
        self._hands = [
            (*(int(m.sensor(f"{s}-hand-{k}").adr[0]) for k in ("gyro", "accelerometer")), m.site(f"{s}-hand").id)
            for s, _ in body.hands
        ]
        self._draws = 12 + 3 * len(body.joints) + 9 + 12

    def reset(self, parameters: Mapping[str, float], rng: np.random.Generator, hands_rng: np.random.Generator) -> None:
        """Begin a run; the hands have a random stream of their own."""
        p, n = parameters, len(self._body.joints)
        self._rng, self._hands_rng = rng, hands_rng
        names = ("gyro_noise", "accelerometer_noise", "object_tilt_noise", "object_noise")
        self._hand_sd = np.repeat([p[name] for name in names], 3)
        self._sd = np.concatenate(
            [
                np.full(3, p["base_noise"]),
                np.full(3, p["attitude_noise"]),
                np.full(3, p["base_rate_noise"]),
                np.full(3, p["gyro_noise"]),
                np.full(n, p["encoder_noise"]),
                np.full(n, p["joint_rate_noise"]),
                np.full(n, p["effort_noise"]),
                np.full(3, p["attitude_noise"]),
                np.full(3, p["gyro_noise"]),
                np.full(3, p["accelerometer_noise"]),
                np.tile(np.repeat([p["force_noise"], p["torque_noise"]], 3), 2),
            ]
        )

    def measure(self, data: Any, stamp_ns: int) -> Measured:
        """One measurement. The number of draws is fixed, so that the noise does not depend on what happens."""
        body, n = self._body, len(self._body.joints)
        noise = self._sd * self._rng.standard_normal(self._draws)
        q, v = body.pinocchio_state(data.qpos, data.qvel)
        q[:3] += noise[:3]
        q[3:7] = noisy_quaternion(q[3:7], noise[3:6])
        v[:6] += noise[6:12]
        at = 12
        q[body.pin_q] += noise[at : at + n]
        v[body.pin_v] += noise[at + n : at + 2 * n]
        effort = data.actuator_force[body.actuators] + noise[at + 2 * n : at + 3 * n]
        at += 3 * n
        attitude = np.empty(4)
        mujoco.mju_mat2Quat(attitude, data.site_xmat[self.torso_site])
        attitude = noisy_quaternion(attitude[[1, 2, 3, 0]], noise[at : at + 3])
        gyro = data.sensordata[self._gyro : self._gyro + 3] + noise[at + 3 : at + 6]
        acceleration = data.sensordata[self._accelerometer : self._accelerometer + 3] + noise[at + 6 : at + 9]
        wrenches = self.true_wrenches(data)
        wrenches += noise[at + 9 :].reshape(2, 6)
        hands = tuple(self._hand(data, *hand) for hand in self._hands)
        return Measured(stamp_ns, q, v, effort, attitude, gyro, acceleration, wrenches, hands)

    def _hand(self, data: Any, gyro: int, accelerometer: int, site: int) -> Hand:
        noise = self._hand_sd * self._hands_rng.standard_normal(12)
        attitude = np.empty(4)
        mujoco.mju_mat2Quat(attitude, data.site_xmat[site])
        return Hand(
            data.sensordata[gyro : gyro + 3] + noise[:3],
            data.sensordata[accelerometer : accelerometer + 3] + noise[3:6],
            noisy_quaternion(attitude[[1, 2, 3, 0]], noise[6:9]),
            data.site_xpos[site] + noise[9:],
        )

    def true_wrenches(self, data: Any) -> Floats:
        """What the ground exerts on each sole, in its frame and about its origin, shape (2, 6): force, torque.

        MuJoCo sums the contacts of a body about the centre of mass of its tree, in world axes, torque first.
        """
        body = self._body
        centre = data.subtree_com[body.base_id]
        found = np.empty((2, 6))
        for k, (foot, site) in enumerate(zip(body.foot_bodies, self.sole_sites, strict=True)):
            spatial = data.cfrc_ext[foot]
            r = data.site_xmat[site].reshape(3, 3)
            force = spatial[3:]
            found[k, :3] = r.T @ force
            ax, ay, az = (centre - data.site_xpos[site]).tolist()
            fx, fy, fz = force.tolist()
            moved = np.array((ay * fz - az * fy, az * fx - ax * fz, ax * fy - ay * fx))
            found[k, 3:] = r.T @ (spatial[:3] + moved)
        return found


def noisy_quaternion(xyzw: Floats, angles: Floats) -> Floats:
    """A unit quaternion turned by small angles (rad) about its own axes."""
    x, y, z, w = xyzw
    a, b, c = 0.5 * angles
    turned = np.array(
        [x + w * a + y * c - z * b, y + w * b + z * a - x * c, z + w * c + x * b - y * a, w - x * a - y * b - z * c]
    )
    unit: Floats = turned / np.sqrt(turned @ turned)
    return unit
