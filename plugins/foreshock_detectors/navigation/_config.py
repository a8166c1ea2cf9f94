"""Configuration of the navigation detector."""

from __future__ import annotations

import math
from typing import TypeAlias

import msgspec

from foreshock.errors import ConfigError

__all__ = ["NavigationConfig", "Wall"]

Wall: TypeAlias = tuple[float, float, float, float]
"""x, y of both ends (m), in the frame of odometry and people."""


class NavigationConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Settings, with where each default comes from. All is judged in plan view; a human is one or several discs.

    Attributes:
        robot_radius_m: half the robot's breadth (m); of TALOS, hands hanging, about 0.3.
        limbs: further bodies for narrow-shared-space: name of ``<name>/odometry`` to its radius (m), e.g. feet.
        regions: body regions that count, a disc each; empty takes the whole human as one disc.
        walls: what bounds the room, as line segments.
        horizon_s: how far ahead crossing paths and approach are judged (s): reaction, stopping and 1 s to spare.
        convergence_s: how far ahead a miss distance is judged (s); constant velocity is as good as any model of
            walkers up to 4.8 s (Schoeller et al., 2020, What the constant velocity model can teach us).
        velocity_time_s: time constant of the filter of people's and the base's velocity (s): half a walker's step.
        uncertainty_m: a measurement whose stated uncertainty Z_d is larger (m) counts by the square of the ratio, as
            in least squares; half hidden people are placed badly.
        coast_s: somebody who is not seen any more is predicted for so long (s), then has left.
        departed_s: absence of one who has left is said for so long (s).
        miss_m: a predicted miss distance of the bodies (m) below this is convergence; 0.2 is the sway of a walker's
            shoulders at either side (Fruin, 1971: lateral spacing of 0.2 to 0.25 m beyond the body ellipse).
        velocity_sd_m_s: uncertainty of a predicted velocity (m/s): a walker changes by so much within a step.
        miss_sd_m: least uncertainty of the predicted miss distance (m).
        least_closing_m_s: slower than this (m/s) nobody converges.
        false_alarm_s: mean time between false alarms of the CUSUM on the miss distance (s), at one that is exactly
            miss_m; a walk that passes further out is judged the rarer by exp(-2 d h) (Siegmund).
        cusum_period_s: one value per this time enters the CUSUM (s): the velocity filter's memory.
        gap_s: both reach the place where their paths cross within this time of each other (s). Below 1.5 s encroachment
            of road users is a serious conflict (Hyden, 1987); walkers stop within a step, hence 1 s.
        overlap_margin_m: paths cross if they come nearer than the bodies and this (m): uncertainty of a prediction.
        overlap_dwell_s: a crossing is judged after it has stood so long (s): new plans and turning people flicker.
        walks_m_s: slower than this (m/s) a person stands, sways or shifts, and is predicted to stay where he is; a
            step of 0.3 m within a second is the slowest that carries anybody on.
        reaction_s: T_r of ISO/TS 15066 (s): sensing, deciding, next footfall.
        stopping_s: T_s of ISO/TS 15066 (s): two steps of a biped.
        intrusion_m: C + Z_d + Z_r of ISO/TS 15066 (m).
        least_speed_m_s: slower approach is never too fast (m/s): reduced speed of 250 mm/s, ISO 10218-1.
        walking_m_s: assumed walking speed of people (m/s), ISO 13855.
        speed_limit_m_s: the robot's own limit (m/s).
        free_least_m: free width that robot and human need (m): 0.5 m for a body, 0.18 m for a leg, ISO 13854.
        walled_least_m: room between robot and wall beside the human's own (m), where one stands behind him: the
            least clear width of a walkway, ISO 14122-2.
        lookahead_s: narrow space is judged along the robot's way for so long (s): reaction and stopping.
        hold_s: how long a verdict stands after its reason has gone (s).
        max_age_s: age at which odometry is stale (s).
        humans_max_age_s: age at which people are (s).
        path_max_age_s: age at which the plan is (s).

    The false alarm rate of convergence follows from its CUSUM. Of the other three kinds there is none by theory, since
    they judge what people do: 180 nominal runs of the plants gait_swing and crossing, 3 h, raised none, which bounds
    the rate at 1 per hour (95 %, Poisson).
    """

    robot_radius_m: float = 0.3
    limbs: dict[str, float] = {}
    regions: tuple[str, ...] = ()
    walls: tuple[Wall, ...] = ()
    horizon_s: float = 2.5
    convergence_s: float = 4.0
    velocity_time_s: float = 0.2
    uncertainty_m: float = 0.05
    coast_s: float = 1.5
    departed_s: float = 2.0
    miss_m: float = 0.2
    velocity_sd_m_s: float = 0.1
    miss_sd_m: float = 0.1
    least_closing_m_s: float = 0.2
    false_alarm_s: float = 36_000.0
    cusum_period_s: float = 0.1
    gap_s: float = 1.0
    overlap_margin_m: float = 0.1
    overlap_dwell_s: float = 0.12
    walks_m_s: float = 0.3
    reaction_s: float = 0.4
    stopping_s: float = 1.0
    intrusion_m: float = 0.1
    least_speed_m_s: float = 0.25
    walking_m_s: float = 1.6
    speed_limit_m_s: float = 1.0
    free_least_m: float = 0.5
    walled_least_m: float = 0.6
    lookahead_s: float = 1.0
    hold_s: float = 0.3
    max_age_s: float = 0.1
    humans_max_age_s: float = 0.25
    path_max_age_s: float = 0.5

    def __post_init__(self) -> None:
        """Check the ranges.

        Raises:
            ConfigError: names the setting and its value.
        """
        for limb, radius in self.limbs.items():
            if not limb or "/" in limb or limb in ("odometry", "humans", "path"):
                raise ConfigError("navigation.limbs", f"{limb!r} cannot be the name of a limb")
            if not (math.isfinite(radius) and radius > 0.0):
                raise ConfigError(f"navigation.limbs.{limb}", f"must be a radius in m, not {radius}")
        if not all(self.regions):
            raise ConfigError("navigation.regions", f"must be body regions, not {list(self.regions)}")
        for wall in self.walls:
            if not all(map(math.isfinite, wall)) or wall[:2] == wall[2:]:
                raise ConfigError("navigation.walls", f"{list(wall)} is no line from one point to another")
        zero = ("miss_m", "overlap_margin_m", "overlap_dwell_s", "intrusion_m", "departed_s")
        for name in self.__struct_fields__:
            value = getattr(self, name)
            if isinstance(value, dict | tuple):
                continue
            if not (math.isfinite(value) and (value > 0 or (value == 0 and name in zero))):
                least = "not negative" if name in zero else "positive"
                raise ConfigError(f"navigation.{name}", f"must be finite and {least}, not {value}")
