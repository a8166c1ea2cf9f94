"""Configuration of the people detector."""

from __future__ import annotations

import math
from typing import Literal

import msgspec

from foreshock.errors import ConfigError

__all__ = ["PeopleConfig"]


class PeopleConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Settings, with where each default comes from.

    False alarms. Reach-in: the slope over reach_window_s of a hand tracked with 10 mm (sd, white) at 50 Hz has an error
    of 0.12 m/s, so that a reach at 1.3 m/s is 5.8 of them below the threshold (4e-9 per sample, one in 1500 hours).
    Gaze and posture: the limit lies many standard deviations of any tracker away, and must be kept for a time; what
    fires is a human who really looks away or crouches.

    Attributes:
        humans: track ids of those whose gaze is measured, each on ``<id>/gaze``.
        workspace_m: centre of the robot's workspace, where a human has to look and a hand would be in danger (m).
        workspace_radius_m: radius of a ball about it (m).
        workspace_frame: ``odom``, or ``base``: it moves with the robot (``base/odometry``).
        shared_m: shared space: the trunk's horizontal distance from the centre (m). Beyond it nobody need look; 2.5 m
            is what a human at 1.6 m/s (ISO 13855, walking) covers in 1 s, and an arm.
        reach_m_s: speed of a hand towards the workspace (m/s): approach speed K of upper limbs in ISO 13855.
        reach_within_m: and it is so near to the workspace's surface (m): ISO 13855's 0.5 m, within which K holds.
        reach_window_s: least squares window of that speed (s).
        look_limit_rad: angle between gaze and direction to the workspace beyond which he does not see it: 40 deg, the
            useful field of view of about 30 deg radius (Ball et al. 1988) and 10 deg of a head tracker's error.
        look_release_rad: he looks again below this.
        glance_s: shorter glances away are no diversion (s): a blink lasts 0.1 to 0.4 s.
        attention_window_s: window of inattentiveness (s).
        inattentive_share: share of that window without looking: 2 s of 2.5 s. 2 s is the longest glance off the road of
            the NHTSA guidelines (2013) and the limit of Klauer et al. (2006).
        least_confidence: a gaze estimate below it, as in a blink, says nothing.
        lowering_m: fall of the head below the person's own standing height (m): half a crouch; picking something from
            hip height bends a standing adult by less than 0.1 m.
        lowering_release_m: absent again below this (m).
        lowering_s: it must last so long (s); a stumble is shorter.
        stature_time_s: time constant at which the standing height forgets (s); a person works bent for minutes.
        hold_s: how long a verdict stands after its reason has gone (s).
        dropout_s: a track may be missing for so long (s); later that person has left.
        max_age_s: age at which a channel is stale (s).
    """

    humans: tuple[str, ...] = ("human-1",)
    workspace_m: tuple[float, float, float] = (0.0, 0.0, 1.0)
    workspace_radius_m: float = 0.2
    workspace_frame: Literal["odom", "base"] = "odom"
    shared_m: float = 2.5
    reach_m_s: float = 2.0
    reach_within_m: float = 0.5
    reach_window_s: float = 0.1
    look_limit_rad: float = 0.7
    look_release_rad: float = 0.52
    glance_s: float = 0.5
    attention_window_s: float = 2.5
    inattentive_share: float = 0.8
    least_confidence: float = 0.3
    lowering_m: float = 0.25
    lowering_release_m: float = 0.15
    lowering_s: float = 0.2
    stature_time_s: float = 600.0
    hold_s: float = 0.2
    dropout_s: float = 0.3
    max_age_s: float = 0.2

    def __post_init__(self) -> None:
        """Check the ranges.

        Raises:
            ConfigError: names the setting and its value.
        """
        if len(set(self.humans)) != len(self.humans) or not all(self.humans):
            raise ConfigError("people.humans", f"must be different, non-empty track ids, not {list(self.humans)}")
        if not all(math.isfinite(v) for v in self.workspace_m):
            raise ConfigError("people.workspace_m", f"must be finite, not {list(self.workspace_m)}")
        for name in self.__struct_fields__:
            value = getattr(self, name)
            if isinstance(value, str | tuple):
                continue
            zero = name in ("least_confidence", "hold_s", "workspace_radius_m")
            if not (math.isfinite(value) and (value > 0 or (zero and value == 0))):
                least = "not negative" if zero else "positive"
                raise ConfigError(f"people.{name}", f"must be finite and {least}, not {value}")
        for low, high in (
            ("look_release_rad", "look_limit_rad"),
            ("lowering_release_m", "lowering_m"),
            ("inattentive_share", "1"),
        ):
            limit = getattr(self, high, 1.0)
            if not getattr(self, low) <= limit:
                raise ConfigError(f"people.{low}", f"{getattr(self, low)} is above {high}, {limit}")

    @property
    def gazes(self) -> tuple[tuple[str, str], ...]:
        """(input name, human) per human whose gaze is measured."""
        if len(self.humans) == 1:
            return (("gaze", self.humans[0]),)
        return tuple((f"gaze-{human}", human) for human in self.humans)
