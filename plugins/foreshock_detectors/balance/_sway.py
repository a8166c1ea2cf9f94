"""Sway amplitude increase: completed oscillations of torso roll and lateral CoM, against their nominal amplitude."""

from __future__ import annotations

import math
import statistics
from collections import deque

from foreshock.clock import NS_PER_S
from foreshock_detectors.balance._config import BalanceConfig

__all__ = ["NominalAmplitude", "Swing"]


class Swing:
    """Peak-to-peak amplitude of the largest oscillation inside a window.

    An oscillation goes out and comes back: its amplitude is the smaller of two consecutive half swings between turning
    points, each no longer than the window. So a lean that stays where it is, however large, is no sway, and neither
    is a slow shift. A turning point is a reversal by more than `reversal`, which keeps noise from making any.

    Args:
        window_s: how long an oscillation stays in view after its end, and how long a half swing may take.
        reversal: smallest reversal that counts, in the unit of the signal.
    """

    def __init__(self, window_s: float, reversal: float) -> None:
        self._window_ns = round(window_s * NS_PER_S)
        self._reversal = reversal
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self._rising: bool | None = None
        self._low, self._high = math.inf, -math.inf
        self._extreme = self._turn = self._half = 0.0
        self._extreme_ns = self._turn_ns = 0
        self._oscillations: deque[tuple[int, float]] = deque()

    def update(self, stamp_ns: int, value: float) -> float:
        """Take one value and give the amplitude now, in the same unit; 0 where nothing came back."""
        if self._rising is None:
            self._begin(stamp_ns, value)
        elif (value > self._extreme) if self._rising else (value < self._extreme):
            self._extreme, self._extreme_ns = value, stamp_ns
        elif abs(value - self._extreme) > self._reversal:
            self._reverse(value, stamp_ns)
        return self._amplitude(stamp_ns)

    def _begin(self, stamp_ns: int, value: float) -> None:
        """The first half swing has no beginning: it sets the direction, and is too long for any window."""
        self._low, self._high = min(self._low, value), max(self._high, value)
        if self._high - self._low > self._reversal:
            self._rising = value == self._high
            self._extreme, self._extreme_ns = value, stamp_ns
            self._turn, self._turn_ns = value, stamp_ns - self._window_ns - 1

    def _reverse(self, value: float, stamp_ns: int) -> None:
        # the half swing that ends here and the one before it make an oscillation about the turning point between them
        half = self._running_half()
        if min(half, self._half) > 0.0:
            self._oscillations.append((self._extreme_ns, min(half, self._half)))
        self._half = half
        self._turn, self._turn_ns = self._extreme, self._extreme_ns
        self._extreme, self._extreme_ns = value, stamp_ns
        self._rising = not self._rising

    def _running_half(self) -> float:
        return abs(self._extreme - self._turn) if self._extreme_ns - self._turn_ns <= self._window_ns else 0.0

    def _amplitude(self, stamp_ns: int) -> float:
        oldest = stamp_ns - self._window_ns
        seen = self._oscillations
        while seen and seen[0][0] < oldest:
            seen.popleft()
        amplitude = 0.0
        for _, a in seen:
            if a > amplitude:
                amplitude = a
        if self._turn_ns >= oldest:
            amplitude = max(amplitude, min(self._half, self._running_half()))
        return amplitude


class NominalAmplitude:
    """The amplitude that is normal for this robot: the median of what was seen while learning, within limits.

    The median is robust: a disturbance shorter than half of the learning time does not move it beyond what was seen
    otherwise. The lower limit (configuration) keeps a robot that stands still from taking its first step for sway; the
    upper one, a multiple of it, keeps a robot that is shaken from the start from learning that as normal.

    Attributes:
        value: nominal peak-to-peak amplitude, in the unit of the signal.
    """

    def __init__(self, config: BalanceConfig, least: float) -> None:
        self._config = config
        self._least = least
        self._seen: list[float] = []
        self._start_ns = self._next_ns = -1
        self.value = least

    def update(self, stamp_ns: int, amplitude: float) -> None:
        """Learn from the amplitude at stamp_ns, until the learning time is over."""
        if self._start_ns < 0:
            self._start_ns = stamp_ns
        elif stamp_ns - self._start_ns > self._config.sway_learn_s * NS_PER_S:
            return
        if stamp_ns >= self._next_ns:
            # twenty per window: the amplitude changes only once per half swing
            self._next_ns = stamp_ns + round(self._config.sway_window_s * NS_PER_S / 20.0)
            self._seen.append(amplitude)
            most = self._least * self._config.sway_learn_limit
            self.value = min(most, max(self._least, statistics.median(self._seen)))
