"""Starts and stops against the plan: how far they are off, in seconds."""

from __future__ import annotations

from foreshock.messages import TaskPhase
from foreshock_detectors.restart._config import RestartConfig
from foreshock_detectors.restart._motion import Motion

__all__ = ["Timing"]


class Timing:
    """Follows the plan's phases; :meth:`judge` compares the motion with them.

    Attributes:
        stamp_ns: of the newest phase message, -1 before the first.
        mismatch_s: of the start or stop that is off now, 0 if none is.
    """

    def __init__(self, config: RestartConfig) -> None:
        self._still = frozenset(config.still_phases)
        self._stopping_s, self._start_lag_s = config.stopping_s, config.start_lag_s
        self._phase, self._since_ns, self._due_ns = -1, -1, -1
        self._met = True
        self.stamp_ns = -1
        self.mismatch_s = 0.0

    def push(self, stamp_ns: int, phase: TaskPhase) -> None:
        """The next message; one that is not newer than the last is passed over."""
        if stamp_ns <= self.stamp_ns:
            return
        if phase.phase != self._phase:
            # The first phase seen may have begun long ago, and one kind of phase may follow itself: nothing is due.
            same = self._phase >= 0 and (phase.phase in self._still) == (self._phase in self._still)
            self._met = self._phase < 0 or (same and self._met)
            self._phase, self._since_ns = phase.phase, stamp_ns
        self.stamp_ns = stamp_ns
        self._due_ns = stamp_ns + round(phase.due_s * 1e9)

    def judge(self, motion: Motion) -> float:
        """How far the motion is off the plan now (s)."""
        now_ns = motion.stamp_ns
        if now_ns < self._since_ns:
            return 0.0
        elapsed_s = (now_ns - self._since_ns) * 1e-9
        off = 0.0
        if self._phase in self._still:
            if motion.resting:
                self._met = True
            elif not self._met:
                off = 0.0 if motion.standing else elapsed_s - self._stopping_s
            elif motion.started:
                off = (self._due_ns - motion.start_ns) * 1e-9
        elif not motion.resting:
            self._met = True
        elif not self._met:
            off = elapsed_s - self._start_lag_s
        self.mismatch_s = off if off > 0.0 else 0.0
        return self.mismatch_s
