"""high-approach-speed: do they close in faster than the distance allows?"""

from __future__ import annotations

from foreshock_detectors._sequential import Hysteresis
from foreshock_detectors.navigation._config import NavigationConfig
from foreshock_detectors.navigation._encounter import Encounter

__all__ = ["Approach"]


class Approach:
    """Closing speed against the speed at which the protective separation distance would equal the gap.

    S_p = c (T_r + T_s) + C + Z of ISO/TS 15066 with the closing speed c of both, solved for c:
    allowed(gap) = (gap - C - Z) / (T_r + T_s), no less than reduced speed and no more than walking speed (ISO 13855)
    and the robot's limit together. Only an approach that would come too near counts: one who passes far aside may be
    fast.

    Attributes:
        speed_m_s: the closing speed; 0 if both part or pass.
        allowed_m_s: what it is judged against.
    """

    def __init__(self, config: NavigationConfig) -> None:
        self._config = config
        self._time_s = config.reaction_s + config.stopping_s
        self._most = config.walking_m_s + config.speed_limit_m_s
        self._verdict = Hysteresis(1.0, 0.8, round(config.hold_s * 1e9), round(0.04 * 1e9))
        self.speed_m_s, self.allowed_m_s, self.present = 0.0, self._most, False

    def push(self, meeting: Encounter, stamp_ns: int) -> None:
        """Judge an encounter."""
        config = self._config
        near = meeting.miss_m < config.miss_m and 0.0 < meeting.time_s <= config.horizon_s
        self.speed_m_s = max(0.0, meeting.closing_m_s) if near else 0.0
        allowed = (meeting.gap_m - config.intrusion_m) / self._time_s
        self.allowed_m_s = min(self._most, max(config.least_speed_m_s, allowed))
        self.present = self._verdict.push(self.speed_m_s / self.allowed_m_s, stamp_ns)
