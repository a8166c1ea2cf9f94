"""Runs of the MuJoCo twin: asks for actions at times, and says what was measured and what was true."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from pathlib import Path

import msgspec

from foreshock.records import Intervention, Sample
from foreshock_twins.mujoco import MujocoTwinConfig, build_twin
from foreshock_twins.mujoco._twin import MujocoTwin

TICK_NS = 5_000_000


class Seen(msgspec.Struct):
    """All samples of a run, the probes at each tick, and the ids of its events."""

    samples: list[Sample]
    truth: list[dict[str, float]]
    events: dict[str, float]

    @property
    def fell(self) -> bool:
        return "balance-lost" in self.events or "fall" in self.events

    def digest(self) -> str:
        return hashlib.sha256(msgspec.msgpack.encode(self.samples)).hexdigest()

    def values(self, channel: str) -> dict[int, object]:
        return {s.stamp_ns: s.value for s in self.samples if s.channel == f"talos/{channel}"}

    def over(self, name: str, begin_s: float, end_s: float) -> list[float]:
        return [p[name] for k, p in enumerate(self.truth) if begin_s <= (k + 1) * 0.005 <= end_s]


def new_twin(config: MujocoTwinConfig | None = None) -> MujocoTwin:
    twin = build_twin(config or MujocoTwinConfig(), "talos", Path())
    assert isinstance(twin, MujocoTwin)
    return twin


def run(
    twin: MujocoTwin,
    duration_s: float,
    asked: Sequence[tuple[float, str, float]] = (),
    seed: int = 1,
    **parameters: float,
) -> Seen:
    """Until the end, or 0.1 s after balance is lost; asked are (time, action, strength)."""
    twin.reset(parameters, seed)
    seen = Seen([], [], {})
    for k in range(round(duration_s / 0.005)):
        for at_s, action, strength in asked:
            if round(at_s / 0.005) == k:
                twin.intervene(Intervention(k * TICK_NS, action, strength))
        seen.samples += twin.advance((k + 1) * TICK_NS)
        seen.truth.append(dict(twin.probes()))
        if seen.truth[-1]["balance_lost"] and len(seen.truth) > 20 and seen.truth[-20]["balance_lost"]:
            break
    seen.events = {e.id: e.stamp_ns * 1e-9 for e in twin.events()}
    return seen
