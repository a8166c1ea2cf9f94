"""Is the wrist that holds an object unstable? Band energy of its angular rate beyond the commanded one."""

from __future__ import annotations

import math

from foreshock_detectors._sequential import BandEnergy, Hysteresis, RunningMedian, band_gain
from foreshock_detectors.load._config import LoadConfig

__all__ = ["Wrist"]


class Wrist:
    """Band RMS of the angular rate e = omega - omega_commanded, over all three axes.

        R = sqrt(R_x^2 + R_y^2 + R_z^2),   R_i the RMS of e_i between ``wrist_low_hz`` and ``wrist_high_hz``

    A commanded rotation, however fast, is taken out, and what its tracking leaves lies below the band. The sensor's
    own noise must stay well below the threshold: it is raised to six times the noise's band RMS if need be, so that
    noise alone (chi-square with 3 * 2 * bandwidth * window > 40 degrees of freedom) never reaches it.

    Attributes:
        rms: R now (rad/s).
        limit: threshold (rad/s); NaN until the sampling period is known.
    """

    def __init__(self, config: LoadConfig) -> None:
        self._config = config
        self._period = RunningMedian(least=1e-6, start=9)
        self._bands: tuple[BandEnergy, ...] = ()
        self._rate_hz = 0.0
        self._hysteresis = Hysteresis(1.0, 0.7, round(config.hold_s * 1e9), round(config.wrist_dwell_s * 1e9))
        self._stamp_ns = -1
        self.rms, self.limit = 0.0, math.nan

    @property
    def ready(self) -> bool:
        """Whether the sampling period is known."""
        return bool(self._bands)

    @property
    def present(self) -> bool:
        """The verdict."""
        return self._hysteresis.present

    def push(self, stamp_ns: int, rate: tuple[float, float, float], wanted: tuple[float, float, float]) -> None:
        """Take the next measured and the commanded angular rate (rad/s); one that is not newer is passed over."""
        dt_ns = stamp_ns - self._stamp_ns
        first = self._stamp_ns < 0
        if not first and dt_ns <= 0:
            return
        self._stamp_ns = stamp_ns
        if first:
            return
        dt = dt_ns * 1e-9
        period = self._period
        period.push(dt)
        if not period.ready:
            return
        if not (self._bands and 0.8 < period.value * self._rate_hz < 1.25):
            self._tune(1.0 / period.value)
        elif dt > 10.0 * period.value:
            for band in self._bands:
                band.restart()
        x, y, z = self._bands
        a, b, c = x.push(rate[0] - wanted[0]), y.push(rate[1] - wanted[1]), z.push(rate[2] - wanted[2])
        self.rms = math.sqrt(a * a + b * b + c * c)
        self._hysteresis.push(self.rms / self.limit, stamp_ns)

    def _tune(self, rate_hz: float) -> None:
        c = self._config
        band = (min(c.wrist_low_hz, 0.2 * rate_hz), c.wrist_high_hz, rate_hz)
        self._rate_hz = rate_hz
        self._bands = tuple(BandEnergy(*band, c.wrist_window_s) for _ in range(3))
        self.limit = max(c.wrist_rms_rad_s, 6.0 * c.gyro_noise_rad_s * math.sqrt(3.0 * band_gain(*band)))
