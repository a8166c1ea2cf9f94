"""Capture point, ZMP and their margins to the support, at one instant and with the little history that ZMP needs."""

from __future__ import annotations

import math

from foreshock.clock import NS_PER_S
from foreshock.messages import Vec3
from foreshock_detectors.balance._config import BalanceConfig
from foreshock_detectors.balance._kinematics import BodyState
from foreshock_detectors.balance._lipm import capture_time_s, natural_frequency, time_to_fall_s
from foreshock_detectors.balance._polygon import Polygon, convex_hull, nearest_boundary_point, signed_margin
from foreshock_detectors.balance._signals import weight
from foreshock_detectors.balance._support import SoleRectangle
from foreshock_detectors.balance._zmp import zmp_from_momentum, zmp_from_wrenches

__all__ = ["FootContact", "Stability"]

FootContact = tuple[bool, Vec3, Vec3]
"""Whether the sole is loaded, force (N) and torque (N m) of the ground on it, in its frame."""

LEAST_HEIGHT_M = 0.1
"""Below this height of the CoM above the soles the robot lies, and the inverted pendulum says nothing."""


class Stability:
    """Computes the measures of com-lateral-deviation and the predicted time to fall.

    Attributes:
        measures: by name with unit, in odom axes; only what could be computed.
        capture_margin_m: of the capture point to the hull of both soles; None where the robot lies.
        time_to_fall_s: predicted, or None.
    """

    def __init__(self, config: BalanceConfig, mass_kg: float) -> None:
        self._config = config
        self._mass_kg = mass_kg
        self._sole = SoleRectangle(config)
        self._last: BodyState | None = None
        self._rate: list[float] | None = None
        self._rate_ns = 0
        self._zmp: tuple[float, float] | None = None
        self.measures: dict[str, float] = {}
        self.capture_margin_m: float | None = None
        self.time_to_fall_s: float | None = None

    def update(self, body: BodyState, feet: tuple[FootContact, FootContact] | None) -> None:
        """Take a body state, later than the one before, with both feet's contacts (left, right) or None if unknown."""
        left, right = self._sole.corners(body.left), self._sole.corners(body.right)
        both = convex_hull(left + right)
        measures = {"com_x_m": body.com[0], "com_y_m": body.com[1]}
        support: Polygon | None = None
        ground_z = min(body.left.z, body.right.z)
        if feet is not None:
            on_left, on_right = feet[0][0], feet[1][0]
            if on_left and on_right:
                support, ground_z = both, 0.5 * (body.left.z + body.right.z)
            elif on_left:
                support, ground_z = left, body.left.z
            elif on_right:
                support, ground_z = right, body.right.z
        if support is not None:
            ys = [y for _, y in support]
            measures["support_min_y_m"], measures["support_max_y_m"] = min(ys), max(ys)
            measures["com_margin_m"] = signed_margin(support, body.com[0], body.com[1])
        self._pendulum(body, both, support, ground_z, measures)
        self._differentiate(body)
        if feet is not None:
            self._pressure(body, feet, support, ground_z, measures)
        else:
            self._zmp = None
        self._last = body
        self.measures = measures

    def _pendulum(
        self, body: BodyState, both: Polygon, support: Polygon | None, ground_z: float, measures: dict[str, float]
    ) -> None:
        config = self._config
        self.capture_margin_m = self.time_to_fall_s = None
        height = body.com[2] - ground_z
        if height < LEAST_HEIGHT_M:
            return
        w0 = natural_frequency(height, config.gravity_m_s2)
        com, velocity = body.com[:2], body.velocity[:2]
        x, y = com[0] + velocity[0] / w0, com[1] + velocity[1] / w0
        measures["capture_point_x_m"], measures["capture_point_y_m"] = x, y
        margin = self.capture_margin_m = measures["capture_point_margin_m"] = signed_margin(both, x, y)
        if margin < 0.0:
            fall = time_to_fall_s(
                both, support or both, com, velocity, w0, config.capture_tolerance_m, config.fall_horizon_s
            )
            if fall is not None:
                self.time_to_fall_s = measures["time_to_fall_s"] = fall
        if support is None:
            return
        now = margin if support is both else signed_margin(support, x, y)
        measures["capture_point_support_margin_m"] = now
        if now < 0.0 < margin:
            lost = _time_to_capture_loss_s(support, both, (x, y), w0)
            if lost < config.fall_horizon_s:
                measures["time_to_capture_loss_s"] = lost

    def _differentiate(self, body: BodyState) -> None:
        """Rate of the centroidal momentum: filtered differences of h(q, v).

        That is h' = A(q) v' + A'(q, v) v without forming v' for every joint, with six filters instead of nv.
        """
        last = self._last
        dt = (body.stamp_ns - last.stamp_ns) / NS_PER_S if last is not None else math.inf
        if last is None or dt > self._config.gap_s:
            self._rate, self._rate_ns = None, body.stamp_ns
            return
        pairs, rate = zip(last.momentum, body.momentum, strict=True), self._rate
        if rate is None:
            self._rate = [(b - a) / dt for a, b in pairs]
            return
        k = weight(dt, self._config.acceleration_filter_s)
        self._rate = [r + k * ((b - a) / dt - r) for r, (a, b) in zip(rate, pairs, strict=True)]

    def _pressure(
        self,
        body: BodyState,
        feet: tuple[FootContact, FootContact],
        support: Polygon | None,
        ground_z: float,
        measures: dict[str, float],
    ) -> None:
        config = self._config
        contacts = ((body.left, *feet[0][1:]), (body.right, *feet[1][1:]))
        zmp = zmp_from_wrenches(contacts, ground_z, config.contact_on_n)
        if zmp is None:
            self._zmp = None
            return
        measures["zmp_x_m"], measures["zmp_y_m"] = zmp
        if support is not None:
            measures["zmp_margin_m"] = signed_margin(support, zmp[0], zmp[1])
        rate = self._rate
        if rate is None or self._last is None:
            self._zmp = zmp
            return
        # the rate lags by its filter, so the wrenches are given the same lag before the two are compared
        if self._zmp is not None:
            k = weight((body.stamp_ns - self._last.stamp_ns) / NS_PER_S, config.acceleration_filter_s)
            zx, zy = self._zmp
            zmp = (zx + k * (zmp[0] - zx), zy + k * (zmp[1] - zy))
        self._zmp = zmp
        force, moment = (rate[0], rate[1], rate[2]), (rate[3], rate[4], rate[5])
        if body.stamp_ns - self._rate_ns < 3.0 * config.acceleration_filter_s * NS_PER_S:
            return  # the filter still remembers its first, raw difference
        motion = zmp_from_momentum(body.com, force, moment, self._mass_kg, config.gravity_m_s2, ground_z)
        if motion is not None:
            measures["zmp_disagreement_m"] = math.hypot(motion[0] - zmp[0], motion[1] - zmp[1])


def _time_to_capture_loss_s(support: Polygon, both: Polygon, capture: tuple[float, float], w0: float) -> float:
    """Time (s) until the capture point leaves the hull of both soles, if the free foot is not set down before.

    The centre of pressure rests at the point p of the present support that is nearest to the capture point, which then
    runs straight away from p: its distance grows as exp(w0 t) until the ray from p meets the hull's boundary.
    """
    px, py = nearest_boundary_point(support, *capture)
    ux, uy = capture[0] - px, capture[1] - py
    start = math.hypot(ux, uy)
    ux, uy = ux / start, uy / start
    reach = math.inf
    ax, ay = both[-1]
    for bx, by in both:
        outward = (by - ay) * ux - (bx - ax) * uy
        if outward > 0.0:
            reach = min(reach, ((by - ay) * (ax - px) - (bx - ax) * (ay - py)) / outward)
        ax, ay = bx, by
    return capture_time_s(start, 0.0, reach, w0)
