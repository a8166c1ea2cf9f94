"""Where one human looks: for how long away from the workspace, and for what share of the last seconds."""

from __future__ import annotations

import math
from collections import deque

from foreshock.messages import Gaze, Vec3
from foreshock_detectors._sequential import Hysteresis
from foreshock_detectors.people._config import PeopleConfig

__all__ = ["Attention"]

GAP_NS = 100_000_000
"""A longer pause between two gaze estimates is not counted, neither as looking nor as looking away."""

SHARE_RELEASE = 0.85
"""Inattentiveness is over below this share of its threshold."""


class Attention:
    """Follows one gaze stream. Time counts only while the human is in the shared space.

    Attributes:
        stamp_ns: of the last confident estimate, -1 before the first.
        angle_rad: between gaze and workspace.
        share: of the window without looking.
        diverted: verdict.
        inattentive: verdict.
    """

    def __init__(self, config: PeopleConfig) -> None:
        self._config = config
        hold_ns = round(config.hold_s * 1e9)
        self._divert = Hysteresis(config.look_limit_rad, config.look_release_rad, hold_ns, round(config.glance_s * 1e9))
        self._window_ns = round(config.attention_window_s * 1e9)
        share = config.inattentive_share
        self._neglect = Hysteresis(share, SHARE_RELEASE * share, hold_ns)
        self._seen_ns = -1
        self.stamp_ns = -1
        self._leave()

    def _leave(self) -> None:
        """He is outside the shared space: nothing is asked of him, and time starts afresh."""
        self._away: deque[tuple[int, int]] = deque()
        self._away_ns = 0
        self._was_away = False
        self._divert.restart()
        self._neglect.restart()
        self.angle_rad = self.share = 0.0
        self.diverted = self.inattentive = False

    def outside(self) -> None:
        """He is not in the shared space."""
        self._leave()
        self._seen_ns = -1

    def push(self, stamp_ns: int, gaze: Gaze, head: Vec3, centre: Vec3) -> None:
        """The next estimate; one that is not newer than the last, or not confident, is passed over."""
        if stamp_ns <= self._seen_ns or not gaze.confidence >= self._config.least_confidence:
            return
        angle = _angle(gaze.direction, (centre[0] - head[0], centre[1] - head[1], centre[2] - head[2]))
        if angle != angle:
            return
        gap_ns = stamp_ns - self._seen_ns if self._seen_ns >= 0 else 0
        self._seen_ns = self.stamp_ns = stamp_ns
        self.angle_rad = angle
        self._was_away = angle >= (self._config.look_release_rad if self._was_away else self._config.look_limit_rad)
        if self._was_away and 0 < gap_ns <= GAP_NS:
            self._away.append((stamp_ns, gap_ns))
            self._away_ns += gap_ns
        while self._away and self._away[0][0] <= stamp_ns - self._window_ns:
            self._away_ns -= self._away.popleft()[1]
        self.share = self._away_ns / self._window_ns
        self.diverted = self._divert.push(angle, stamp_ns)
        self.inattentive = self._neglect.push(self.share, stamp_ns)


def _angle(a: Vec3, b: Vec3) -> float:
    """Angle between two vectors (rad), NaN if one has no length."""
    norm = math.sqrt((a[0] * a[0] + a[1] * a[1] + a[2] * a[2]) * (b[0] * b[0] + b[1] * b[1] + b[2] * b[2]))
    if not norm > 1e-9:
        return math.nan
    c = (a[0] * b[0] + a[1] * b[1] + a[2] * b[2]) / norm
    return math.acos(c if -1.0 < c < 1.0 else math.copysign(1.0, c))
