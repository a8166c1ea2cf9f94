"""The robot's share of a known load, averaged over the gait, against the agreed one."""

from __future__ import annotations

import math

from foreshock_detectors.co_carry._config import CoCarryConfig

__all__ = ["G", "Share"]

G = 9.80665
"""Standard gravity (m/s^2), CGPM 1901."""

SETTLED = 4.0
"""The filters count once they are so many time constants old: 0.09 of what they began with is left."""


class Share:
    """Follows the share's deviation through two filters of first order, so that a planned transfer is none.

    Attributes:
        value: share of the load's weight that the robot carries.
        deviation: value less the agreed share, both filtered.
        observed: the filters have settled.
    """

    __slots__ = (
        "_first", "_second", "_since_ns", "_stamp_ns", "_tau_ns", "_third", "_weight_n", "deviation", "observed",
        "value",
    )  # fmt: skip

    def __init__(self, config: CoCarryConfig) -> None:
        self._weight_n = config.load_kg * G
        self._tau_ns = config.share_time_constant_s * 1e9
        self._stamp_ns = self._since_ns = -1
        self._first = self._second = self._third = math.nan
        self.value, self.deviation, self.observed = 0.0, 0.0, False

    def push(self, stamp_ns: int, carried_n: float, agreed: float) -> None:
        """Take the next force that the hand carries (N), with the share that is agreed now."""
        deviation = carried_n / self._weight_n - agreed
        dt = stamp_ns - self._stamp_ns
        if self._stamp_ns < 0 or dt > self._tau_ns:
            self._first = self._second = deviation
            self._third = agreed
            self._since_ns = stamp_ns
        elif dt <= 0:
            return
        else:
            weight = 1.0 - math.exp(-dt / self._tau_ns)
            self._first += weight * (deviation - self._first)
            self._second += weight * (self._first - self._second)
            self._third += weight * (agreed - self._third)
        self._stamp_ns = stamp_ns
        self.deviation, self.value = self._second, self._second + self._third
        self.observed = stamp_ns - self._since_ns >= SETTLED * self._tau_ns
