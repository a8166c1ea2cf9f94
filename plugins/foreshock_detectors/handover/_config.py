"""Configuration of the handover detector."""

from __future__ import annotations

import math

import msgspec

from foreshock.errors import ConfigError

__all__ = ["HandoverConfig"]


class HandoverConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Settings, with where each default comes from.

    Attributes:
        subject: what is handed over by.
        before: phases of the plan in which the partner is not due yet.
        during: phases in which the partner is to take hold; they are due when the pull is expected.
        given_up: phases in which the robot takes the object back, because nobody came.
        mismatch_s: difference between observed and planned time that counts (s); 0.4 s is two simple reaction times of
            0.2 s (Woodworth, Schlosberg, Experimental Psychology, 1954), one to see the other's error and one to act
            on it: within it both still adapt.
        scatter_s: standard deviation of the partner's time around the plan (s), for the false alarm rate.
        significance: and the difference is at least so many of them; beyond 4 lie 3.2e-5 of normal deviates on each
            side. With 0.1 s and a handover each 10 s that is one false alarm in some 44 h.
        full_s: difference at which the severity is 1 (s): as long as a whole reach and transfer.
        axis: direction in which the partner pulls, in the wrench's frame; made a unit vector.
        pull_n: force along it that is a pull (N): above a kilogram's inertia in the arm's own motion (below 2 m/s^2
            for reaches of 0.3 m in 1 s and longer) and six standard deviations of a 0.5 N wrist sensor.
        pull_release_n: below it the pull has ended (N).
        pull_dwell_s: a pull lasts at least so long (s): two samples of 50 Hz, so that one spike is none.
        pull_hold_s: a pull has ended once it was below for so long (s): longer than half a period of a tug at 3 Hz.
        point: where the object changes hands, in the frame of the humans (m).
        reach_m: a hand whose middle is this near to it has arrived (m): a hand's length, 0.19 m (ISO 7250-3).
        hold_s: how long a verdict stands after its reason has gone (s).
        max_age_s: age at which an input is stale (s).
    """

    subject: str = "right_gripper"
    before: tuple[int, ...] = (0,)
    during: tuple[int, ...] = (1,)
    given_up: tuple[int, ...] = (3,)
    mismatch_s: float = 0.4
    scatter_s: float = 0.1
    significance: float = 4.0
    full_s: float = 2.0
    axis: tuple[float, float, float] = (1.0, 0.0, 0.0)
    pull_n: float = 4.0
    pull_release_n: float = 2.0
    pull_dwell_s: float = 0.04
    pull_hold_s: float = 0.25
    point: tuple[float, float, float] = (0.1, 0.0, 1.0)
    reach_m: float = 0.19
    hold_s: float = 0.25
    max_age_s: float = 0.1

    def __post_init__(self) -> None:
        """Check the ranges.

        Raises:
            ConfigError: names the setting and its value.
        """
        for name in self.__struct_fields__:
            value = getattr(self, name)
            zero = name in ("scatter_s", "pull_dwell_s", "hold_s")
            if isinstance(value, float) and not (math.isfinite(value) and (value > 0.0 or (zero and value == 0.0))):
                least = "not negative" if zero else "positive"
                raise ConfigError(f"handover.{name}", f"must be finite and {least}, not {value}")
        phases = (*self.before, *self.during, *self.given_up)
        if not self.before or not self.during or len(set(phases)) != len(phases):
            problem = f"{[list(p) for p in (self.before, self.during, self.given_up)]} must be different phases"
            raise ConfigError("handover.before, during, given_up", f"{problem}; only given_up may be empty")
        if not 0.0 < math.hypot(*self.axis) < math.inf or not all(map(math.isfinite, self.point)):
            raise ConfigError("handover.axis", f"{list(self.axis)} is no direction, or the point is not finite")
        if self.pull_release_n >= self.pull_n:
            raise ConfigError("handover.pull_release_n", f"{self.pull_release_n} is not below pull_n, {self.pull_n}")
        if self.full_s <= self.threshold_s:
            raise ConfigError("handover.full_s", f"{self.full_s} is not above the threshold, {self.threshold_s}")

    @property
    def threshold_s(self) -> float:
        """Difference that counts, given the partner's scatter (s)."""
        return max(self.mismatch_s, self.significance * self.scatter_s)
