"""The offset of a source's clock, from when it says it measured and when that arrives here."""

from __future__ import annotations

from collections import deque

__all__ = ["ClockOffset"]

BUCKET_NS = 250_000_000


class ClockOffset:
    """Estimates offset = arrival - source stamp as the least seen lately: the fastest transport is the truest.

    What remains is the fastest transport's own time, which nothing at one end can tell from an offset; it makes samples
    look younger by that much (0.1 to 0.3 ms on one machine). A clock that is set back makes samples look old, hence
    stale, until it has been steady for window_s. One that is set forward by more than max_skew_s is not believed at all
    until then: a single wrong stamp must not make all others look old. In the first window_s everything is believed.

    Args:
        max_skew_s: how far a stamp may be ahead of the estimate.
        window_s: memory, in steps of 0.25 s.
    """

    def __init__(self, max_skew_s: float, window_s: float = 2.0) -> None:
        self._skew_ns = round(max_skew_s * 1e9)
        self._window_ns = round(window_s * 1e9)
        self._buckets: deque[tuple[int, int]] = deque()
        self._ahead_ns = self._first_ns = -1
        self.offset_ns: int | None = None
        self.jumps = 0

    def take(self, stamp_ns: int, arrival_ns: int) -> int | None:
        """The sample's source time on this machine's clock; None while its clock is not believed."""
        gap, before = arrival_ns - stamp_ns, self.offset_ns
        if self._first_ns < 0:
            self._first_ns = arrival_ns
        learning = arrival_ns - self._first_ns < self._window_ns
        if before is not None and not learning and gap < before - self._skew_ns:
            if self._ahead_ns < 0:
                self._ahead_ns = arrival_ns
            if arrival_ns - self._ahead_ns < self._window_ns:
                return None
            self._buckets.clear()
        else:
            self._ahead_ns = -1
        offset = self._learn(gap, arrival_ns)
        if before is not None and not learning and abs(offset - before) > self._skew_ns:
            self.jumps += 1
        self.offset_ns = offset
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
