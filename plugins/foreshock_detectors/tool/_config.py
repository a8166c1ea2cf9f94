"""Configuration of the tool detector."""

from __future__ import annotations

import math

import msgspec

from foreshock.errors import ConfigError

__all__ = ["ToolConfig"]


class ToolConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Settings, with where each default comes from.

    Attributes:
        tool: name of the tool; the subject, and the first part of its channels.
        place_noise_m: standard deviation of the tip's measured position along one axis (m).
        tip_low_hz: lower edge of the band of tip oscillation; below it the arm moves the tool along its path.
        tip_high_hz: upper edge. Chatter of robots that hold a tool is that of their structure, some 10 Hz (Pan, Zhang,
            Zhu, Wang, Chatter analysis of robotic machining process, 2006), far below the spindle's.
        tip_window_s: time constant of the band's energy (s): a period of 4 Hz.
        tip_rms_m: band RMS of an oscillating tip (m): a tenth of the radius of a 100 mm disc.
        tip_full_m: band RMS of full severity (m): the peaks reach half that radius.
        reach_m: a human nearer to the tip than this is within its reach (m): the length of an upper limb, so that one
            movement of either closes the gap.
        cone_rad: deviation of the tool's axis from its command that is unsafe with a human in reach (rad): 8 degrees
            sweep the tip of a 0.35 m tool by a disc's radius.
        line_rad: and so is a tool that points at a human within this (rad): 15 degrees, the spread of chips and of a
            broken disc's fragments about its plane that guards are made for.
        follow_s: how late a tool follows a commanded rotation (s); the cone grows by the commanded rate times this.
        torque_noise_n_m: standard deviation of measured less expected wrist torque about one axis (N m).
        torque_error: and this share of the expected torque, the error of its model; both add as variances.
        nis_samples: samples in the window of the normalised innovation squared, even.
        false_alarm_s: least mean time between false alarms of that window (s); 36 000 s is a shift. If the torque's
            model holds, that is; the bands' thresholds are many times the noise instead.
        nis_full: statistic of full severity, over its threshold.
        hold_s: how long a verdict stands after its reason has gone (s).
        max_age_s: age at which pose, command and wrenches are stale (s).
        humans_max_age_s: age at which people are stale (s).
    """

    tool: str = "tool"
    place_noise_m: float = 0.0003
    tip_low_hz: float = 2.0
    tip_high_hz: float = 15.0
    tip_window_s: float = 0.25
    tip_rms_m: float = 0.005
    tip_full_m: float = 0.018
    reach_m: float = 0.75
    cone_rad: float = 0.14
    line_rad: float = 0.26
    follow_s: float = 0.1
    torque_noise_n_m: float = 0.3
    torque_error: float = 0.05
    nis_samples: int = 10
    false_alarm_s: float = 36_000.0
    nis_full: float = 10.0
    hold_s: float = 0.2
    max_age_s: float = 0.1
    humans_max_age_s: float = 0.2

    def __post_init__(self) -> None:
        """Check the ranges.

        Raises:
            ConfigError: names the setting and its value.
        """
        if not self.tool or "/" in self.tool:
            raise ConfigError("tool.tool", f"must be the first part of a channel's name, not {self.tool!r}")
        for name in self.__struct_fields__:
            value = getattr(self, name)
            if not isinstance(value, str) and not (math.isfinite(value) and value > 0):
                raise ConfigError(f"tool.{name}", f"must be finite and positive, not {value}")
        for low, high in (("tip_low_hz", "tip_high_hz"), ("tip_rms_m", "tip_full_m")):
            if not getattr(self, low) < getattr(self, high):
                raise ConfigError(f"tool.{low}", f"{getattr(self, low)} is not below {high} {getattr(self, high)}")
        for name in ("cone_rad", "line_rad"):
            if not getattr(self, name) < 0.5 * math.pi:
                raise ConfigError(f"tool.{name}", f"{getattr(self, name)} is no cone; expected below pi / 2")
        if self.nis_samples % 2:
            raise ConfigError("tool.nis_samples", f"must be even, not {self.nis_samples}")
        if not self.nis_full > 1.0:
            raise ConfigError("tool.nis_full", f"{self.nis_full} is not above 1, the threshold")
