"""Fakes of the ports that behave: a twin with a little physics, a threshold detector, builders for tests."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import msgspec
import numpy as np

from foreshock.detector import DetectorSpec, Input, Inputs
from foreshock.messages import Scalar
from foreshock.records import Indication, Intervention, Sample, SampleRef
from foreshock.twin import Channel, Parameters, TwinEvent

__all__ = ["PendulumTwin", "ThresholdConfig", "ThresholdDetector", "threshold_spec"]


class ThresholdConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """threshold: present at or above it; release: absent again below this share of it; gain: statistic per unit."""

    threshold: float = 1.0
    release: float = 0.8
    gain: float = 1.0


class ThresholdDetector:
    """A complete, small detector: one kind, a threshold with hysteresis on a Scalar channel."""

    def __init__(self, kind: str, config: ThresholdConfig) -> None:
        self._kind, self._config = kind, config
        self._present = False

    def reset(self, seed: int) -> None:  # noqa: ARG002 # this detector draws nothing
        """Forget everything."""
        self._present = False

    def update(self, now_ns: int, inputs: Inputs) -> Sequence[Indication]:  # noqa: ARG002 # judged by source stamp
        """One indication."""
        sample = inputs.latest["value"]
        assert isinstance(sample.value, Scalar)  # noqa: S101 # the core checked the declared type
        c = self._config
        statistic = abs(sample.value.data) * c.gain
        self._present = statistic >= c.threshold * (c.release if self._present else 1.0)
        severity = min(1.0, statistic / c.threshold) if self._present else 0.0
        ref = SampleRef(sample.channel, sample.stamp_ns)
        return [
            Indication(self._kind, "", sample.stamp_ns, self._present, statistic, c.threshold, "1", severity, (ref,))
        ]


def threshold_spec(id_: str, kind: str, channel: str, **spec: object) -> DetectorSpec:
    """Spec of a ThresholdDetector; further fields of DetectorSpec by keyword."""
    base = DetectorSpec(
        id_,
        (kind,),
        (Input("value", channel, Scalar),),
        lambda config: ThresholdDetector(kind, config),
        ThresholdConfig,
    )
    return msgspec.structs.replace(base, **spec)


class PendulumTwin:
    """An inverted pendulum that topples unless it is locked in time; streams lean, rate and a wheel's slip.

    Parameters: ``push`` (rad/s at t = 0.5 s), ``noise`` (rad). Action: ``balance-lock``. Event of mode A1:
    ``fall-onto-human`` at a lean of 1 rad.
    """

    period_ns = 5_000_000
    stepped = True
    actions = frozenset({"balance-lock", "step-suppression"})
    channels = (
        Channel("body/lean", "Scalar", 5_000_000),
        Channel("body/rate", "Scalar", 5_000_000),
        Channel("body/kick", "Scalar", 5_000_000),
    )

    def __init__(self, robot: str = "talos") -> None:
        self._robot = robot
        self.reset({}, 0)

    def reset(self, parameters: Parameters, seed: int) -> None:
        """Upright at rest."""
        self._p = {"push": 0.0, "noise": 0.0, **parameters}
        self._rng = np.random.default_rng(seed)
        self._t, self._seq, self._lean, self._rate, self._lock, self._kick = 0, 0, 0.0, 0.0, 0.0, 0.0
        self._events: list[TwinEvent] = []

    def advance(self, until_ns: int) -> Sequence[Sample]:
        """Explicit Euler at 1 ms."""
        out: list[Sample] = []
        h = 0.001
        while self._t + self.period_ns <= until_ns:
            for k in range(5):
                if self._t + k * 1_000_000 == 500_000_000:
                    self._rate += self._p["push"]
                    self._kick = self._p["push"]
                self._rate += h * (9.81 * self._lean - self._lock * (60.0 * self._lean + 15.0 * self._rate))
                self._lean += h * self._rate
                self._kick *= 1.0 - h
            self._t += self.period_ns
            for name, value in (("lean", self._lean), ("rate", self._rate), ("kick", self._kick)):
                noisy = value + self._p["noise"] * float(self._rng.standard_normal())
                out.append(Sample(self._t, f"{self._robot}/body/{name}", Scalar(noisy), self._seq, self._t))
            self._seq += 1
            if abs(self._lean) > 1.0 and not self._events:
                self._events.append(TwinEvent(self._t, "fall-onto-human", "A1", abs(self._lean), 1.0, "rad"))
        return out

    def intervene(self, intervention: Intervention) -> None:
        """balance-lock is a spring and damper at the foot; step-suppression does nothing to a pendulum."""
        if intervention.action == "balance-lock":
            self._lock = intervention.strength

    def events(self) -> Sequence[TwinEvent]:
        """The fall, if it happened."""
        return tuple(self._events)

    def probes(self) -> Mapping[str, float]:
        """True lean and rate."""
        return {"lean_rad": self._lean, "rate_rad_s": self._rate}

    def close(self) -> None:
        """Nothing to free."""
