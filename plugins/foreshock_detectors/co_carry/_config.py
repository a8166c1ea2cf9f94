"""Configuration of the co-carry detector."""

from __future__ import annotations

import math

import msgspec

from foreshock.errors import ConfigError

__all__ = ["CoCarryConfig"]


class CoCarryConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Settings, with where each default comes from.

    Attributes:
        subject: what is carried.
        load_kg: its mass, known to the plan (kg).
        half_length_m: from its middle to either hand (m).
        axis: from its middle to the partner, in the load's frame; made a unit vector.
        down: direction of the weight in the wrench's frame; made a unit vector.
        share_error: deviation of the robot's share of the weight from the agreed one. Two people are taken to lift two
            thirds of what they could lift alone together (HSE, L23), so that each has half of its share in reserve:
            0.25 of the load when halves are agreed. 0.125 is half of that reserve.
        share_full: deviation at which the severity is 1: the whole reserve.
        share_time_constant_s: of each of the two filters that average the share over the gait (s): 0.3 s leaves 8 % of
            a swing of 1.8 Hz.
        phase_error_rad: lag between the two ends' motion. Beyond pi / 3 the difference of two equal swings,
            2 sin(lag / 2), is larger than each of them: the load pitches more than it heaves.
        desync_rad: lag between the swings of grip force and load. Beyond pi / 3 less than half of the load's swing,
            cos(lag), is answered by the grip.
        low_hz: lower edge of the band of a gait (Hz): below it the load is moved on purpose.
        high_hz: upper edge (Hz); people step at 1.4 to 2.1 Hz (slow to fast cadence, Winter, 1991).
        phase_time_constant_s: of the averages that the lag comes from (s): half a step; the lag of
            two pure sines then ripples by up to asin(1 / (2 w tau)), 0.17 rad at 1.8 Hz.
        least_coherence: two swings of less coherence have no common rhythm, and so no lag. It does not keep noise out,
            a quarter of which has more in this window: the least swings do.
        least_swing_m_s: RMS velocity of an end below which it is at rest (m/s). White noise leaves at most 0.82 of its
            deviation in the band in 2000 s at 50 Hz (measured), a tracker's 0.02 m/s hence 0.017 m/s.
        least_swing_n: RMS force below which there is no swing (N); by the same, 2 N of noise leave at most 1.7 N.
        confirm_s: a lag counts once it has lasted so long (s): a fifth of a step.
        hold_s: how long a verdict stands after its reason has gone (s): longer than half a step.
        max_age_s: age at which an input is stale (s).
        min_rate_hz: least rate of wrench, load and grip (Hz); 0 does not check.

    The false alarm rate of uneven-load-sharing follows from no theory, for the share is what partner and load make of
    it. Measured is that of interventions, to which all kinds contribute: in 3.0 h of nominal and near-miss runs of the
    plant co_carry, seeds from 30000, none was false, which bounds it at 1.23 per hour (exact Poisson, 95 %, two-sided).
    """

    subject: str = "load"
    load_kg: float = 20.0
    half_length_m: float = 0.8
    axis: tuple[float, float, float] = (1.0, 0.0, 0.0)
    down: tuple[float, float, float] = (0.0, 0.0, -1.0)
    share_error: float = 0.125
    share_full: float = 0.25
    share_time_constant_s: float = 0.3
    phase_error_rad: float = math.pi / 3.0
    desync_rad: float = math.pi / 3.0
    low_hz: float = 0.9
    high_hz: float = 3.0
    phase_time_constant_s: float = 0.25
    least_coherence: float = 0.6
    least_swing_m_s: float = 0.03
    least_swing_n: float = 3.0
    confirm_s: float = 0.1
    hold_s: float = 0.3
    max_age_s: float = 0.1
    min_rate_hz: float = 0.0

    def __post_init__(self) -> None:
        """Check the ranges.

        Raises:
            ConfigError: names the setting and its value.
        """
        for name in self.__struct_fields__:
            value = getattr(self, name)
            zero = name in ("min_rate_hz", "confirm_s")
            if isinstance(value, float) and not (math.isfinite(value) and (value > 0.0 or (zero and value == 0.0))):
                least = "not negative" if zero else "positive"
                raise ConfigError(f"co-carry.{name}", f"must be finite and {least}, not {value}")
        for name in ("axis", "down"):
            if not 0.0 < math.hypot(*getattr(self, name)) < math.inf:
                raise ConfigError(f"co-carry.{name}", f"{list(getattr(self, name))} is no direction")
        for low, high in (("low_hz", "high_hz"), ("share_error", "share_full")):
            if getattr(self, low) >= getattr(self, high):
                raise ConfigError(f"co-carry.{low}", f"{getattr(self, low)} is not below {high}, {getattr(self, high)}")
        for name in ("phase_error_rad", "desync_rad"):
            if getattr(self, name) >= math.pi:
                raise ConfigError(f"co-carry.{name}", f"{getattr(self, name)} is not below pi, the largest lag")
        if self.least_coherence >= 1.0:
            raise ConfigError("co-carry.least_coherence", f"{self.least_coherence} is not below 1")
