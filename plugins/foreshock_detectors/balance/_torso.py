"""Torso angular spike: roll and pitch rate of the torso from its gyroscope."""

from __future__ import annotations

import math

from foreshock.clock import NS_PER_S
from foreshock.messages import Imu, Vec3
from foreshock_detectors.balance._config import BalanceConfig
from foreshock_detectors.balance._signals import Hysteresis, weight

__all__ = ["TorsoRate"]

QUATERNION_TOLERANCE = 0.01


class TorsoRate:
    """Low-passed angular rate without its vertical part, so that turning on the spot is no spike.

    With the vertical z in the sensor's axes (third row of the rotation that the IMU reports; the mounting of the sensor
    does not matter), the statistic is |w - (w . z) z|, w the gyroscope's rate after a first-order low pass and less a
    slow estimate of its bias. That estimate is bounded, so it can hide no more than gyro_bias_limit_rad_s.

    Attributes:
        rate_rad_s: the statistic; 0 before the first sample.
        stamp_ns: source time of the newest sample, -1 before the first.
    """

    def __init__(self, config: BalanceConfig) -> None:
        self._config = config
        self._hysteresis = Hysteresis(config.release_ratio)
        self._rate: Vec3 = (0.0, 0.0, 0.0)
        self._bias: Vec3 = (0.0, 0.0, 0.0)
        self.rate_rad_s = 0.0
        self.stamp_ns = -1

    @property
    def present(self) -> bool:
        """The verdict."""
        return self._hysteresis.present

    def update(self, stamp_ns: int, imu: Imu) -> bool:
        """Take one sample, later than the one before. False, and nothing taken, if it is malformed."""
        x, y, z, w = imu.orientation
        norm = math.sqrt(x * x + y * y + z * z + w * w)
        if not abs(norm - 1.0) <= QUATERNION_TOLERANCE or not math.isfinite(sum(imu.angular_velocity)):
            return False
        config = self._config
        gx, gy, gz = imu.angular_velocity
        dt = (stamp_ns - self.stamp_ns) / NS_PER_S
        if self.stamp_ns < 0 or dt > config.gap_s:
            rx, ry, rz = gx, gy, gz
        else:
            k = weight(dt, config.torso_filter_s)
            rx, ry, rz = self._rate
            rx, ry, rz = rx + k * (gx - rx), ry + k * (gy - ry), rz + k * (gz - rz)
            self._learn_bias(dt, gx, gy, gz)
        self._rate = (rx, ry, rz)
        bx, by, bz = self._bias
        rx, ry, rz = rx - bx, ry - by, rz - bz
        s = 2.0 / (norm * norm)
        ux, uy, uz = s * (x * z - w * y), s * (y * z + w * x), 1.0 - s * (x * x + y * y)
        turn = rx * ux + ry * uy + rz * uz
        rx, ry, rz = rx - turn * ux, ry - turn * uy, rz - turn * uz
        self.rate_rad_s = math.sqrt(rx * rx + ry * ry + rz * rz)
        self.stamp_ns = stamp_ns
        self._hysteresis.judge(self.rate_rad_s, config.torso_rate_rad_s)
        return True

    def _learn_bias(self, dt: float, gx: float, gy: float, gz: float) -> None:
        limit = self._config.gyro_bias_limit_rad_s
        k = weight(dt, self._config.gyro_bias_s)
        bx, by, bz = self._bias
        # motion is clipped to the largest possible bias, so that a fast turn does not teach one
        self._bias = (
            bx + k * (max(-limit, min(limit, gx)) - bx),
            by + k * (max(-limit, min(limit, gy)) - by),
            bz + k * (max(-limit, min(limit, gz)) - bz),
        )
