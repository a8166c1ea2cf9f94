"""Does the tip of the tool oscillate? Band energy of its place beyond the commanded one."""

from __future__ import annotations

import math

from foreshock.messages import Odometry
from foreshock_detectors._sequential import BandEnergy, Hysteresis, RunningMedian, band_gain
from foreshock_detectors.tool._config import ToolConfig

__all__ = ["Tip"]


class Tip:
    """Band RMS R of e = p - p_commanded, over all three axes, between ``tip_low_hz`` and ``tip_high_hz``.

    A path, however winding, is taken out with its command; a steady pressing away lies below the band, the spindle's
    vibration above it. The threshold is raised to six times the band RMS of the sensor's noise if need be.

    Attributes:
        rms: R now (m).
        limit: threshold (m); NaN until the sampling period is known.
        dt: sampling period (s); 0 until it is known.
    """

    def __init__(self, config: ToolConfig) -> None:
        self._config = config
        self._period = RunningMedian(least=1e-6, start=9)
        self._bands: tuple[BandEnergy, ...] = ()
        self._hysteresis = Hysteresis(1.0, 0.7, round(config.hold_s * 1e9))
        self._stamp_ns = -1
        self.rms, self.limit, self.dt = 0.0, math.nan, 0.0

    @property
    def present(self) -> bool:
        """The verdict."""
        return self._hysteresis.present

    def push(self, stamp_ns: int, pose: Odometry, command: Odometry) -> None:
        """Take the next pose of the tip and its command; one that is not newer is passed over."""
        dt_ns = stamp_ns - self._stamp_ns
        first = self._stamp_ns < 0
        if not first and dt_ns <= 0:
            return
        self._stamp_ns = stamp_ns
        if first:
            return
        dt, period = dt_ns * 1e-9, self._period
        period.push(dt)
        if not period.ready:
            return
        if not (self._bands and 0.8 < period.value / self.dt < 1.25):
            self._tune(period.value)
        elif dt > 10.0 * period.value:
            for band in self._bands:
                band.restart()
        (x, y, z), p, c = self._bands, pose.position, command.position
        a, b, d = x.push(p[0] - c[0]), y.push(p[1] - c[1]), z.push(p[2] - c[2])
        self.rms = math.sqrt(a * a + b * b + d * d)
        self._hysteresis.push(self.rms / self.limit, stamp_ns)

    def _tune(self, dt: float) -> None:
        c = self._config
        band = (c.tip_low_hz, c.tip_high_hz, 1.0 / dt)
        self.dt = dt
        self._bands = tuple(BandEnergy(*band, c.tip_window_s) for _ in range(3))
        self.limit = max(c.tip_rms_m, 6.0 * c.place_noise_m * math.sqrt(3.0 * band_gain(*band)))
