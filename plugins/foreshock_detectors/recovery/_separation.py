"""Distance of a hand to people, and the protective separation distance that its speed asks for."""

from __future__ import annotations

import math

from foreshock.messages import HumanPose, Odometry, Vec3
from foreshock_detectors.recovery._config import RecoveryConfig

__all__ = ["distance_to", "protective_separation"]


def distance_to(point: Vec3, human: HumanPose) -> float:
    """From a point to the surface of the nearest capsule (m); negative inside."""
    px, py, pz = point
    nearest = math.inf
    for capsule in human.capsules:
        ax, ay, az = capsule.a
        bx, by, bz = capsule.b
        ux, uy, uz, dx, dy, dz = bx - ax, by - ay, bz - az, px - ax, py - ay, pz - az
        along = dx * ux + dy * uy + dz * uz
        if along > 0.0:
            square = ux * ux + uy * uy + uz * uz
            share = along / square if along < square else 1.0
            dx, dy, dz = dx - share * ux, dy - share * uy, dz - share * uz
        separation = math.sqrt(dx * dx + dy * dy + dz * dz) - capsule.radius
        if separation < nearest:
            nearest = separation
    return nearest


def protective_separation(config: RecoveryConfig, hand: Odometry, human: HumanPose) -> float:
    """S_p = v_h (T_r + T_s) + v_r T_r + share v_r T_s + C + Z_d + Z_r (ISO/TS 15066:2016, 5.5.4.2.3), in m.

    v_r is the whole magnitude of the hand's speed, not its part towards the human: an arm that swings to save the
    balance is not on a planned path and swings back (where the direction cannot be relied on, the standard takes the
    maximum). v_h likewise, for a person turns within T_r.
    """
    v_r = math.hypot(*hand.linear)
    v_h = config.v_h_m_s if human.velocity is None else math.hypot(*human.velocity)
    braking = config.stopping_speed_ratio * config.stopping_s
    s_p = v_h * (config.reaction_s + config.stopping_s) + v_r * (config.reaction_s + braking)
    return s_p + config.c_m + max(config.z_d_m, human.uncertainty) + config.z_r_m
