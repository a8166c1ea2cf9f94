"""Does the held object tilt slowly away from its command? CUSUM of the excess tilt."""

from __future__ import annotations

import math

from foreshock.messages import Odometry
from foreshock_detectors._sequential import Cusum, Hysteresis, RunningMedian, cusum_threshold
from foreshock_detectors.load._config import LoadConfig

__all__ = ["Tilt", "tilt_error"]

CLIP = 4.0
"""One outlier adds at most four standard deviations."""

MOST = 1.5
"""The sum is cut at this multiple of its threshold, so that a tilt that is gone is soon forgotten."""


def tilt_error(
    commanded: tuple[float, float, float, float], seen: tuple[float, float, float, float]
) -> tuple[float, float] | None:
    """Tilt about x and y (rad) of the seen orientation in the commanded one's frame; None if one is no rotation.

    With the vertical axis u = R(commanded)' R(seen) e_z of the object, the tilt is the rotation vector that turns e_z
    into u: angle acos(u_z) about (-u_y, u_x). A turn about the vertical is none.
    """
    a, b = _unit(commanded), _unit(seen)
    if a is None or b is None:
        return None
    ax, ay, az, aw = -a[0], -a[1], -a[2], a[3]
    bx, by, bz, bw = b
    x = aw * bx + ax * bw + ay * bz - az * by
    y = aw * by - ax * bz + ay * bw + az * bx
    z = aw * bz + ax * by - ay * bx + az * bw
    w = aw * bw - ax * bx - ay * by - az * bz
    ux, uy = 2.0 * (x * z + w * y), 2.0 * (y * z - w * x)
    flat = math.hypot(ux, uy)
    uz = 1.0 - 2.0 * (x * x + y * y)
    if flat < 1e-12:
        return (0.0, 0.0) if uz > 0.0 else (math.pi, 0.0)
    scale = math.atan2(flat, uz) / flat
    return -uy * scale, ux * scale


def _unit(q: tuple[float, float, float, float]) -> tuple[float, float, float, float] | None:
    norm = math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    if not 0.5 < norm < 2.0:
        return None
    return (q[0] / norm, q[1] / norm, q[2] / norm, q[3] / norm)


class Tilt:
    """Four one-sided sums, both ways about x and y, of z = (+-m - allowance) / sd.

    m is the error's mean over an exponential window, so that what swings is no drift; sd is that of one sample. As the
    mean scatters less, and the tilt stays within the allowance, they alarm less often than Siegmund's run length at
    exactly the allowance. The allowance grows with the commanded rate of rotation, which an object follows late.

    Attributes:
        angle: tilt now, of the mean (rad).
        statistic: largest sum, over its threshold.
        malformed: the last orientation was none.
    """

    def __init__(self, config: LoadConfig) -> None:
        self._config = config
        self._period = RunningMedian(least=1e-6, start=9)
        self._sums: tuple[Cusum, ...] = ()
        self._dt = self._x = self._y = 0.0
        self._hysteresis = Hysteresis(1.0, 0.5, round(config.hold_s * 1e9))
        self._stamp_ns = -1
        self.angle, self.statistic, self.malformed = 0.0, 0.0, False

    @property
    def ready(self) -> bool:
        """Whether the sampling period is known and the object's orientation is one."""
        return bool(self._sums) and not self.malformed

    @property
    def present(self) -> bool:
        """The verdict."""
        return self._hysteresis.present

    def push(self, stamp_ns: int, seen: Odometry, command: Odometry) -> None:
        """Take the next pose of the object and its command; one that is not newer is passed over."""
        dt_ns = stamp_ns - self._stamp_ns
        first = self._stamp_ns < 0
        if not first and dt_ns <= 0:
            return
        self._stamp_ns = stamp_ns
        error = tilt_error(command.orientation, seen.orientation)
        self.malformed = error is None
        if first or error is None:
            return
        period = self._period
        period.push(dt_ns * 1e-9)
        if not period.ready:
            return
        config = self._config
        if not (self._sums and 0.8 < period.value / self._dt < 1.25):
            self._dt, reference = period.value, 0.5 * config.smallest_drift_sigma
            limit = cusum_threshold(config.false_alarm_s / self._dt, reference)
            self._sums = tuple(Cusum(reference, limit, CLIP) for _ in range(4))
        weight = self._dt / (self._dt + config.tilt_window_s)
        self._x = x = self._x + weight * (error[0] - self._x)
        self._y = y = self._y + weight * (error[1] - self._y)
        self.angle = math.hypot(x, y)
        wx, wy, wz = command.angular
        allowance = config.tilt_allowance_rad + config.tilt_lag_s * math.sqrt(wx * wx + wy * wy + wz * wz)
        scale, largest = 1.0 / config.tilt_noise_rad, 0.0
        for cusum, e in zip(self._sums, (x, -x, y, -y), strict=True):
            cusum.push((e - allowance) * scale)
            if cusum.value > MOST * cusum.threshold:
                cusum.value = MOST * cusum.threshold
            if cusum.value > largest:
                largest = cusum.value
        self.statistic = largest / self._sums[0].threshold
        self._hysteresis.push(self.statistic, stamp_ns)
