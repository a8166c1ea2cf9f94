"""Confidence of one track: its level, and how fast it falls.

Level: exponential filter of time constant tau. Fall: CUSUM of the decrements of the median of five values,

    G <- max(0, G + (c_before - c) - k dt)        = max over t' <= t of  c(t') - c(t) - k (t - t')

so that G is the largest fall in excess of a tolerated rate k (Page, 1954). The median of five passes over dips of one
or two frames. A fall counts at G >= max(drop, n sigma), sigma the robust scatter from frame to frame: where confidence
flickers anyway, it must fall further.
"""

from __future__ import annotations

import math

from foreshock_detectors._sequential import RunningMedian
from foreshock_detectors.vision._config import VisionConfig

__all__ = ["Confidence"]

SIGMA_PER_STEP = 1.0 / (0.6745 * math.sqrt(2.0))
"""Standard deviation of white noise over the median absolute difference of successive values: 1 / (0.6745 sqrt 2)."""

LEAST_STEP = 0.002
"""Median absolute difference of a confidence without noise."""

FRAMES = 15
"""A fall is judged from here on: before, it is not known how much the confidence scatters."""


class Confidence:
    """Level and fall of one confidence.

    Attributes:
        level: filtered.
        fall: G.
        limit: what G is judged against.
    """

    __slots__ = ("_config", "_last", "_middle", "_step", "_values", "fall", "level", "limit")

    def __init__(self, config: VisionConfig, confidence: float) -> None:
        self._config = config
        self.level = self._middle = self._last = confidence
        self._values = [confidence] * 5
        self._step = RunningMedian(LEAST_STEP, start=FRAMES)
        self.fall, self.limit = 0.0, config.collapse_drop

    def push(self, confidence: float, dt: float) -> None:
        """Take the next confidence, dt (s) after the last."""
        config, step, values = self._config, self._step, self._values
        self.level += dt / (config.confidence_time_constant_s + dt) * (confidence - self.level)
        step.push(abs(confidence - self._last))
        self._last = confidence
        values.pop(0)
        values.append(confidence)
        middle, before = sorted(values)[2], self._middle
        self._middle = middle
        if not step.ready:
            return
        wanted = config.collapse_noise * SIGMA_PER_STEP * step.value
        self.limit = wanted if wanted > config.collapse_drop else config.collapse_drop
        fall, most = self.fall + before - middle - config.collapse_slowest_per_s * dt, 3.0 * self.limit
        self.fall = 0.0 if fall < 0.0 else fall if fall < most else most
