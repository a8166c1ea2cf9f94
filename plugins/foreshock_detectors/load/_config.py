"""Configuration of the load detector."""

from __future__ import annotations

import math

import msgspec

from foreshock.errors import ConfigError

__all__ = ["LoadConfig"]


class LoadConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Settings, with where each default comes from.

    Attributes:
        gripper: name of the gripper; the subject, and the first part of its channels.
        gyro_noise_rad_s: standard deviation of the gripper's gyro (rad/s); 0.005 is a MEMS gyro at 100 Hz.
        wrist_low_hz: lower edge of the band in which a wrist is unstable; below it arms and gait move an object.
        wrist_high_hz: upper edge; servo loops with some 10 ms of delay oscillate at 1 / (4 * delay), some 25 Hz.
        wrist_window_s: time constant of the band's energy (s): two periods of the lower edge.
        wrist_dwell_s: an unstable wrist shakes for so long (s): the jolt of a footfall or a contact rings for less.
        wrist_rms_rad_s: band RMS of an unstable wrist (rad/s): at 20 Hz and pads 0.1 m ahead of the wrist, 0.08 rad/s
            shakes the object by 1 m/s^2, a tenth of its weight.
        wrist_full_rad_s: band RMS of full severity (rad/s): the same by half of its weight.
        tilt_noise_rad: standard deviation of the object's measured orientation about one axis (rad).
        tilt_allowance_rad: tilt that is no drift (rad): 2 degrees, the calibration error of hand-eye and grasp pose.
        tilt_window_s: time constant of the tilt's mean (s): what swings at 1 Hz or faster is halved at least.
        tilt_full_rad: tilt of full severity (rad): 15 degrees, where the weight's share along the pads begins to spill.
        tilt_lag_s: how late an object follows a commanded rotation (s); the allowance grows by the commanded rate
            times this.
        smallest_drift_sigma: excess of tilt in standard deviations that CUSUM is tuned to find soonest.
        false_alarm_s: least mean time between false alarms of each CUSUM (s), at a tilt that stands at the allowance
            itself; the four of them (both ways about two axes) make it a quarter. 144 000 s leaves 10 h, a shift.
        hold_s: how long a verdict stands after its reason has gone (s).
        max_age_s: age at which an input is stale (s).
    """

    gripper: str = "left_gripper"
    gyro_noise_rad_s: float = 0.005
    wrist_low_hz: float = 8.0
    wrist_high_hz: float = 40.0
    wrist_window_s: float = 0.25
    wrist_dwell_s: float = 0.1
    wrist_rms_rad_s: float = 0.08
    wrist_full_rad_s: float = 0.4
    tilt_noise_rad: float = 0.004
    tilt_allowance_rad: float = 0.035
    tilt_window_s: float = 0.25
    tilt_full_rad: float = 0.26
    tilt_lag_s: float = 0.1
    smallest_drift_sigma: float = 1.0
    false_alarm_s: float = 144_000.0
    hold_s: float = 0.2
    max_age_s: float = 0.1

    def __post_init__(self) -> None:
        """Check the ranges.

        Raises:
            ConfigError: names the setting and its value.
        """
        if not self.gripper or "/" in self.gripper:
            raise ConfigError("load.gripper", f"must be the first part of a channel's name, not {self.gripper!r}")
        for name in self.__struct_fields__:
            value = getattr(self, name)
            if not isinstance(value, str) and not (math.isfinite(value) and value > 0):
                raise ConfigError(f"load.{name}", f"must be finite and positive, not {value}")
        for low, high in (
            ("wrist_low_hz", "wrist_high_hz"),
            ("wrist_rms_rad_s", "wrist_full_rad_s"),
            ("tilt_allowance_rad", "tilt_full_rad"),
        ):
            if not getattr(self, low) < getattr(self, high):
                raise ConfigError(f"load.{low}", f"{getattr(self, low)} is not below {high} {getattr(self, high)}")
