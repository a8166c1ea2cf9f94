"""Sequential tests that detectors share: CUSUM, windowed NIS, band energy, a running median, hysteresis.

Each test is a small mutable object: ``push`` takes the next number, ``restart`` forgets. Nothing here reads a clock,
draws random numbers or imports more than the standard library. Innovations are *normalised*, z = nu / sqrt(S), which is
white N(0, 1) while the filter's model holds; what departs from that is what the tests look for.
"""

from __future__ import annotations

import math
from collections import deque

__all__ = [
    "BandEnergy",
    "Biquad",
    "Cusum",
    "EventWindow",
    "Hysteresis",
    "RunningMedian",
    "WindowedNis",
    "band_gain",
    "chi2_quantile",
    "chi2_tail",
    "cusum_threshold",
    "severity",
    "siegmund_arl",
]

OVERSHOOT = 1.166
"""2 * 0.583: mean overshoot of a Gaussian random walk at both boundaries (Siegmund, 1985, chapter 10)."""


def severity(statistic: float, threshold: float, full: float) -> float:
    """0 at threshold, 1 at full and beyond, linear between; NaN counts as 1."""
    share = (statistic - threshold) / (full - threshold)
    return 0.0 if share <= 0.0 else share if share < 1.0 else 1.0


def siegmund_arl(threshold: float, reference: float, shift: float = 0.0) -> float:
    """Average run length (samples) of a one-sided CUSUM on N(shift, 1) increments.

    ARL = (exp(-2 d b) + 2 d b - 1) / (2 d^2) with d = shift - reference, b = threshold + 1.166, and b^2 for d = 0.

    Args:
        threshold: decision limit h, in standard deviations.
        reference: reference value k, half the shift that is to be found soonest.
        shift: true mean of the increments; 0 gives the run length between false alarms.

    Source: Siegmund (1985), Sequential Analysis; Montgomery, Introduction to Statistical Quality Control, eq. 9.6.
    """
    b, d = threshold + OVERSHOOT, shift - reference
    if abs(d) < 1e-9:
        return b * b
    return (math.exp(-2.0 * d * b) + 2.0 * d * b - 1.0) / (2.0 * d * d)


def cusum_threshold(arl: float, reference: float) -> float:
    """Decision limit h at which a one-sided CUSUM raises one false alarm in arl samples on average.

    Inverts :func:`siegmund_arl` by bisection. The approximation wants h of at least 1, so no less is returned.
    """
    low, high = 1.0, 2.0
    while siegmund_arl(high, reference) < arl:
        low, high = high, 2.0 * high
    for _ in range(60):
        middle = 0.5 * (low + high)
        if siegmund_arl(middle, reference) < arl:
            low = middle
        else:
            high = middle
    return high


class Cusum:
    """One-sided CUSUM (Page, 1954): G <- max(0, G + z - k), alarm when G >= h.

    Args:
        reference: k, in standard deviations of z.
        threshold: h, in the same unit; see :func:`cusum_threshold`.
        clip: |z| is cut here, so that one outlier alone cannot raise the alarm if clip - k < h. On N(0, 1) a clip of 4
            or more changes the run length by less than the approximation's own error.
    """

    __slots__ = ("clip", "reference", "threshold", "value")

    def __init__(self, reference: float, threshold: float, clip: float = math.inf) -> None:
        self.reference, self.threshold, self.clip = reference, threshold, clip
        self.restart()

    def restart(self) -> None:
        """Forget what was accumulated."""
        self.value = 0.0

    def push(self, z: float) -> bool:
        """Whether the alarm is raised by z; a NaN raises it. The caller restarts it after an alarm."""
        if z > self.clip:
            z = self.clip
        value = self.value + z - self.reference
        if value <= 0.0:
            value = 0.0
        self.value = value
        return not (value < self.threshold)


def chi2_tail(x: float, dof: int) -> float:
    """P(chi-square with dof degrees of freedom > x), for even dof: exp(-x/2) sum_{j < dof/2} (x/2)^j / j! (exact).

    Raises:
        ValueError: dof is odd or not positive.
    """
    if dof < 2 or dof % 2:
        raise ValueError(f"dof must be even and positive, not {dof}")
    term = total = math.exp(-0.5 * x)
    for j in range(1, dof // 2):
        term *= 0.5 * x / j
        total += term
    return total


def chi2_quantile(tail: float, dof: int) -> float:
    """The x with P(chi-square > x) = tail, for even dof, by bisection."""
    low, high = 0.0, float(dof)
    while chi2_tail(high, dof) > tail:
        high *= 2.0
    for _ in range(80):
        middle = 0.5 * (low + high)
        if chi2_tail(middle, dof) > tail:
            low = middle
        else:
            high = middle
    return high


class WindowedNis:
    """Is the scatter of innovations larger than the filter expects, in two blocks in a row?

    Per block of n samples, V = sum (z - mean z)^2 / (n - 1), so that (n - 1) V is chi-square with n - 1 degrees of
    freedom. The mean is taken out so that a drift, which CUSUM finds, is not also scatter. The statistic is the
    smaller V of the last two blocks: a single step lies in one block and stays silent. Blocks do not overlap, so that
    the false alarm rate follows: one in n / p^2 samples, p the tail of one block.

    Args:
        arl: samples between false alarms, on average.
        block: n, odd, so that the chi-square tail has a closed form.
        least: the threshold is no less than this; 4 is twice the nominal standard deviation.
    """

    __slots__ = ("_count", "_last", "_mean", "_squares", "block", "threshold", "value")

    def __init__(self, arl: float, block: int = 25, least: float = 1.0) -> None:
        self.block = block
        tail = math.sqrt(block / arl) if arl > block else 1.0
        self.threshold = max(least, chi2_quantile(tail, block - 1) / (block - 1))
        self.restart()

    def restart(self) -> None:
        """Forget all blocks."""
        self.value = self._last = 0.0
        self._count, self._mean, self._squares = 0, 0.0, 0.0

    def push(self, z: float) -> bool:
        """Whether the last two full blocks both scatter too much; a NaN counts as too much."""
        self._count = count = self._count + 1
        delta = z - self._mean  # Welford's recursion: no cancellation when a drift is large
        self._mean += delta / count
        self._squares += delta * (z - self._mean)
        if count == self.block:
            scatter = self._squares / (count - 1)
            self.value, self._last = (self._last if scatter > self._last else scatter), scatter
            self._count, self._mean, self._squares = 0, 0.0, 0.0
        return not (self.value < self.threshold)


class Biquad:
    """Second-order Butterworth section by the bilinear transform with prewarping, direct form II transposed.

    Args:
        kind: ``low`` or ``high`` pass.
        corner_hz: frequency where the power gain is one half, in (0, rate_hz / 2).
        rate_hz: sampling rate.
    """

    __slots__ = ("_a1", "_a2", "_b0", "_b1", "_s1", "_s2")

    def __init__(self, kind: str, corner_hz: float, rate_hz: float) -> None:
        k = math.tan(math.pi * corner_hz / rate_hz)
        norm = 1.0 / (1.0 + math.sqrt(2.0) * k + k * k)
        if kind == "low":
            self._b0, self._b1 = k * k * norm, 2.0 * k * k * norm
        else:
            self._b0, self._b1 = norm, -2.0 * norm
        self._a1, self._a2 = 2.0 * (k * k - 1.0) * norm, (1.0 - math.sqrt(2.0) * k + k * k) * norm
        self.restart()

    def restart(self) -> None:
        """Back to rest."""
        self._s1 = self._s2 = 0.0

    def push(self, x: float) -> float:
        """The next output."""
        y = self._b0 * x + self._s1
        self._s1 = self._b1 * x - self._a1 * y + self._s2
        self._s2 = self._b0 * x - self._a2 * y
        return y


class BandEnergy:
    """Root mean square of a signal inside a frequency band, over an exponential window.

    The signal is taken relative to its first value, so that starting at 20 N is no step of 20 N, and as the median of
    three values, so that one electrical spike is no oscillation (a sine at a tenth of the rate loses 5 % by it).

    Args:
        low_hz: lower corner.
        high_hz: upper corner; lowered to 0.4 rate_hz if the rate is too low for it.
        rate_hz: sampling rate.
        window_s: time constant of the mean square.
    """

    __slots__ = ("_before", "_high", "_last", "_low", "_mean_square", "_origin", "_weight")

    def __init__(self, low_hz: float, high_hz: float, rate_hz: float, window_s: float) -> None:
        self._high = Biquad("high", low_hz, rate_hz)
        self._low = Biquad("low", min(high_hz, 0.4 * rate_hz), rate_hz)
        self._weight = 1.0 - math.exp(-1.0 / (rate_hz * window_s))
        self.restart()

    def restart(self) -> None:
        """Back to rest; the next value is the new origin."""
        self._high.restart()
        self._low.restart()
        self._mean_square, self._origin, self._before, self._last = 0.0, math.nan, 0.0, 0.0

    def push(self, x: float) -> float:
        """Band RMS up to and including x, in the unit of x."""
        if self._origin != self._origin:
            self._origin = self._before = self._last = x
        a, b = self._before, self._last
        self._before, self._last = b, x
        if a > b:
            a, b = b, a
        middle = a if x < a else b if x > b else x
        band = self._low.push(self._high.push(middle - self._origin))
        self._mean_square += self._weight * (band * band - self._mean_square)
        return math.sqrt(self._mean_square)


def band_gain(low_hz: float, high_hz: float, rate_hz: float) -> float:
    """Output over input variance of :class:`BandEnergy`'s filter for white noise: the sum of h_k^2 (Parseval)."""
    high, low = Biquad("high", low_hz, rate_hz), Biquad("low", min(high_hz, 0.4 * rate_hz), rate_hz)
    responses = (low.push(high.push(1.0 if k == 0 else 0.0)) for k in range(math.ceil(3.0 * rate_hz / low_hz)))
    return math.fsum(h * h for h in responses)


class RunningMedian:
    """Median and median absolute deviation of a stream in O(1), by stochastic approximation (Robbins and Monro, 1951).

    The first ``start`` values give both exactly; then m moves by +-gain * MAD and the MAD by +-gain of itself towards
    each value, so that one outlier moves neither by more than one step.

    Args:
        least: the MAD is no less than this; in the unit of the values.
        gain: relative step; the memory is some 1 / gain values.
        start: how many values are collected first.
    """

    __slots__ = ("_first", "_gain", "_least", "_start", "mad", "ready", "value")

    def __init__(self, least: float, gain: float = 0.02, start: int = 31) -> None:
        self._least, self._gain, self._start = least, gain, start
        self.restart()

    def restart(self) -> None:
        """Forget all values."""
        self._first: list[float] = []
        self.value, self.mad, self.ready = math.nan, math.nan, False

    def push(self, x: float) -> None:
        """Take the next value."""
        if self.ready:
            delta, mad = x - self.value, self.mad
            step = self._gain * mad
            if delta > 0.0:
                self.value += step
            elif delta < 0.0:
                self.value -= step
                delta = -delta
            if delta > mad:
                self.mad = mad + step
            elif mad - step > self._least:
                self.mad = mad - step
            else:
                self.mad = self._least
            return
        self._first.append(x)
        if len(self._first) == self._start:
            self.value = _median(self._first)
            self.mad = max(self._least, _median([abs(v - self.value) for v in self._first]))
            self.ready, self._first = True, []


def _median(values: list[float]) -> float:
    """Middle value (the upper one of two)."""
    return sorted(values)[len(values) // 2]


class Hysteresis:
    """Present at once at or above ``on``; absent after the statistic has stayed below ``off`` for ``hold_ns``.

    Args:
        on: threshold of presence.
        off: threshold of absence, at most on.
        hold_ns: how long it must stay below off.
        dwell_ns: how long it must stay at or above on before it counts; 0 is at once.
    """

    __slots__ = ("_above_ns", "_over_ns", "dwell_ns", "hold_ns", "off", "on", "present")

    def __init__(self, on: float, off: float, hold_ns: int, dwell_ns: int = 0) -> None:
        self.on, self.off, self.hold_ns, self.dwell_ns = on, off, hold_ns, dwell_ns
        self.restart()

    def restart(self) -> None:
        """Absent, with nothing seen."""
        self.present, self._above_ns, self._over_ns = False, -1, -1

    def push(self, statistic: float, stamp_ns: int) -> bool:
        """The verdict at stamp_ns; NaN counts as above every threshold."""
        if not (statistic < self.on):
            if self._over_ns < 0:
                self._over_ns = stamp_ns
            if stamp_ns - self._over_ns >= self.dwell_ns:
                self.present = True
        else:
            self._over_ns = -1
        if not (statistic < self.off):
            self._above_ns = stamp_ns
        elif self.present and stamp_ns - self._above_ns >= self.hold_ns:
            self.present = False
        return self.present


class EventWindow:
    """How many events happened in the last ``span_ns``."""

    __slots__ = ("_events", "span_ns")

    def __init__(self, span_ns: int) -> None:
        self.span_ns = span_ns
        self._events: deque[int] = deque(maxlen=1000)

    def restart(self) -> None:
        """Forget all events."""
        self._events.clear()

    def add(self, stamp_ns: int) -> None:
        """An event at stamp_ns."""
        self._events.append(stamp_ns)

    def count(self, now_ns: int) -> int:
        """Events in (now_ns - span_ns, now_ns]."""
        events = self._events
        while events and events[0] <= now_ns - self.span_ns:
            events.popleft()
        return len(events)
