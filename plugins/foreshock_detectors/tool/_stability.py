"""Is the tool held stably? Normalised innovation squared of the wrist's torque against what the process explains."""

from __future__ import annotations

from collections import deque

from foreshock.messages import Vec3
from foreshock_detectors._sequential import Hysteresis, chi2_quantile
from foreshock_detectors.tool._config import ToolConfig

__all__ = ["Stability"]


class Stability:
    """Normalised innovation squared of the torque, summed over the last n samples.

        NIS = sum over axes of r_i^2 / sigma_i^2,  r = measured - expected,  sigma_i^2 = noise^2 + (error expected_i)^2

    chi-square with 3 n degrees of freedom while the model holds. The threshold is its quantile at one false alarm in
    ``false_alarm_s`` if every sample were a test of its own; overlapping windows make alarms rarer than that. One
    sample counts at most a third of the threshold, so that no two spikes raise it.

    Attributes:
        statistic: sum over its threshold.
    """

    def __init__(self, config: ToolConfig, dt: float) -> None:
        self._config = config
        tail = min(0.5, dt / config.false_alarm_s)
        self._threshold = chi2_quantile(tail, 3 * config.nis_samples)
        self._most = self._threshold / 3.0
        self._last: deque[float] = deque(maxlen=config.nis_samples)
        self._hysteresis = Hysteresis(1.0, 0.5, round(config.hold_s * 1e9))
        self._stamp_ns = -1
        self.statistic = 0.0

    @property
    def ready(self) -> bool:
        """Whether the window is full."""
        return len(self._last) == self._config.nis_samples

    @property
    def present(self) -> bool:
        """The verdict."""
        return self._hysteresis.present

    def push(self, stamp_ns: int, measured: Vec3, expected: Vec3) -> None:
        """Take the next pair of torques (N m); one that is not newer is passed over."""
        if stamp_ns <= self._stamp_ns:
            return
        self._stamp_ns = stamp_ns
        noise, error = self._config.torque_noise_n_m, self._config.torque_error
        nis = 0.0
        for m, e in zip(measured, expected, strict=True):
            nis += (m - e) * (m - e) / (noise * noise + error * error * e * e)
        self._last.append(nis if nis < self._most else self._most)
        if self.ready:
            self.statistic = sum(self._last) / self._threshold
            self._hysteresis.push(self.statistic, stamp_ns)
