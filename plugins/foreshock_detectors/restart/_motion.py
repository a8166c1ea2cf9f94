"""The measured motion: how fast, how it accelerates, whether it rests, and when it started from rest."""

from __future__ import annotations

from collections import deque

from foreshock_detectors.restart._config import RestartConfig

__all__ = ["Motion"]


class Motion:
    """Follows the speed sample by sample.

    Attributes:
        stamp_ns: of the last sample, -1 before the first.
        speed: its magnitude (m/s).
        acceleration: least squares slope of the speed over the last slope_s (m/s^2), 0 until that is full.
        standing: the last sample is below the standstill speed; at a turning point so is one, too.
        resting: it has stood for rest_s and has not started since.
        started: the last sample is the one that made a start certain.
        start_ns: stamp of the first sample of the last start from rest, -1 before the first.
    """

    def __init__(self, config: RestartConfig) -> None:
        self._still, self._moves = config.standstill_m_s, config.start_m_s
        self._rest_ns = round(config.rest_s * 1e9)
        self._slope_ns = round(config.slope_s * 1e9) + 1000
        self._track: deque[tuple[int, float]] = deque()
        self._still_ns = self._moving_ns = -1
        self.stamp_ns, self.speed, self.acceleration = -1, 0.0, 0.0
        self.standing = self.resting = self.started = False
        self.start_ns = -1

    def push(self, stamp_ns: int, speed: float) -> None:
        """The next speed (m/s)."""
        self.stamp_ns, self.speed = stamp_ns, speed
        self.started = False
        self.standing = speed < self._still
        if self.standing:
            if self._still_ns < 0:
                self._still_ns = stamp_ns
            if stamp_ns - self._still_ns >= self._rest_ns:
                self.resting = True
        else:
            self._still_ns = -1
        if speed < self._moves:
            self._moving_ns = -1
        elif self._moving_ns < 0:
            self._moving_ns = stamp_ns
        elif self.resting:
            self.resting, self.started, self.start_ns = False, True, self._moving_ns
        track = self._track
        track.append((stamp_ns, speed))
        while track[0][0] < stamp_ns - self._slope_ns:
            track.popleft()
        self.acceleration = self._slope()

    def _slope(self) -> float:
        track, n = self._track, len(self._track)
        if n < 3:
            return 0.0
        t0 = track[0][0]
        st = sx = stt = stx = 0.0
        for t, x in track:
            u = (t - t0) * 1e-9
            st += u
            sx += x
            stt += u * u
            stx += u * x
        return (n * stx - st * sx) / (n * stt - st * st)
