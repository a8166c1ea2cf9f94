"""The detector: one thermal replica a joint."""

from __future__ import annotations

import math
from collections.abc import Sequence

from foreshock.detector import Inputs
from foreshock.messages import JointState
from foreshock.records import Indication, Sample, SampleRef
from foreshock_hot_motor import KIND, Settings

__all__ = ["HotMotorDetector", "heated", "time_to_trip_s"]


def heated(level: float, load: float, passed_s: float, time_constant_s: float) -> float:
    """Thermal level after a time at constant load: theta' = (k^2 - theta) / tau (IEC 60255-149).

    Args:
        level: theta, temperature rise as a share of the permissible one; the motor trips at 1.
        load: k, torque over rated torque; losses go with its square.
        passed_s: time that the load lasted.
        time_constant_s: tau.
    """
    return load**2 + (level - load**2) * math.exp(-passed_s / time_constant_s)


def time_to_trip_s(level: float, load: float, time_constant_s: float) -> float | None:
    """Time until theta = 1 at constant load, tau ln((k^2 - theta) / (k^2 - 1)); None if it never trips."""
    if level >= 1.0:
        return 0.0
    if load <= 1.0:
        return None
    return time_constant_s * math.log((load**2 - level) / (load**2 - 1.0))


class HotMotorDetector:
    """Integrates each joint's heat over all its samples.

    Between two samples the larger of both torques is assumed, so that a gap in the stream never cools a motor below
    what it may have become. The kind is left out, hence unobserved, while a joint's torque is missing from the message.
    """

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self.reset(0)

    def reset(self, seed: int) -> None:  # noqa: ARG002 # part of the port; nothing here is random
        """Forget everything; the motors are assumed half warm."""
        self._levels = dict.fromkeys(self._settings.rated_n_m, self._settings.start)
        self._loads = dict.fromkeys(self._settings.rated_n_m, 0.0)
        self._present = dict.fromkeys(self._settings.rated_n_m, False)
        self._stamp_ns = -1
        self._complete = False

    def update(self, now_ns: int, inputs: Inputs) -> Sequence[Indication]:  # noqa: ARG002 # time is the samples' own
        """One indication per joint. Samples count in the order of their stamps; repeated and late ones do not."""
        for sample in sorted(inputs.new["joints"], key=lambda s: s.stamp_ns):
            if sample.stamp_ns > self._stamp_ns:
                self._take(sample)
        if not self._complete:
            return ()
        seen = SampleRef(inputs.latest["joints"].channel, self._stamp_ns)
        return [self._judge(joint, seen) for joint in self._levels]

    def _take(self, sample: Sample) -> None:
        assert isinstance(sample.value, JointState)  # the core checks the declared type
        torques = dict(zip(sample.value.name, sample.value.effort, strict=False))
        self._complete = all(joint in torques for joint in self._levels)
        if not self._complete:
            return
        passed_s = (sample.stamp_ns - self._stamp_ns) / 1e9 if self._stamp_ns >= 0 else 0.0
        for joint, rated_n_m in self._settings.rated_n_m.items():
            load = abs(torques[joint]) / rated_n_m
            worst = max(load, self._loads[joint])
            self._levels[joint] = heated(self._levels[joint], worst, passed_s, self._settings.time_constant_s)
            self._loads[joint] = load
        self._stamp_ns = sample.stamp_ns

    def _judge(self, joint: str, seen: SampleRef) -> Indication:
        s, level = self._settings, self._levels[joint]
        present = level >= s.limit * (s.release if self._present[joint] else 1.0)
        self._present[joint] = present
        return Indication(
            kind=KIND.id,
            subject=joint,
            stamp_ns=self._stamp_ns,
            present=present,
            statistic=level,
            threshold=s.limit,
            unit="1",
            severity=min(1.0, max(0.0, (level - s.limit) / (1.0 - s.limit))) if present else 0.0,
            evidence=(seen,),
            time_to_event_s=time_to_trip_s(level, self._loads[joint], s.time_constant_s) if present else None,
            measures={"load": self._loads[joint]},
        )
