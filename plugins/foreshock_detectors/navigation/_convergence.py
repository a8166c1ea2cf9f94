"""path-convergence: is the predicted miss distance surely too small, and do both close in?"""

from __future__ import annotations

import math

from foreshock_detectors._sequential import Cusum, Hysteresis, cusum_threshold
from foreshock_detectors.navigation._config import NavigationConfig
from foreshock_detectors.navigation._encounter import Encounter

__all__ = ["Convergence"]

REFERENCE = 0.5
"""k of the CUSUM: it finds soonest a miss distance that lies one standard deviation below the limit."""

CLIP = 3.0
"""Largest evidence of one value, either way: five of them are needed."""


class Convergence:
    """CUSUM on z = (limit - miss) / sd(miss), sd^2 = s0^2 + (sv t*)^2, one value per memory of the velocity filter.

    While nobody closes in, or closest approach lies beyond the horizon, z = -CLIP: the evidence is given up. The
    verdict stands while the CUSUM is above half its limit.
    """

    def __init__(self, config: NavigationConfig) -> None:
        self._config = config
        arl = config.false_alarm_s / config.cusum_period_s
        limit = cusum_threshold(arl, REFERENCE)
        self._cusum = Cusum(REFERENCE, limit, CLIP)
        self._verdict = Hysteresis(1.0, 0.5, round(config.hold_s * 1e9))
        self._period_ns = round(config.cusum_period_s * 1e9)
        self._due_ns = -1
        self.present = False
        self.statistic = 0.0

    def push(self, meeting: Encounter, stamp_ns: int) -> None:
        """Judge an encounter; the statistic is the CUSUM over its limit."""
        config, cusum = self._config, self._cusum
        if stamp_ns >= self._due_ns:
            self._due_ns = stamp_ns + self._period_ns
            z = -CLIP
            if meeting.closing_m_s >= config.least_closing_m_s and 0.0 < meeting.time_s <= config.convergence_s:
                sd = math.hypot(config.miss_sd_m, config.velocity_sd_m_s * meeting.time_s)
                z = max(-CLIP, (config.miss_m - meeting.miss_m) / sd)
            cusum.push(z)
            cusum.value = min(cusum.value, 1.5 * cusum.threshold)  # what has been sure for long is given up as soon
        self.statistic = cusum.value / cusum.threshold
        self.present = self._verdict.push(self.statistic, stamp_ns)
