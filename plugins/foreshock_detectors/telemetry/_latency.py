"""Latency of one stream: is one message late (a spike), are they late on average (a delay)?"""

from __future__ import annotations

from foreshock_detectors._sequential import RunningMedian
from foreshock_detectors.telemetry._config import TelemetryConfig

__all__ = ["Latency"]

SIGMA_PER_MAD = 1.4826
"""Standard deviation over median absolute deviation of a normal distribution: 1 / Phi^-1(3/4)."""

LEAST_MAD_S = 1e-4
"""A stream without jitter (a simulation) has no scale of its own; 0.1 ms is a scheduler's granularity."""

CLIP = 4.0
"""One message adds at most four budgets to the mean: at 200 Hz a single one moves it by 4 % of the budget."""


class Latency:
    """Running median and mean of a latency.

    Attributes:
        mean_s: exponential mean of the latency, each value cut at four budgets (s).
        limit_s: what the last value was judged against (s).
    """

    __slots__ = ("_budget_s", "_clip_s", "_floor_s", "_k", "_last_ns", "_median", "_tau_ns", "limit_s", "mean_s")

    def __init__(self, config: TelemetryConfig) -> None:
        self._median = RunningMedian(LEAST_MAD_S)
        self._k = config.spike_deviations * SIGMA_PER_MAD
        self._floor_s, self._clip_s = config.spike_floor_s, CLIP * config.delay_budget_s
        self._tau_ns = config.delay_time_constant_s * 1e9
        self.mean_s, self.limit_s, self._last_ns = 0.0, config.spike_floor_s, -1

    def push(self, latency_s: float, arrived_ns: int) -> bool:
        """Whether this latency is a spike."""
        median = self._median
        limit = self._floor_s
        if median.ready and median.value + self._k * median.mad > limit:
            limit = median.value + self._k * median.mad
        self.limit_s = limit
        median.push(latency_s)
        # dt / (tau + dt) is 1 - exp(-dt / tau) to first order, and below 1 for any dt. A first value counts like one
        # that comes a tenth of tau after a latency of zero.
        dt = arrived_ns - self._last_ns if self._last_ns >= 0 else 0.1 * self._tau_ns
        self._last_ns = arrived_ns
        if dt > 0:
            cut = latency_s if latency_s < self._clip_s else self._clip_s
            self.mean_s += dt / (self._tau_ns + dt) * (cut - self.mean_s)
        return latency_s > limit
