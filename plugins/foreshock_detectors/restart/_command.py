"""What was commanded lately: speed, acceleration, and whether motion was permitted."""

from __future__ import annotations

from collections import deque

from foreshock.messages import MotionCommand
from foreshock_detectors.restart._config import RestartConfig

__all__ = ["Commands"]


class Commands:
    """Keeps the commands of the last while.

    Attributes:
        stamp_ns: of the newest command, -1 before the first.
        stop_ns: when the stop that stands now was first asked for, -1 if none is.
    """

    def __init__(self, config: RestartConfig) -> None:
        self._lag_ns = round(config.command_lag_s * 1e9)
        self._slope_ns = round(config.slope_s * 1e9)
        self._keep_ns = self._lag_ns + 2 * self._slope_ns + 200_000_000
        self._least = config.standstill_m_s
        self._track: deque[tuple[int, bool, float, float]] = deque()
        self.stamp_ns = self.stop_ns = -1

    def push(self, stamp_ns: int, command: MotionCommand) -> None:
        """The next command; one that is not newer than the last is passed over."""
        if stamp_ns <= self.stamp_ns:
            return
        self.stamp_ns = stamp_ns
        if not command.stop_requested:
            self.stop_ns = -1
        elif self.stop_ns < 0:
            self.stop_ns = stamp_ns
        permitted = command.enabled and not command.stop_requested
        speed = command.speed if permitted and command.speed > 0.0 else 0.0
        track = self._track
        acceleration = 0.0
        for t, _, v, _ in reversed(track):
            if stamp_ns - t >= self._slope_ns:
                acceleration = (speed - v) / ((stamp_ns - t) * 1e-9)
                break
        track.append((stamp_ns, permitted and speed > 0.0, speed, acceleration))
        while track[0][0] < stamp_ns - self._keep_ns:
            track.popleft()

    def before(self, stamp_ns: int) -> tuple[bool, float, float]:
        """In the lag until then: whether a motion was permitted and asked for, the most speed and acceleration."""
        asked, speed, acceleration = False, 0.0, 0.0
        first_ns = stamp_ns - self._lag_ns
        for t, permitted, v, a in reversed(self._track):
            if t > stamp_ns:
                continue
            if permitted:
                asked = True
                if v > speed:
                    speed = v
                if a > acceleration:
                    acceleration = a
            if t < first_ns:  # the command that stood when the lag began counts as well
                break
        return asked, speed, acceleration
