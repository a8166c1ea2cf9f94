"""The protective separation distance S_p of ISO/TS 15066:2016, 5.5.4.2.3, each term apart."""

from __future__ import annotations

import msgspec

from foreshock_detectors.proximity._config import ProximityConfig

__all__ = ["ProtectiveSeparation", "protective_separation"]


class ProtectiveSeparation(msgspec.Struct, frozen=True):
    """S_p = S_h + S_r + S_s + C + Z_d + Z_r + S_f, in m. All but S_f are the standard's.

    Attributes:
        s_h_m: S_h = v_h (T_r + T_s + what the measurement is older than it was extrapolated over).
        s_r_m: S_r = v_r (T_r + age of the robot's state), before the robot begins to brake.
        s_s_m: S_s = share * v_r T_s, while it brakes.
        c_m: C, how far a part of the body gets into the sensed space before it is seen.
        z_d_m: Z_d, uncertainty of the human's position.
        z_r_m: Z_r, uncertainty of the robot's.
        s_f_m: S_f, by how much a fall towards the human shortens the separation; 0 where it does not count.
    """

    s_h_m: float
    s_r_m: float
    s_s_m: float
    c_m: float
    z_d_m: float
    z_r_m: float
    s_f_m: float

    @property
    def s_p_m(self) -> float:
        """The sum."""
        return self.s_h_m + self.s_r_m + self.s_s_m + self.c_m + self.z_d_m + self.z_r_m + self.s_f_m


def protective_separation(
    config: ProximityConfig,
    *,
    distance_m: float,
    human_speed_m_s: float | None,
    human_age_s: float,
    robot_speed_m_s: float,
    robot_age_s: float,
    uncertainty_m: float,
    fall_clearance_m: float | None,
) -> ProtectiveSeparation:
    """S_p for one pair of a robot part and a human.

    Args:
        config: T_r, T_s and the constant terms.
        distance_m: present separation d.
        human_speed_m_s: measured v_h; its whole magnitude, for a person turns within T_r. None if it is not measured:
            1.6 m/s beyond 0.5 m of separation, 2.0 m/s nearer.
        human_age_s: age of the position used for the human, after extrapolation.
        robot_speed_m_s: v_r, of the robot's fastest part towards the human; negative counts as 0.
        robot_age_s: age of the robot's state.
        uncertainty_m: Z_d as the tracker states it.
        fall_clearance_m: separation between the human and all that a falling robot can reach (negative inside);
            S_f = d - this. None for a robot that cannot fall.
    """
    if human_speed_m_s is None:
        v_h = config.v_h_near_m_s if distance_m <= config.near_m else config.v_h_far_m_s
    else:
        v_h = max(human_speed_m_s, config.v_h_least_m_s)
    v_r = max(robot_speed_m_s, 0.0)
    return ProtectiveSeparation(
        v_h * (config.reaction_s + config.stopping_s + human_age_s),
        v_r * (config.reaction_s + robot_age_s),
        v_r * config.stopping_speed_ratio * config.stopping_s,
        config.c_m,
        max(config.z_d_m, uncertainty_m),
        config.z_r_m,
        0.0 if fall_clearance_m is None else max(0.0, distance_m - fall_clearance_m),
    )
