"""Inverse kinematics: joint positions that put the centre of mass, both soles and the base's attitude where planned.

Damped least squares over base and legs, a Newton step a tick from the last solution; trunk and arms are given.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pinocchio as pin

from foreshock_twins.mujoco._model import Body, Floats
from foreshock_twins.mujoco._walk import Foothold

__all__ = ["InverseKinematics"]

_DAMPING = 1e-6


class InverseKinematics:
    """Keeps the last solution.

    Attributes:
        q: configuration (Pinocchio, nq).
    """

    def __init__(self, body: Body) -> None:
        self._model, self._data, self._soles = body.pin_model, body.pin_model.createData(), body.soles
        free = np.concatenate([np.arange(6), body.pin_v[body.legs]])
        self._free = np.sort(free)
        self._start = body.q0
        self._rows: Floats = np.zeros((18, len(self._free)))
        self._errors: Floats = np.zeros(18)
        self._dq: Floats = np.zeros(body.pin_model.nv)
        self._damping = _DAMPING * np.eye(18)
        self.reset()

    def reset(self) -> None:
        """Back to the reference posture."""
        self.q = self._start.copy()

    def solve(self, com: Floats, feet: list[tuple[Foothold, float]], yaw: float, steps: int = 1) -> Floats:
        """Take Newton steps towards a centre of mass (m), two soles with their heights (m), and a level base."""
        targets = [_pose(place, height) for place, height in feet]
        upright = _turned(yaw)
        model, data, rows, errors = self._model, self._data, self._rows, self._errors
        for _ in range(steps):
            jacobian = pin.jacobianCenterOfMass(model, data, self.q)
            pin.computeJointJacobians(model, data, self.q)
            rows[:3] = jacobian[:, self._free]
            errors[:3] = com - data.com[0]
            for k, (frame, target) in enumerate(zip(self._soles, targets, strict=True)):
                place = pin.updateFramePlacement(model, data, frame)
                errors[3 + 6 * k : 9 + 6 * k] = pin.log6(place.actInv(target)).vector
                rows[3 + 6 * k : 9 + 6 * k] = pin.getFrameJacobian(model, data, frame, pin.LOCAL)[:, self._free]
            errors[15:] = pin.log3(data.oMi[1].rotation.T @ upright)
            rows[15:] = 0.0
            rows[15:, 3:6] = np.eye(3)
            self._dq[self._free] = rows.T @ np.linalg.solve(rows @ rows.T + self._damping, errors)
            self.q = pin.integrate(model, self.q, self._dq)
        return self.q

    def torques(self, v: Floats, a: Floats, shares: tuple[float, float]) -> Floats:
        """Joint torques (N m, Pinocchio, nv) of a motion v, a at q, when each sole carries its share of the ground.

        Inverse dynamics without contact asks a wrench b of the base, which the soles give: J_k' w_k = share_k b.
        """
        model, data = self._model, self._data
        torque: Floats = np.array(pin.rnea(model, data, self.q, v, a))
        base = torque[:6].copy()
        pin.computeJointJacobians(model, data, self.q)
        for frame, share in zip(self._soles, shares, strict=True):
            if share > 0.0:
                jacobian = pin.computeFrameJacobian(model, data, self.q, frame, pin.LOCAL)
                torque -= jacobian.T @ np.linalg.solve(jacobian[:, :6].T, share * base)
        return torque


def _turned(yaw: float) -> Floats:
    c, s = math.cos(yaw), math.sin(yaw)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _pose(place: Foothold, height: float) -> Any:
    return pin.SE3(_turned(place.yaw), np.array([place.x, place.y, height]))
