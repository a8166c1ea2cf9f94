"""A verdict that stands for a while after its reason has gone, with the worst number of that time."""

from __future__ import annotations

from foreshock.records import Indication, SampleRef
from foreshock_detectors._sequential import severity

__all__ = ["Held"]


class Held:
    """One kind's verdict.

    Args:
        kind: taxonomy id.
        unit: of the statistic.
        threshold: what it is judged against.
        full: statistic at which severity is 1.
        hold_ns: how long the verdict stands without its reason.
    """

    __slots__ = ("_hold_ns", "_last_ns", "_peak", "full", "kind", "present", "statistic", "threshold", "unit")

    def __init__(self, kind: str, unit: str, threshold: float, full: float, hold_ns: int) -> None:
        self.kind, self.unit, self.threshold, self.full = kind, unit, threshold, full
        self._hold_ns, self._last_ns, self._peak = hold_ns, -1, 0.0
        self.present, self.statistic = False, 0.0

    def push(self, statistic: float, stamp_ns: int, reason: bool) -> None:
        """The statistic now, and whether it is a reason for the verdict."""
        self.statistic = statistic
        if reason:
            self._last_ns = stamp_ns
            self._peak = statistic if not self.present or statistic > self._peak else self._peak
            self.present = True
        elif self.present and stamp_ns - self._last_ns >= self._hold_ns:
            self.present = False

    def indication(self, subject: str, stamp_ns: int, seen: tuple[SampleRef, ...]) -> Indication:
        """What is said now; while it is held, its peak stands for the statistic."""
        if self.present:
            worst = severity(self._peak, self.threshold, max(self.full, 1.01 * self.threshold))
            return Indication(self.kind, subject, stamp_ns, True, self._peak, self.threshold, self.unit, worst, seen)
        return Indication(self.kind, subject, stamp_ns, False, self.statistic, self.threshold, self.unit, 0.0, seen)
