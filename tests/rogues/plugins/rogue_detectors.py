"""One detector that keeps every rule, and detectors that each break one."""

from __future__ import annotations

import contextlib
import math
import multiprocessing
import random
import time
from collections.abc import Sequence
from time import monotonic

import msgspec
import numpy as np

from foreshock.detector import DetectorSpec, Input, Inputs
from foreshock.messages import Scalar
from foreshock.records import Indication, SampleRef


class Settings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    limit_n_m: float = 100.0
    release: float = 0.9


class Upright:
    """Torque against its limit, with hysteresis; a second channel only sharpens the measure."""

    def __init__(self, settings: Settings) -> None:
        self.settings = settings
        self.reset(0)

    def reset(self, seed: int) -> None:
        self.present = False
        self.updates = 0

    def update(self, now_ns: int, inputs: Inputs) -> Sequence[Indication]:
        self.updates += 1
        sample = inputs.latest["torque"]
        assert isinstance(sample.value, Scalar)
        return [self.judge(sample.channel, sample.stamp_ns, sample.value.data, inputs)]

    def judge(self, channel: str, stamp_ns: int, torque_n_m: float, inputs: Inputs) -> Indication:
        limit = self.settings.limit_n_m
        self.present = abs(torque_n_m) >= limit * (self.settings.release if self.present else 1.0)
        severity = min(1.0, abs(torque_n_m) / (2.0 * limit)) if self.present else 0.0
        speed = inputs.latest.get("speed")
        measures = {} if speed is None else {"speed_rad_s": speed.value.data}  # type: ignore[union-attr]
        ref = SampleRef(channel, stamp_ns)
        said = Indication("torque-saturation", "knee", stamp_ns, self.present, abs(torque_n_m), limit, "N m", severity)
        return msgspec.structs.replace(said, evidence=(ref,), measures=measures)


class Raises(Upright):
    def update(self, now_ns: int, inputs: Inputs) -> Sequence[Indication]:
        if self.updates == 50:
            raise ZeroDivisionError("at the fiftieth update")
        return super().update(now_ns, inputs)


class SaysNan(Upright):
    def update(self, now_ns: int, inputs: Inputs) -> Sequence[Indication]:
        (said,) = super().update(now_ns, inputs)
        return [msgspec.structs.replace(said, statistic=math.nan if said.present else 0.0)]


class Undeclared(Upright):
    def update(self, now_ns: int, inputs: Inputs) -> Sequence[Indication]:
        (said,) = super().update(now_ns, inputs)
        return [said, msgspec.structs.replace(said, kind="actuator-drift")]


class Prophet(Upright):
    def update(self, now_ns: int, inputs: Inputs) -> Sequence[Indication]:
        (said,) = super().update(now_ns, inputs)
        return [msgspec.structs.replace(said, stamp_ns=now_ns + 1_000_000_000)]


class NoEvidence(Upright):
    def update(self, now_ns: int, inputs: Inputs) -> Sequence[Indication]:
        (said,) = super().update(now_ns, inputs)
        return [msgspec.structs.replace(said, evidence=())]


class FalseEvidence(Upright):
    def update(self, now_ns: int, inputs: Inputs) -> Sequence[Indication]:
        (said,) = super().update(now_ns, inputs)
        return [msgspec.structs.replace(said, evidence=(SampleRef("talos/knee/torque", now_ns - 123),))]


class SpeaksOnlyWhenPresent(Upright):
    def update(self, now_ns: int, inputs: Inputs) -> Sequence[Indication]:
        return [i for i in super().update(now_ns, inputs) if i.present]


class AlwaysPresent(Upright):
    def update(self, now_ns: int, inputs: Inputs) -> Sequence[Indication]:
        return [msgspec.structs.replace(i, present=True) for i in super().update(now_ns, inputs)]


class ReadsClock(Upright):
    def update(self, now_ns: int, inputs: Inputs) -> Sequence[Indication]:
        time.monotonic_ns()
        return super().update(now_ns, inputs)


class ReadsClockByName(Upright):
    def update(self, now_ns: int, inputs: Inputs) -> Sequence[Indication]:
        monotonic()
        return super().update(now_ns, inputs)


class HidesClock(Upright):
    def update(self, now_ns: int, inputs: Inputs) -> Sequence[Indication]:
        with contextlib.suppress(RuntimeError):
            time.time()
        return super().update(now_ns, inputs)


class DrawsGlobally(Upright):
    def update(self, now_ns: int, inputs: Inputs) -> Sequence[Indication]:
        (said,) = super().update(now_ns, inputs)
        return [msgspec.structs.replace(said, statistic=said.statistic + 1e-9 * random.random())]


class DrawsUnseeded(Upright):
    def reset(self, seed: int) -> None:
        super().reset(seed)
        self.noise = np.random.default_rng()

    def update(self, now_ns: int, inputs: Inputs) -> Sequence[Indication]:
        (said,) = super().update(now_ns, inputs)
        return [msgspec.structs.replace(said, statistic=said.statistic + 1e-9 * self.noise.random())]


class ReadsFile(Upright):
    def update(self, now_ns: int, inputs: Inputs) -> Sequence[Indication]:
        with open(__file__) as f:  # noqa: PTH123 # this is what it must not do
            f.readline()
        return super().update(now_ns, inputs)


class Forgetless(Upright):
    """reset() leaves a count behind, which then shows."""

    count = 0

    def update(self, now_ns: int, inputs: Inputs) -> Sequence[Indication]:
        self.count += 1
        (said,) = super().update(now_ns, inputs)
        return [msgspec.structs.replace(said, measures={"count": float(self.count)})]


class EmptiesInputs(Upright):
    def update(self, now_ns: int, inputs: Inputs) -> Sequence[Indication]:
        said = super().update(now_ns, inputs)
        inputs.latest.clear()  # type: ignore[attr-defined]
        return said


class RewritesHistory(Upright):
    def __init__(self, settings: Settings) -> None:
        self.shared: dict[str, float] = {}
        super().__init__(settings)

    def update(self, now_ns: int, inputs: Inputs) -> Sequence[Indication]:
        (said,) = super().update(now_ns, inputs)
        self.shared["updates"] = float(self.updates)
        return [msgspec.structs.replace(said, measures=self.shared)]


class ClearsWithoutOptional(Upright):
    """Takes the optional channel's silence for a robot at rest."""

    def update(self, now_ns: int, inputs: Inputs) -> Sequence[Indication]:
        (said,) = super().update(now_ns, inputs)
        return [said if "speed" in inputs.latest else msgspec.structs.replace(said, present=False, severity=0.0)]


class NeedsOptional(Upright):
    def update(self, now_ns: int, inputs: Inputs) -> Sequence[Indication]:
        assert inputs.latest["speed"] is not None
        return super().update(now_ns, inputs)


class ConfusedByDuplicates(Upright):
    def update(self, now_ns: int, inputs: Inputs) -> Sequence[Indication]:
        stamps = [s.stamp_ns for s in inputs.new["torque"]]
        if len(stamps) != len(set(stamps)):
            raise ValueError("a stamp came twice")
        return super().update(now_ns, inputs)


class Slow(Upright):
    def update(self, now_ns: int, inputs: Inputs) -> Sequence[Indication]:
        sum(k * k for k in range(60_000))
        return super().update(now_ns, inputs)


class OtherInChild(Upright):
    """Judges by another limit where it runs isolated."""

    def update(self, now_ns: int, inputs: Inputs) -> Sequence[Indication]:
        (said,) = super().update(now_ns, inputs)
        child = multiprocessing.current_process().name == "foreshock-knee-torque"
        return [msgspec.structs.replace(said, threshold=said.threshold + child)]


INPUTS = (
    Input("torque", "knee/torque", Scalar, max_age_s=0.05, min_rate_hz=50.0),
    Input("speed", "knee/speed", Scalar, max_age_s=0.05, required=False),
)


def spec_of(build: type[Upright]) -> DetectorSpec:
    """Spec of one of the detectors above."""
    return DetectorSpec(
        "knee-torque", ("torque-saturation",), INPUTS, build, Settings, deadline_s=0.001, summary="knee torque"
    )
