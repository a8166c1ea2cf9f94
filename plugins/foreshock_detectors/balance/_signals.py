"""Small signal pieces that work at any, also varying, sample period."""

from __future__ import annotations

__all__ = ["Hysteresis", "ramp", "weight"]


def weight(dt_s: float, time_constant_s: float) -> float:
    """Share of the new value in a first-order low pass, dt / (dt + T) (backward Euler): stable for every dt."""
    return dt_s / (dt_s + time_constant_s)


def ramp(value: float, low: float, high: float) -> float:
    """0 at low, 1 at high, linear between."""
    return min(1.0, max(0.0, (value - low) / (high - low)))


class Hysteresis:
    """Present above a threshold, absent again below a share of it."""

    __slots__ = ("_ratio", "present")

    def __init__(self, ratio: float) -> None:
        self._ratio = ratio
        self.present = False

    def judge(self, statistic: float, threshold: float) -> bool:
        """The verdict; a statistic that is not a number raises ValueError rather than count as absent."""
        if statistic > threshold:
            self.present = True
        elif statistic < self._ratio * threshold:
            self.present = False
        elif statistic != statistic:  # the cheapest test for NaN
            raise ValueError("statistic is not a number")
        return self.present
