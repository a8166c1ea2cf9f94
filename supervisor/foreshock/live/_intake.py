"""Takes samples from the rings of all streams, so that one that floods makes no other wait.

Deficit round robin (Shreedhar and Varghese 1996, doi 10.1109/90.502236): in turn, each stream spends what it has been
credited, and what one sample costs beyond that it pays back in later turns. What is not taken waits in the stream's
ring, where the oldest is lost first. A tick spends half a period at most on taking samples, one sample excepted.
"""

from __future__ import annotations

from collections.abc import Sequence

from foreshock.clock import thread_cpu_ns
from foreshock.live._stream import Stream
from foreshock.records import Sample

__all__ = ["Intake"]

CREDIT_NS = 100_000
EACH_NS, BYTE_NS = 20_000, 20
"""What a sample costs beside its decoding, in journal and digest: measured, and rounded up."""
MOST_OWED = 4
"""Ticks that may go by without a sample: one that is costly must not make all others stale."""


class Intake:
    """Shares the time for decoding among streams.

    Args:
        streams: to take from.
        period_ns: of the ticks.
    """

    def __init__(self, streams: Sequence[Stream], period_ns: int) -> None:
        self._streams = list(streams)
        self._budget_ns = self._left_ns = period_ns // 2
        self._spent_ns = 0
        self._credit = [0] * len(self._streams)

    def drain(self, now_ns: int) -> list[Sample]:
        """Samples that arrived, as far as there is time for them; of each stream in order."""
        found: list[Sample] = []
        owed_ns = max(min(self._left_ns, 0), -MOST_OWED * self._budget_ns)
        self._left_ns = owed_ns + self._budget_ns
        self._spent_ns = thread_cpu_ns()
        waiting = list(range(len(self._streams)))
        while waiting and self._left_ns > 0:
            waiting = [k for k in waiting if self._spend(k, now_ns, found)]
        return found

    def _spend(self, k: int, now_ns: int, found: list[Sample]) -> bool:
        """Let a stream spend its credit; whether more of it may be waiting."""
        self._credit[k] += CREDIT_NS
        while self._credit[k] > 0:
            taken = self._streams[k].take(now_ns)
            if taken is None:
                self._credit[k] = 0
                return False
            sample, size = taken
            if sample is not None:
                found.append(sample)
            spent_ns = thread_cpu_ns()
            cost_ns = spent_ns - self._spent_ns + EACH_NS + BYTE_NS * size
            self._spent_ns = spent_ns
            self._credit[k] -= cost_ns
            self._left_ns -= cost_ns
        return True
