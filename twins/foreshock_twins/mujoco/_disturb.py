"""What goes wrong: changes of the world and of the robot at given times. Each is at rest by its default parameters."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import mujoco
import numpy as np

from foreshock.errors import ConfigError
from foreshock_twins.mujoco._model import Body

__all__ = ["Disturbances"]

_PAYLOAD_RADIUS_M = 0.1
_BLOCK_HALF_M = 0.05


class Disturbances:
    """Applies them to a run's own copies of model and data, at the beginning of each tick."""

    def __init__(self, body: Body) -> None:
        self._body = body

    def reset(self, parameters: Mapping[str, float], model: Any, data: Any) -> None:
        """Begin a run.

        Raises:
            ConfigError: the weak joint is none of the robot's, or a payload has nothing to hang from.
        """
        p, body = parameters, self._body
        self._p, self._model, self._data = p, model, data
        if not p["weak_joint"] < len(body.joints):
            raise ConfigError(
                "parameters",
                f"'weak_joint' = {p['weak_joint']!r} is no number of a joint",
                f"; expected 0 to {len(body.joints) - 1}",
            )
        self._weak = int(p["weak_joint"])
        if p["payload_hands"] > 0.0 and not {"left_hand", "right_hand"} <= body.payloads.keys():
            raise ConfigError(
                "parameters",
                "'payload_hands' is given, and the robot has no hands",
                "; set twin.robot.left_hand and right_hand",
            )
        self._loaded = False
        self._block_placed = False
        self._block_from = -1

    @property
    def weak(self) -> tuple[int, float]:
        """Joint that has lost torque, and the share that is left."""
        on = self._data.time >= self._p["weak_time"] - 1e-9
        return self._weak, self._p["weak_share"] if on else 1.0

    def during(self, name: str) -> bool:
        """Whether it is between ``<name>_time`` and that plus ``<name>_duration``."""
        begin = self._p[f"{name}_time"]
        now = float(self._data.time)
        return begin - 1e-9 <= now < begin + self._p[f"{name}_duration"] - 1e-9

    @property
    def blind(self) -> bool:
        """Balance feedback is lost."""
        return self.during("blind")

    @property
    def lag_s(self) -> float:
        """Added age of measurements."""
        return self._p["lag"] if self.during("lag") else 0.0

    def apply(self, swing: int, share: float, place: tuple[float, float, float]) -> None:
        """Set what holds now.

        Args:
            swing: foot in the air by the plan, or -1.
            share: of its swing that is over.
            place: where it will land in odom: x, y (m), heading (rad).
        """
        p, model, data, body = self._p, self._model, self._data, self._body
        icy = self.during("drop")
        for side, geom in enumerate(body.sole_geoms):
            on = icy and p["drop_foot"] in (side, 2.0)
            model.geom_friction[geom, 0] = p["drop_mu"] if on else p["mu"]
        if p["push_impulse"]:
            self._push()
        if not self._loaded and data.time >= p["payload_time"] - 1e-9:
            self._load()
        if p["block_height"] > 0.0 and not self._block_placed:
            self._block(swing, share, place)

    def _push(self) -> None:
        """Constant force at the torso's centre of mass."""
        p = self._p
        force = p["push_impulse"] / p["push_duration"] if self.during("push") else 0.0
        along = p["push_direction"]
        self._data.xfrc_applied[self._body.torso_id, :2] = force * np.cos(along), force * np.sin(along)

    def _load(self) -> None:
        self._loaded = True
        p, model = self._p, self._model
        shares = {
            "torso": p["payload_torso"],
            "left_hand": 0.5 * p["payload_hands"],
            "right_hand": 0.5 * p["payload_hands"],
        }
        changed = False
        for key, mass in shares.items():
            if mass > 0.0 and key in self._body.payloads:
                body = model.body(self._body.payloads[key]).id
                model.body_mass[body] = mass
                model.body_inertia[body] = 0.4 * mass * _PAYLOAD_RADIUS_M**2
                changed = True
        if changed:
            mujoco.mj_setConst(model, mujoco.MjData(model))

    def _block(self, swing: int, share: float, place: tuple[float, float, float]) -> None:
        """Lies where the first swing lands that begins after its time; put there in the middle of that swing."""
        p, data = self._p, self._data
        if swing < 0:
            self._block_from = -1
            return
        if self._block_from < 0 and share < 0.2 and data.time >= p["block_time"]:
            self._block_from = swing
        if self._block_from == swing and share >= 0.45:
            x, y, yaw = place
            k = self._body.block_mocap
            data.mocap_pos[k] = x, y, p["block_height"] - _BLOCK_HALF_M
            data.mocap_quat[k] = np.cos(0.5 * yaw), 0.0, 0.0, np.sin(0.5 * yaw)
            self._block_placed = True
