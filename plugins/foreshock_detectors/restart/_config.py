"""Configuration of the restart detector."""

from __future__ import annotations

import math
from typing import Literal

import msgspec

from foreshock.errors import ConfigError

__all__ = ["RestartConfig"]


class RestartConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Settings, with where each default comes from.

    False alarms. A speed measured with 6 mm/s (sd, white) exceeds start_m_s in two samples running with a probability
    of (1e-23)^2; the slope over slope_s at 100 Hz has an error of 0.14 m/s^2, a tenth of abrupt_m_s2. Noise raises
    none of the kinds: what does is a robot that does not follow its command, and nominal runs show how well it does.

    Attributes:
        motion: ``joints`` or ``odometry``: what the speed is measured by.
        subject: what moves: the subject of all kinds.
        joint: name of the joint if it is joints.
        lever_m: metres of travel of what people can be hit by, per unit of the joint (m/rad; 1 for a prismatic joint).
        standstill_m_s: below it the robot stands (m/s): 3 cm/s, five times a good encoder's noise; IEC 61800-5-2 (SOS)
            leaves the number to the integrator.
        start_m_s: above it, in two samples running, it moves (m/s); twice the standstill.
        rest_s: it rests once it has stood for so long (s).
        abrupt_m_s2: acceleration beyond what is commanded within onset_s of a start (m/s^2). 0.15 g is the most that
            standing passengers of public transport accept (Hoberock 1977); no standard of robots names a number.
        onset_s: how long a start is an onset (s).
        slope_s: least squares window of the acceleration (s).
        command_lag_s: the robot may follow its command later by so much (s): control period, drive, network.
        stopping_s: specified stopping time (s), ISO 13855's T, from the robot's data (ISO 10218-1 Annex B).
        overshoot_m_s: speed beyond the command within start_s of a start that counts (m/s),
        overshoot_share: or this share of the commanded speed, whichever is more; 20 % is a poorly damped servo.
        start_s: how long overshoot is judged after a start (s).
        mismatch_s: start or stop off its planned time (s): the simple reaction time of a human, who cannot adapt to
            what comes earlier or later by more without noticing too late.
        start_lag_s: a planned start shows so much later (s): a jerk-limited start needs it to reach start_m_s.
        still_phases: phases of the plan in which the robot stands.
        hold_s: how long a verdict stands after its reason has gone (s).
        max_age_s: age at which a channel is stale (s).
    """

    motion: Literal["joints", "odometry"] = "joints"
    subject: str = ""
    joint: str = "arm_right_1_joint"
    lever_m: float = 0.7
    standstill_m_s: float = 0.03
    start_m_s: float = 0.06
    rest_s: float = 0.15
    abrupt_m_s2: float = 1.5
    onset_s: float = 0.3
    slope_s: float = 0.05
    command_lag_s: float = 0.15
    stopping_s: float = 0.3
    overshoot_m_s: float = 0.1
    overshoot_share: float = 0.2
    start_s: float = 1.0
    mismatch_s: float = 0.2
    start_lag_s: float = 0.2
    still_phases: tuple[int, ...] = (1,)
    hold_s: float = 0.25
    max_age_s: float = 0.1

    def __post_init__(self) -> None:
        """Check the ranges.

        Raises:
            ConfigError: names the setting and its value.
        """
        for name in self.__struct_fields__:
            value = getattr(self, name)
            if isinstance(value, str | tuple):
                continue
            zero = name in ("hold_s", "start_lag_s", "command_lag_s", "overshoot_share")
            if not (math.isfinite(value) and (value > 0 or (zero and value == 0))):
                least = "not negative" if zero else "positive"
                raise ConfigError(f"restart.{name}", f"must be finite and {least}, not {value}")
        if not self.standstill_m_s < self.start_m_s:
            raise ConfigError("restart.standstill_m_s", f"{self.standstill_m_s} is not below start_m_s")
        if self.motion == "joints" and not self.joint:
            raise ConfigError("restart.joint", "is empty; name the joint, or set motion to 'odometry'")
