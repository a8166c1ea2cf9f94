"""When load changes hands on purpose: the look-alike of a slip."""

from __future__ import annotations

import math

from foreshock_detectors.grip._config import GripConfig

__all__ = ["Transfer"]

FAST_S = 0.02
SLOW_S = 0.12
"""Time constants (s) of two running means; their difference is the rate times 0.1 s, and less noisy than either."""

NEAR_WEIGHT = 0.3
"""Weight of a new sample in the mean that losses are measured by: some six samples, 0.42 of the noise."""

LOST_SIGMA = 5.0
"""A rising load that falls this many standard deviations below its highest value is not picked up but swings."""

RISING_N = 0.1
"""Difference (N) that counts as rising load: 1 N/s, some 5 standard deviations of the difference."""


class Transfer:
    """Follows the commanded force and the load; says when the filters must allow for fast, wanted changes.

    Attributes:
        commanded: the command moves or has just moved, either way: the normal force will follow.
        released: the command falls or has just fallen: the load may be taken by somebody else (a handover).
        loading: the load rises or has just risen; its end must not look like a loss.
        rising: loading, and nothing of the load was lost again since: a pick-up, not a load that swings.
    """

    __slots__ = (
        "_began_ns", "_fast", "_highest", "_level", "_max_ns", "_moved_ns", "_near", "_peak", "_released_ns",
        "_rose_ns", "_settle_ns", "_slow", "_step_n", "commanded", "loading", "released", "rising",
    )  # fmt: skip

    def __init__(self, config: GripConfig) -> None:
        self._step_n = config.command_step_n
        self._settle_ns = round(config.transfer_settle_s * 1e9)
        self._max_ns = round(config.transfer_max_s * 1e9)
        self.restart(0, 0.0, 0.0)

    def restart(self, stamp_ns: int, command_n: float, load_n: float) -> None:
        """A new grasp: load and grip force settle, as after a command."""
        self._level = self._peak = command_n
        self._moved_ns = self._rose_ns = self._began_ns = stamp_ns
        self._released_ns = stamp_ns - self._settle_ns
        self._fast = self._slow = self._near = self._highest = load_n
        self.rising = True
        self.commanded, self.released, self.loading = True, False, True

    def push(self, stamp_ns: int, dt: float, command_n: float, load_n: float, noise_n: float) -> None:
        """Take the next command and load (N), dt (s) after the last; noise_n is the deviation of one load (N)."""
        if abs(command_n - self._level) > self._step_n:
            if not self.commanded:
                self._began_ns = stamp_ns
            self._level, self._moved_ns = command_n, stamp_ns
        if command_n > self._peak:
            self._peak = command_n
        elif command_n < self._peak - self._step_n:
            self._peak, self._released_ns = command_n, stamp_ns
        settle = self._settle_ns
        self.commanded = stamp_ns - self._moved_ns < settle
        # A command that never rests would otherwise excuse everything: an unstable force loop is no handover.
        self.released = stamp_ns - self._released_ns < settle and stamp_ns - self._began_ns < self._max_ns

        self._near += NEAR_WEIGHT * (load_n - self._near)
        self._fast += (1.0 - math.exp(-dt / FAST_S)) * (load_n - self._fast)
        self._slow += (1.0 - math.exp(-dt / SLOW_S)) * (load_n - self._slow)
        if self._fast - self._slow > RISING_N:
            self.rises(stamp_ns)
        self.loading = stamp_ns - self._rose_ns < settle
        if not self.loading:
            self.rising = False
        elif self._near > self._highest:
            self._highest = self._near
        elif self._highest - self._near > LOST_SIGMA * noise_n:
            self.rising = False

    def rises(self, stamp_ns: int) -> None:
        """Note that the load rises at this time."""
        if not self.loading:
            self._highest, self.loading, self.rising = self._near, True, True
        self._rose_ns = stamp_ns

    def excused(self, stamp_ns: int) -> bool:
        """Whether the command has moved lately, and not for too long."""
        return self.commanded and stamp_ns - self._began_ns < self._max_ns
