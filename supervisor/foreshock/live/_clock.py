"""The offset of a source's clock, from when it says it measured and when that arrives here."""

from __future__ import annotations

from collections import deque

__all__ = ["DRIFT_PPM", "ClockOffset"]

BUCKET_NS = 250_000_000
DRIFT_PPM = 1_000
"""No clock is believed to lose more than 1 ms a second; quartz loses 0.1 ms, and what NTP slews 0.5 ms."""


class ClockOffset:
    """Estimates offset = arrival - source stamp as the least seen lately: the fastest transport is the truest.

    What remains is the fastest transport's own time, which nothing at one end can tell from an offset; it makes samples
    look younger by that much (0.1 to 0.3 ms on one machine).

    A delay that grows must not pass for an offset: samples would look fresh however old they are. So the offset rises
    by what a clock can drift and no more: at time t

        offset <= min over all samples i of gap_i + DRIFT_PPM * 1e-6 * (t - t_i),    gap_i = arrival_i - stamp_i

    and what comes later than that counts as age. It stays age, where the delay came at once or a clock was set back,
    until it has been absorbed at that rate (1 s in 1,000 s) or its sender begins again, with an estimate of its own:
    one end cannot tell the two, and a stream that is called stale is the safe error. A delay that grows by less than
    DRIFT_PPM passes for drift.

    A clock set forward by more than max_skew_s is not believed at all until it has been steady for window_s: a single
    wrong stamp must not make all others look old. In the first window_s everything is believed, and a wrong stamp ahead
    does make all later ones look old.

    Args:
        max_skew_s: how far a stamp may be ahead of the estimate.
        window_s: memory, in steps of 0.25 s.

    Attributes:
        offset_ns: the estimate; None before the first sample.
        delay_ns: by how much the least gap seen lately exceeds it: what counts as age of every sample.
        jumps: how often a clock set forward was believed.
    """

    def __init__(self, max_skew_s: float, window_s: float = 2.0) -> None:
        self._skew_ns = round(max_skew_s * 1e9)
        self._window_ns = round(window_s * 1e9)
        self._buckets: deque[tuple[int, int]] = deque()
        self._ahead_ns = self._first_ns = self._last_ns = -1
        self._most_ns = 0
        self.offset_ns: int | None = None
        self.delay_ns = 0
        self.jumps = 0

    def take(self, stamp_ns: int, arrival_ns: int) -> int | None:
        """The sample's source time on this machine's clock; None while its clock is not believed."""
        gap, before = arrival_ns - stamp_ns, self.offset_ns
        if self._first_ns < 0:
            self._first_ns, self._last_ns, self._most_ns = arrival_ns, arrival_ns, gap
        learning = arrival_ns - self._first_ns < self._window_ns
        if before is not None and not learning and gap < before - self._skew_ns:
            if self._ahead_ns < 0:
                self._ahead_ns = arrival_ns
            if arrival_ns - self._ahead_ns < self._window_ns:
                return None
            self._buckets.clear()
        else:
            self._ahead_ns = -1
        lately = self._learn(gap, arrival_ns)
        drifted = (arrival_ns - self._last_ns) * DRIFT_PPM // 1_000_000
        self._most_ns, self._last_ns = min(self._most_ns + drifted, gap), arrival_ns
        offset = min(lately, self._most_ns)
        if before is not None and not learning and before - offset > self._skew_ns:
            self.jumps += 1
        self.offset_ns, self.delay_ns = offset, lately - offset
        return stamp_ns + offset

    def _learn(self, gap: int, arrival_ns: int) -> int:
        bucket = arrival_ns // BUCKET_NS
        if self._buckets and self._buckets[-1][0] == bucket:
            self._buckets[-1] = (bucket, min(gap, self._buckets[-1][1]))
        else:
            self._buckets.append((bucket, gap))
        oldest = (arrival_ns - self._window_ns) // BUCKET_NS
        while self._buckets[0][0] < oldest:
            self._buckets.popleft()
        return min(g for _, g in self._buckets)
