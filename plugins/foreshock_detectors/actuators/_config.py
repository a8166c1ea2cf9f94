"""Configuration of the actuators detector."""

from __future__ import annotations

import math

import msgspec

from foreshock.errors import ConfigError

__all__ = ["ActuatorsConfig"]


class ActuatorsConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Settings, with where each default comes from.

    Attributes:
        joints: joint to its rated peak torque (N m). A joint is a subject. The default is the example plant's.
        shortfall: share of the rated torque that the drive owes to its command. 0.03 is 4.3 standard deviations of a
            torque estimate by motor current of 0.7 % of the rated torque.
        full_shortfall: share of severity 1.
        use: share of the rated torque that counts by itself, whatever was commanded: 0.98, for a drive clips its
            command before it publishes it where the limit is known to it.
        dwell_s: both count after this long (s). A drive passes a step of command on within its current loop (1 to
            5 ms) and a planned acceleration may touch the limit for two or three samples of 50 Hz.
        drift_rad: mean distance of a joint from its command (rad): 0.03 rad at 0.55 m are 16 mm. ISO 13855 counts a
            hand from 14 mm on, and a computed-torque controller tracks three times better (0.01 rad).
        full_drift_rad: distance of severity 1.
        mean_s: time constant of that mean (s): the control loop of an arm of 5 Hz bandwidth has forgotten an impact
            after three of its 30 ms.
        release_ratio: a kind is over below this share of its threshold.
        hold_s: and after so long (s).
    """

    joints: dict[str, float] = msgspec.field(default_factory=lambda: {"elbow": 57.6})
    shortfall: float = 0.03
    full_shortfall: float = 0.5
    use: float = 0.98
    dwell_s: float = 0.04
    drift_rad: float = 0.03
    full_drift_rad: float = 0.2
    mean_s: float = 0.1
    release_ratio: float = 0.6
    hold_s: float = 0.2

    def __post_init__(self) -> None:
        """Check the ranges.

        Raises:
            ConfigError: names the setting and its value.
        """
        if not self.joints or not all(self.joints):
            raise ConfigError("actuators.joints", "is empty; expected joint = rated peak torque in N m")
        named = [(f, getattr(self, f)) for f in self.__struct_fields__ if f != "joints"]
        for name, value in [*((f"joints.{joint}", peak) for joint, peak in self.joints.items()), *named]:
            if not (math.isfinite(value) and (value > 0.0 or (value == 0.0 and name in ("dwell_s", "hold_s")))):
                least = "not negative" if name in ("dwell_s", "hold_s") else "positive"
                raise ConfigError(f"actuators.{name}", f"must be finite and {least}, not {value}")
        for low, high in (("shortfall", "full_shortfall"), ("drift_rad", "full_drift_rad")):
            if not getattr(self, low) < getattr(self, high):
                raise ConfigError(
                    f"actuators.{low}", f"{getattr(self, low)} is not below {high} = {getattr(self, high)}"
                )
        if self.release_ratio > 1.0:
            raise ConfigError("actuators.release_ratio", f"{self.release_ratio} is above 1")
