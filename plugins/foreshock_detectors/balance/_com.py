"""CoM lateral deviation relative to the feet."""

from __future__ import annotations

from foreshock.clock import NS_PER_S
from foreshock_detectors.balance._config import BalanceConfig
from foreshock_detectors.balance._kinematics import BodyState
from foreshock_detectors.balance._signals import Hysteresis, weight

__all__ = ["ComDeviation"]


class ComDeviation:
    """How far the centre of mass stands beside the place where it should be, left positive.

        offset = y axis of the base footprint . (c - midpoint of the soles)
        deviation = offset - planned offset

    The plan is MotionPlan.com; without one the running nominal takes its place: a slow average of the offset that
    starts in the middle of the feet and learns from no offset beyond the threshold. Then half of the nominal sway
    is added to the threshold, because sway that the robot intends is not known to be so.

    Attributes:
        offset_m: lateral place of the centre of mass relative to the midpoint of the soles.
        deviation_m: the signed statistic.
        threshold_m: what its magnitude is judged against.
    """

    def __init__(self, config: BalanceConfig) -> None:
        self._config = config
        self._hysteresis = Hysteresis(config.release_ratio)
        self._nominal_m = 0.0
        self._stamp_ns = -1
        self.offset_m = self.deviation_m = 0.0
        self.threshold_m = config.com_deviation_m

    @property
    def present(self) -> bool:
        """The verdict."""
        return self._hysteresis.present

    def update(self, body: BodyState, planned_m: float | None, nominal_sway_m: float) -> None:
        """Judge a body state, given the planned lateral offset (m) or None, and the peak-to-peak sway (m) without."""
        config = self._config
        c, s = body.heading
        dx = body.com[0] - 0.5 * (body.left.x + body.right.x)
        dy = body.com[1] - 0.5 * (body.left.y + body.right.y)
        self.offset_m = offset = c * dy - s * dx
        if self._stamp_ns >= 0:
            dt = min(config.gap_s, (body.stamp_ns - self._stamp_ns) / NS_PER_S)
            limit = self.threshold_m
            bounded = max(-limit, min(limit, offset))
            self._nominal_m += weight(dt, config.com_nominal_s) * (bounded - self._nominal_m)
        self._stamp_ns = body.stamp_ns
        if planned_m is None:
            self.deviation_m = offset - self._nominal_m
            self.threshold_m = config.com_deviation_m + 0.5 * nominal_sway_m
        else:
            self.deviation_m = offset - planned_m
            self.threshold_m = config.com_deviation_m
        self._hysteresis.judge(abs(self.deviation_m), self.threshold_m)
