"""Configuration of the grip detector."""

from __future__ import annotations

import math
from typing import Literal

import msgspec

from foreshock.errors import ConfigError

__all__ = ["GripConfig"]


class GripConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Settings, with where each default comes from.

    Attributes:
        grippers: names of the grippers; each is a subject, read from ``<gripper>/state``.
        backend: ``scalar`` or ``filterpy``, two forms of one Kalman filter (docs/decisions/0004-grip-filter.md).
        noise_n: standard deviation of the force sensors (N), from their data sheet; 0.05 N is a small six-axis cell.
        acceleration_noise_m_s2: standard deviation of vertical_acceleration (m/s^2); 0.05 is a MEMS IMU at 1 kHz.
        load_rate_noise: how fast the rate of a held load wanders while nothing happens (N/s per sqrt s).
        transfer_rate_noise: the same while load is being handed over or picked up: a 2 kg object in 0.4 s is 50 N/s.
        grip_rate_noise: the same of the normal force at a constant command.
        command_rate_noise: the same of the normal force while the command moves.
        false_alarm_s: least mean time between false alarms of each sequential test (s); 10 h is about one working
            shift. A load that stands stiller than load_rate_noise allows makes them two to three times rarer still.
        smallest_step_sigma: step in standard deviations that CUSUM is tuned to find soonest; its reference is half.
        slip_hold_s: a slip stays present for so long after its last alarm (s): the period of a 5 Hz stick-slip.
        friction: friction coefficient of the pads; for the measure ``friction_use`` alone, never judged.
        contacts: how many pads share the tangential force; for ``friction_use`` alone.
        oscillation_low_hz: lower edge of the oscillation band; below it the arm moves.
        oscillation_high_hz: upper edge; above it the sensor's own scatter is tested (NIS).
        oscillation_window_s: time constant of the band's energy (s); more than half a period of the lower edge.
        oscillation_rms_n: band RMS of an oscillation (N); 0.2 N is 1 % of a 20 N grip.
        oscillation_nis: innovation variance over nominal above which the force scatters; 4 is twice the deviation.
        mass_error: relative error of the assumed mass; 0.2 is the usual payload margin of an arm's dynamic model.
        mass_significance: required distance from the assumed load in standard deviations (3.29: two-sided 0.1 %).
        force_bias_n: largest constant error of the tangential force (N); an error within it is never significant.
        steady_s: a load must be still for so long before its mass is judged (s).
        mass_patience_s: held for longer than this without a still load, the mass is unobserved (s).
        command_step_n: change of command that counts as one (N).
        transfer_settle_s: a transfer lasts so long after the last change of command or of rising load (s).
        transfer_max_s: a command that changes for longer no longer excuses what the force does (s); a human handover
            takes about 0.5 s to 1 s.
        max_age_s: age at which the state is stale (s).
        min_rate_hz: least rate of the state (Hz).
    """

    grippers: tuple[str, ...] = ("left_gripper",)
    backend: Literal["scalar", "filterpy"] = "scalar"
    noise_n: float = 0.05
    acceleration_noise_m_s2: float = 0.05
    load_rate_noise: float = 1.0
    transfer_rate_noise: float = 50.0
    grip_rate_noise: float = 1.0
    command_rate_noise: float = 5000.0
    false_alarm_s: float = 36_000.0
    smallest_step_sigma: float = 1.0
    slip_hold_s: float = 0.2
    friction: float = 0.4
    contacts: int = 1
    oscillation_low_hz: float = 3.0
    oscillation_high_hz: float = 40.0
    oscillation_window_s: float = 0.25
    oscillation_rms_n: float = 0.2
    oscillation_nis: float = 4.0
    mass_error: float = 0.2
    mass_significance: float = 3.29
    force_bias_n: float = 0.2
    steady_s: float = 0.3
    mass_patience_s: float = 5.0
    command_step_n: float = 0.1
    transfer_settle_s: float = 0.2
    transfer_max_s: float = 1.5
    max_age_s: float = 0.1
    min_rate_hz: float = 0.0

    def __post_init__(self) -> None:
        """Check the ranges.

        Raises:
            ConfigError: names the setting and its value.
        """
        if not self.grippers or len(set(self.grippers)) != len(self.grippers) or not all(self.grippers):
            raise ConfigError("grip.grippers", f"must be different, non-empty names, not {list(self.grippers)}")
        for name in self.__struct_fields__:
            value = getattr(self, name)
            if isinstance(value, str | tuple):
                continue
            zero = name in ("acceleration_noise_m_s2", "force_bias_n", "min_rate_hz")
            if not (math.isfinite(value) and (value > 0 or (zero and value == 0))):
                least = "not negative" if zero else "positive"
                raise ConfigError(f"grip.{name}", f"must be finite and {least}, not {value}")
        if not self.oscillation_low_hz < self.oscillation_high_hz:
            raise ConfigError("grip.oscillation_low_hz", f"{self.oscillation_low_hz} is not below oscillation_high_hz")

    @property
    def names(self) -> tuple[tuple[str, str], ...]:
        """(input name, gripper) per gripper."""
        if len(self.grippers) == 1:
            return (("grip", self.grippers[0]),)
        return tuple((f"grip-{gripper}", gripper) for gripper in self.grippers)
