"""Kalman filter of one force and its rate, in two forms that agree: by scalars, and by filterpy.

State x = (w, w'): force w (N) and its rate w' (N/s), whose rate wanders as white noise of density q (N^2/s^3):

    x <- F x + noise     F = [[1, dt], [0, 1]],  Q = q [[dt^3/3, dt^2/2], [dt^2/2, dt]]
    z  = h w + noise     variance r (N^2)

(Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, section 6.2.2). The
innovation nu = z - h F x has variance S = h^2 P00 + r; the normalised one, nu / sqrt(S), is white N(0, 1) under the
model. The update uses nu cut at gate * sqrt(S), so that one outlier cannot bend the estimate. Finite z is the caller's
duty.
"""

from __future__ import annotations

import math
from typing import Any, Literal, Protocol

__all__ = ["FilterpyForceFilter", "ForceFilter", "ScalarForceFilter", "force_filter"]

RATE_VARIANCE = 1.0e4
"""Variance of the unknown rate at a restart, (100 N/s)^2: a gripper that closes."""


class ForceFilter(Protocol):
    """What both forms offer."""

    force: float
    rate: float
    force_variance: float

    def restart(self, force: float, variance: float) -> None:
        """Begin at a force (N) of this variance (N^2) with unknown rate."""

    def step(self, z: float, dt: float, h: float, r: float, q: float, gate: float) -> float:
        """Predict over dt (s), update with z (N); gives the normalised innovation before the gate."""


class ScalarForceFilter:
    """The filter written out in scalars; P is symmetric by construction."""

    __slots__ = ("_p01", "_p11", "force", "force_variance", "rate")

    def __init__(self) -> None:
        self.restart(0.0, 1.0)

    def restart(self, force: float, variance: float) -> None:
        """Begin at a force (N) of this variance (N^2) with unknown rate."""
        self.force, self.rate = force, 0.0
        self.force_variance, self._p01, self._p11 = variance, 0.0, RATE_VARIANCE

    def step(self, z: float, dt: float, h: float, r: float, q: float, gate: float) -> float:
        """Predict over dt (s), update with z (N); gives the normalised innovation before the gate."""
        p01, p11, qdt = self._p01, self._p11, q * dt
        force = self.force + self.rate * dt
        p00 = self.force_variance + dt * (2.0 * p01 + dt * p11 + qdt * dt / 3.0)
        p01 += dt * (p11 + 0.5 * qdt)
        p11 += qdt
        s = h * h * p00 + r
        root = math.sqrt(s)
        innovation = z - h * force
        normalised = innovation / root
        if normalised > gate:
            innovation = gate * root
        elif normalised < -gate:
            innovation = -gate * root
        k0, k1 = p00 * h / s, p01 * h / s
        self.force = force + k0 * innovation
        self.rate += k1 * innovation
        self.force_variance = p00 * r / s
        self._p01 = p01 * r / s
        self._p11 = p11 - k1 * h * p01
        return normalised


class FilterpyForceFilter:
    """The same filter by filterpy.kalman.KalmanFilter, with matrices of our own.

    filterpy 2.0's kinematic_kf(2, 1) sums the axes, and its log_likelihood costs more than the filter: neither is used.
    """

    def __init__(self) -> None:
        import numpy as np
        from filterpy.kalman import KalmanFilter

        self._np = np
        self._kf: Any = KalmanFilter(dim_x=2, dim_z=1)
        self.restart(0.0, 1.0)

    @property
    def force(self) -> float:
        """Estimated force (N)."""
        return float(self._kf.x[0, 0])

    @property
    def rate(self) -> float:
        """Estimated rate of the force (N/s)."""
        return float(self._kf.x[1, 0])

    @property
    def force_variance(self) -> float:
        """Variance of the force estimate (N^2)."""
        return float(self._kf.P[0, 0])

    def restart(self, force: float, variance: float) -> None:
        """Begin at a force (N) of this variance (N^2) with unknown rate."""
        self._kf.x = self._np.array([[force], [0.0]])
        self._kf.P = self._np.array([[variance, 0.0], [0.0, RATE_VARIANCE]])

    def step(self, z: float, dt: float, h: float, r: float, q: float, gate: float) -> float:
        """Predict over dt (s), update with z (N); gives the normalised innovation before the gate."""
        array, kf = self._np.array, self._kf
        cross = q * dt * dt / 2.0
        kf.predict(F=array([[1.0, dt], [0.0, 1.0]]), Q=array([[q * dt**3 / 3.0, cross], [cross, q * dt]]))
        expected = h * float(kf.x[0, 0])
        root = math.sqrt(h * h * float(kf.P[0, 0]) + r)
        normalised = (z - expected) / root
        gated = min(max(normalised, -gate), gate)
        kf.update(array([[expected + gated * root]]), R=array([[r]]), H=array([[h, 0.0]]))
        return normalised


def force_filter(backend: Literal["scalar", "filterpy"]) -> ForceFilter:
    """A new filter of this form."""
    return ScalarForceFilter() if backend == "scalar" else FilterpyForceFilter()  # type: ignore[return-value]  # read-only
