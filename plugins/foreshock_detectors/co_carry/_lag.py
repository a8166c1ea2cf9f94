"""The lag between two swings, from the band of a gait."""

from __future__ import annotations

import math

from foreshock_detectors._sequential import Biquad, RunningMedian
from foreshock_detectors.co_carry._config import CoCarryConfig

__all__ = ["Lag"]

GAP = 10.0
"""So many periods without a sample restart the averages."""

SETTLED = 4.0
"""Averages count once they are so many time constants old."""


class Lag:
    """Phase of b against a, both filtered to the band, by exponentially weighted averages <.>.

    For a = A cos(w t), b = B cos(w t + phi) and their rates a', b':

        <a b> = A B / 2 cos(phi),   (<a' b> - <a b'>) / (2 w) = A B / 2 sin(phi),   w^4 = <a'^2> <b'^2> / <a^2> <b^2>

    Both pass the same filters, so that these change no lag. The coherence is the length of that vector over
    sqrt(<a^2> <b^2>): 1 for two sines of one frequency, near 0 for unrelated ones.

    Attributes:
        angle_rad: of b ahead of a, -pi..pi.
        coherence: 0..1.
        swing_a: RMS of a in the band.
        swing_b: RMS of b in the band.
        observed: the averages have settled.
    """

    __slots__ = (
        "_aa", "_ab", "_bb", "_before", "_cross", "_filters", "_high_hz", "_low_hz", "_period", "_raa", "_rbb",
        "_samples", "_settled", "_stamp_ns", "_tau_s", "_weight", "angle_rad", "coherence", "dt", "observed", "swing_a",
        "swing_b",
    )  # fmt: skip

    def __init__(self, config: CoCarryConfig) -> None:
        self._low_hz, self._high_hz, self._tau_s = config.low_hz, config.high_hz, config.phase_time_constant_s
        self._period = RunningMedian(least=1e-6, start=9)
        self._stamp_ns, self.dt = -1, 0.0
        self._restart()

    def _restart(self) -> None:
        """Forget the swings; build the filters once the sampling period is known."""
        self._aa = self._bb = self._ab = self._cross = self._raa = self._rbb = 0.0
        self._before: tuple[float, float] | None = None
        self._samples, self.observed = 0, False
        self.angle_rad = self.coherence = self.swing_a = self.swing_b = 0.0
        if self.dt > 0.0:
            rate, high = 1.0 / self.dt, min(self._high_hz, 0.4 / self.dt)
            self._filters = tuple((Biquad("high", self._low_hz, rate), Biquad("low", high, rate)) for _ in range(2))
            self._weight = 1.0 - math.exp(-self.dt / self._tau_s)
            self._settled = math.ceil(SETTLED * self._tau_s / self.dt)

    def push(self, stamp_ns: int, a: float, b: float) -> None:
        """Take the next pair; one that is not newer than the last is passed over."""
        dt = (stamp_ns - self._stamp_ns) * 1e-9
        if self._stamp_ns >= 0 and dt <= 0.0:
            return
        first, self._stamp_ns = self._stamp_ns < 0, stamp_ns
        if first:
            return
        self._period.push(dt)
        period = self._period.value
        if not self._period.ready:
            return
        if not (0.8 * self.dt < period < 1.25 * self.dt):
            self.dt = period
            self._restart()
        elif dt > GAP * period:
            self._restart()
        (high_a, low_a), (high_b, low_b) = self._filters
        a, b = low_a.push(high_a.push(a)), low_b.push(high_b.push(b))
        if self._before is not None:
            self._average(a, b, (a - self._before[0]) / self.dt, (b - self._before[1]) / self.dt)
        self._before = (a, b)

    def _average(self, a: float, b: float, rate_a: float, rate_b: float) -> None:
        """The rates belong to the middle of two samples, and so do the values that meet them."""
        before = self._before or (a, b)
        middle_a, middle_b, w = 0.5 * (a + before[0]), 0.5 * (b + before[1]), self._weight
        self._aa += w * (middle_a * middle_a - self._aa)
        self._bb += w * (middle_b * middle_b - self._bb)
        self._ab += w * (middle_a * middle_b - self._ab)
        self._cross += w * (rate_a * middle_b - middle_a * rate_b - self._cross)
        self._raa += w * (rate_a * rate_a - self._raa)
        self._rbb += w * (rate_b * rate_b - self._rbb)
        self._samples += 1
        self.observed = self._samples >= self._settled
        power = math.sqrt(self._aa * self._bb)
        self.swing_a, self.swing_b = math.sqrt(self._aa), math.sqrt(self._bb)
        if power > 0.0:
            omega = math.sqrt(math.sqrt(self._raa * self._rbb) / power)
            sine = self._cross / (2.0 * omega) if omega > 0.0 else 0.0
            self.angle_rad = math.atan2(sine, self._ab)
            self.coherence = min(1.0, math.hypot(sine, self._ab) / power)
