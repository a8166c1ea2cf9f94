"""Configuration of the telemetry detector."""

from __future__ import annotations

import math

import msgspec

from foreshock.errors import ConfigError

__all__ = ["TelemetryConfig"]


class TelemetryConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Settings, with where each default comes from.

    Attributes:
        links: link name to the patterns (``fnmatch``) of its channels below the robot's name; the first that matches
            has the channel. A link is a subject, so that one network fault is one precursor.
        base_latency_s: latency of the link at its best (s); clocks with an unknown offset show only what exceeds it.
        clock_drift_ppm: how fast sender and receiver clock may drift apart; two crystals of 25 ppm each are 50. The
            estimated offset forgets no faster, so that a delay of 50 ms is not taken for an offset within 15 minutes.
        spike_deviations: k: a spike lies k robust standard deviations above the running median.
        spike_floor_s: and above this (s): four periods of a 200 Hz control loop.
        delay_budget_s: mean latency that counts as delay (s): ten periods of a 200 Hz whole-body loop.
        delay_time_constant_s: time constant of that mean (s).
        loss_fraction: fraction of messages lost that counts as dropout.
        loss_least: and at least so many were lost within the time constant.
        loss_time_constant_s: time constant of the fraction (s).
        silence_periods: expected periods without a message that count as dropout.
        silence_floor_s: and at least this long (s): above the pauses of a general-purpose operating system.
        reorder_events: messages out of order within reorder_window_s that count.
        reorder_window_s: see above (s).
        hold_s: how long a verdict stands after its reason has gone (s).
        period_s: pattern to expected period (s); channels that match none are learned from their stamps.
        aperiodic: patterns of channels that send on events: their silence means nothing.
    """

    links: dict[str, tuple[str, ...]] = msgspec.field(default_factory=lambda: {"robot": ("*",)})
    base_latency_s: float = 0.0
    clock_drift_ppm: float = 50.0
    spike_deviations: float = 8.0
    spike_floor_s: float = 0.02
    delay_budget_s: float = 0.05
    delay_time_constant_s: float = 0.5
    loss_fraction: float = 0.05
    loss_least: float = 3.0
    loss_time_constant_s: float = 2.0
    silence_periods: float = 10.0
    silence_floor_s: float = 0.05
    reorder_events: int = 1
    reorder_window_s: float = 1.0
    hold_s: float = 0.25
    period_s: dict[str, float] = {}
    aperiodic: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Check the ranges.

        Raises:
            ConfigError: names the setting and its value.
        """
        if not self.links:
            raise ConfigError("telemetry.links", 'is empty; the default is {"robot": ["*"]}')
        for link, patterns in self.links.items():
            if not link or not patterns or not all(patterns):
                raise ConfigError(f"telemetry.links.{link}", f"needs a name and patterns, not {list(patterns)}")
        zero = ("base_latency_s", "clock_drift_ppm", "silence_floor_s")
        named = [(f, getattr(self, f)) for f in self.__struct_fields__ if f not in ("links", "period_s", "aperiodic")]
        for name, value in [*named, *((f"period_s.{p}", v) for p, v in self.period_s.items())]:
            if not (math.isfinite(value) and (value > 0 or (value == 0 and name in zero))):
                least = "not negative" if name in zero else "positive"
                raise ConfigError(f"telemetry.{name}", f"must be finite and {least}, not {value}")
        if self.loss_fraction >= 1.0:
            raise ConfigError("telemetry.loss_fraction", f"must be below 1, not {self.loss_fraction}")
