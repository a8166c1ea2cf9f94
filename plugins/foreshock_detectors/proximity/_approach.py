"""The verdicts on one human, with their memory: hysteresis and the closing speed."""

from __future__ import annotations

from foreshock.records import Indication, SampleRef
from foreshock_detectors.proximity._closing import ClosingSpeed
from foreshock_detectors.proximity._config import ProximityConfig
from foreshock_detectors.proximity._nearest import Nearest

__all__ = ["Approach"]

HORIZON_RELEASE = 1.25
"""narrowing-clearance is withdrawn only when S_p is farther off than this many horizons."""


class Approach:
    """One human's approach: take() what was measured, then ask for the two indications."""

    def __init__(self, config: ProximityConfig) -> None:
        self._config = config
        self._closing = ClosingSpeed(config.closing_window_s)
        self._measured_ns = -1
        self._breach = False
        self._narrowing = False
        self._nearest: Nearest
        self._fastest_m_s = 0.0

    def take(self, measured_ns: int, at_ns: int, nearest: Nearest, human_speed_m_s: float | None) -> None:
        """The state now.

        Args:
            measured_ns: stamp of the human's position; a new one gives the closing speed its next sample.
            at_ns: instant that his position was extrapolated to.
            nearest: how near he is.
            human_speed_m_s: his measured speed, if it is.
        """
        config = self._config
        self._nearest = nearest
        if measured_ns > self._measured_ns:
            self._measured_ns = measured_ns
            self._closing.push(at_ns, nearest.distance_m)
        d, s_p = nearest.distance_m, nearest.separation.s_p_m
        self._breach = d < s_p + (config.hysteresis_m if self._breach else 0.0)
        v_h = config.v_h_near_m_s if human_speed_m_s is None else human_speed_m_s
        self._fastest_m_s = v_h + max(nearest.robot_speed_m_s, 0.0)
        closing = self._closing.value_m_s
        if closing is not None:
            ratio, horizons = (config.closing_release_ratio, HORIZON_RELEASE) if self._narrowing else (1.0, 1.0)
            self._narrowing = closing >= config.closing_m_s * ratio and d - s_p <= closing * config.horizon_s * horizons

    def breach(self, kind: str, subject: str, stamp_ns: int, evidence: tuple[SampleRef, ...]) -> Indication:
        """Whether d < S_p."""
        nearest, s = self._nearest, self._nearest.separation
        d, s_p, closing = nearest.distance_m, s.s_p_m, self._closing.value_m_s
        measures = {
            "s_h_m": s.s_h_m,
            "s_r_m": s.s_r_m,
            "s_s_m": s.s_s_m,
            "c_m": s.c_m,
            "z_d_m": s.z_d_m,
            "z_r_m": s.z_r_m,
            "s_f_m": s.s_f_m,
            "s_p_m": s_p,
            "distance_m": d,
            "robot_speed_m_s": nearest.robot_speed_m_s,
            "part_speed_m_s": nearest.part_speed_m_s,
        }
        if closing is not None:
            measures["closing_speed_m_s"] = closing
        severity = min(max((s_p - d) / s_p, 0.0), 1.0) if self._breach and s_p > 0.0 else 0.0
        if d <= 0.0:
            severity = 1.0
        return Indication(
            kind, subject, stamp_ns, self._breach, d, s_p, "m", severity, evidence, self._contact_s(), measures
        )

    def narrowing(self, kind: str, subject: str, stamp_ns: int, evidence: tuple[SampleRef, ...]) -> Indication | None:
        """Whether he comes nearer and S_p is near in time; None where that cannot be said yet."""
        config, nearest = self._config, self._nearest
        d, s_p, closing = nearest.distance_m, nearest.separation.s_p_m, self._closing.value_m_s
        measures = {"distance_m": d, "s_p_m": s_p}
        if closing is None:
            if d - s_p <= self._fastest_m_s * config.horizon_s:
                return None
            closing = self._fastest_m_s
            measures["upper_bound"] = 1.0
        if closing > 1e-6:
            measures["time_to_s_p_s"] = max(d - s_p, 0.0) / closing
        span = config.severe_closing_m_s - config.closing_m_s
        severity = min(max((closing - config.closing_m_s) / span, 0.0), 1.0) if self._narrowing else 0.0
        time_s = self._contact_s() if self._narrowing else None
        return Indication(
            kind,
            subject,
            stamp_ns,
            self._narrowing,
            closing,
            config.closing_m_s,
            "m/s",
            severity,
            evidence,
            time_s,
            measures,
        )

    def _contact_s(self) -> float | None:
        """Time to contact at the present closing speed; None unless he comes nearer."""
        d, closing = self._nearest.distance_m, self._closing.value_m_s
        if d <= 0.0:
            return 0.0
        if closing is None or closing < self._config.closing_m_s:
            return None
        return d / closing
