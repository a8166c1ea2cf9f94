"""Configuration of the swing-leg detector."""

from __future__ import annotations

import math

import msgspec

from foreshock.errors import ConfigError

__all__ = ["SwingLegConfig"]


class SwingLegConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Settings, with where each default comes from.

    Attributes:
        feet: names of the feet as in the plan's support; each is a subject, read from ``<foot>_foot/odometry`` and
            ``<foot>_foot/plan``.
        drift_m: the foot off its plan by this (m) is drift: a third of the 120 mm that a human foot needs (ISO 13854),
            which is what a planner can have left free beside the swept volume.
        lookahead_s: the deviation is judged so far ahead along its own rate (s): what a foot needs to be put down.
        filter_s: time constant of the filter on deviation and rate (s): a tenth of a step.
        dwell_s: a deviation counts after it has stood so long (s): three samples at 50 Hz, so that no single one does.
        release: absent again below this share of drift_m.
        settle_s: after lift-off nothing is judged for so long (s): the plan's foothold gives way to the measured one.
        hold_s: how long a verdict stands after its reason has gone (s).
        max_age_s: age at which an input is stale (s).
        min_rate_hz: least rate of the inputs (Hz).

    With white noise of s m on each axis the filtered deviation ahead has a standard deviation of about 1.2 s at the
    defaults and 50 Hz: at 2 mm the threshold is 16 of them, so that noise alone raises no alarm (p < 1e-50); what a
    robot's tracking leaves over, up to some 15 mm, is the margin.
    """

    feet: tuple[str, ...] = ("left", "right")
    drift_m: float = 0.04
    lookahead_s: float = 0.1
    filter_s: float = 0.06
    dwell_s: float = 0.04
    release: float = 0.5
    settle_s: float = 0.06
    hold_s: float = 0.3
    max_age_s: float = 0.1
    min_rate_hz: float = 0.0

    def __post_init__(self) -> None:
        """Check the ranges.

        Raises:
            ConfigError: names the setting and its value.
        """
        if not self.feet or len(set(self.feet)) != len(self.feet) or not all(self.feet):
            raise ConfigError("swing_leg.feet", f"must be different, non-empty names, not {list(self.feet)}")
        if "plan" in self.feet:
            raise ConfigError("swing_leg.feet", "'plan' cannot be the name of a foot")
        zero = ("lookahead_s", "dwell_s", "settle_s", "min_rate_hz")
        for name in self.__struct_fields__:
            value = getattr(self, name)
            if isinstance(value, tuple):
                continue
            if not (math.isfinite(value) and (value > 0 or (value == 0 and name in zero))):
                least = "not negative" if name in zero else "positive"
                raise ConfigError(f"swing_leg.{name}", f"must be finite and {least}, not {value}")
        if self.release >= 1.0:
            raise ConfigError("swing_leg.release", f"must be below 1, not {self.release}")
