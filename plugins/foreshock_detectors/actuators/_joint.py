"""One joint: does its drive give what is asked, and does it stand where it is told?"""

from __future__ import annotations

from foreshock.records import Indication, SampleRef
from foreshock_detectors._sequential import Hysteresis, severity
from foreshock_detectors.actuators._config import ActuatorsConfig

__all__ = ["Joint"]


class Joint:
    """Implements the two kinds for one joint.

    torque-saturation: the statistic is the larger of owed / shortfall and used / use, owed = (commanded - delivered) *
    sign(commanded) / rated, used = |delivered| / rated; it counts at 1. A drive that gives more than it is asked
    owes nothing, nor does one of which nothing is asked.
    actuator-drift: |exponential mean of (commanded - measured position)|, so that a shake about the command, which has
    no mean, is no drift.

    False alarms: with torque noise of 0.7 % of the rated torque, three samples in a row (the dwell at 50 Hz) above 4.3
    sigma have a chance of 1e-15; what is left are disturbances of the command. Encoder noise of 0.2 mrad gives a mean
    of 0.06 mrad.
    """

    __slots__ = ("_drift", "_last_ns", "_mean", "_peak", "_saturated", "name")

    def __init__(self, name: str, peak_n_m: float, config: ActuatorsConfig) -> None:
        hold_ns, ratio = round(config.hold_s * 1e9), config.release_ratio
        self.name, self._peak = name, peak_n_m
        self._saturated = Hysteresis(1.0, ratio, hold_ns, round(config.dwell_s * 1e9))
        self._drift = Hysteresis(config.drift_rad, ratio * config.drift_rad, hold_ns)
        self._mean, self._last_ns = 0.0, -1

    def saturation(
        self, config: ActuatorsConfig, asked: float, given: float, stamp_ns: int, seen: tuple[SampleRef, ...]
    ) -> Indication:
        """Torques in N m: commanded and delivered."""
        owed = (asked - given if asked > 0.0 else given - asked if asked < 0.0 else 0.0) / self._peak
        used = abs(given) / self._peak
        statistic = max(owed / config.shortfall, used / config.use)
        present = self._saturated.push(statistic, stamp_ns)
        grave = severity(owed, config.shortfall, config.full_shortfall) if present else 0.0
        measures = {"owed": owed, "used": used}
        return Indication(
            "torque-saturation",
            self.name,
            stamp_ns,
            present,
            statistic,
            1.0,
            "1",
            grave,
            seen if present else (),
            None,
            measures,
        )

    def drift(
        self, config: ActuatorsConfig, told: float, at: float, stamp_ns: int, seen: tuple[SampleRef, ...]
    ) -> Indication:
        """Positions in rad: commanded and measured."""
        if self._last_ns < 0:
            self._mean = told - at
        elif stamp_ns > self._last_ns:
            dt_s = (stamp_ns - self._last_ns) * 1e-9
            self._mean += dt_s / (config.mean_s + dt_s) * (told - at - self._mean)
        self._last_ns = max(stamp_ns, self._last_ns)
        off, least = abs(self._mean), config.drift_rad
        present = self._drift.push(off, stamp_ns)
        grave = severity(off, least, config.full_drift_rad) if present else 0.0
        return Indication(
            "actuator-drift", self.name, stamp_ns, present, off, least, "rad", grave, seen if present else ()
        )
