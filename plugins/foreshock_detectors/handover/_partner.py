"""What is seen of the partner: a pull on the object, and a hand that has arrived at it."""

from __future__ import annotations

import math

from foreshock.messages import Humans, WrenchStamped
from foreshock_detectors._sequential import Hysteresis
from foreshock_detectors.handover._config import HandoverConfig

__all__ = ["Partner"]


class Partner:
    """Follows pull and hand.

    Attributes:
        pull_n: newest force along the axis (N).
        pulled_ns: since when the partner pulls, by the stamp of the first sample above the threshold; -1 not at all.
        arrived: a hand is at the object.
    """

    def __init__(self, config: HandoverConfig) -> None:
        length = math.hypot(*config.axis)
        self._axis = tuple(a / length for a in config.axis)
        self._point, self._reach = config.point, config.reach_m
        self._pull = Hysteresis(
            config.pull_n, config.pull_release_n, round(config.pull_hold_s * 1e9), round(config.pull_dwell_s * 1e9)
        )
        self._threshold = config.pull_n
        self._above_ns = -1
        self.pull_n, self.pulled_ns, self.arrived = 0.0, -1, False

    def feel(self, stamp_ns: int, wrench: WrenchStamped) -> None:
        """Take the next wrench."""
        (fx, fy, fz), (ax, ay, az) = wrench.force, self._axis
        self.pull_n = pull = ax * fx + ay * fy + az * fz
        if pull < self._threshold:
            self._above_ns = -1
        elif self._above_ns < 0:
            self._above_ns = stamp_ns
        if not self._pull.push(pull, stamp_ns):
            self.pulled_ns = -1
        elif self.pulled_ns < 0:
            self.pulled_ns = self._above_ns if self._above_ns >= 0 else stamp_ns

    def see(self, humans: Humans) -> None:
        """Take the newest humans."""
        self.arrived = any(
            math.dist([(p + q) / 2.0 for p, q in zip(c.a, c.b, strict=True)], self._point) <= self._reach
            for human in humans.humans
            for c in human.capsules
            if c.region == "hand"
        )
