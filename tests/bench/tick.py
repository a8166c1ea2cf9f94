"""CPU time of a tick with all four detectors on TALOS, beside the bare library calls that they make."""

from __future__ import annotations

import math
import statistics
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import msgspec
import numpy as np

from foreshock.messages import GripState
from foreshock.records import Sample
from foreshock.registry import Registry
from foreshock.session.isolated import build_twin
from foreshock.session.scenario import find_scenario
from foreshock.supervisor import Supervisor
from tests.bench.calls import recorded
from tests.bench.rows import Row

__all__ = ["rows"]

PERIOD_NS = 5_000_000
SECONDS = 12
DETECTORS = ("balance", "grip", "proximity", "telemetry")


def grip_samples(ticks: int) -> list[Sample]:
    """A hand that holds 1 kg through the sway of stepping, with sensor noise of 0.1 N."""
    rng = np.random.default_rng(7)
    out = []
    for k in range(1, ticks + 1):
        t = k * PERIOD_NS * 1e-9
        a = 0.4 * math.sin(2 * math.pi * t / 0.6)
        tangential = 1.0 * (9.81 + a) + 0.1 * rng.standard_normal()
        state = GripState(True, 25.0 + 0.1 * rng.standard_normal(), tangential, 0.04, 25.0, 1.0, a)
        out.append(Sample(k * PERIOD_NS, "talos/left_gripper/state", state, k - 1, k * PERIOD_NS))
    return out


def stream() -> list[list[Sample]]:
    """What arrives in each tick of nominal stepping beside a human, with a grip channel added."""
    registry = Registry()
    scenario = find_scenario("a1-fall-onto-human-nominal", registry)
    with tempfile.TemporaryDirectory() as scratch:
        twin = build_twin(scenario, registry, Path(scratch))
        twin.reset(scenario.parameters, 3)
        ticks = SECONDS * 200
        grips = grip_samples(ticks)
        out = [[*twin.advance((k + 1) * PERIOD_NS), grips[k]] for k in range(ticks)]
        twin.close()
    return out


def supervisor(grip_backend: str) -> Supervisor:
    """All four detectors; the human template has 14 capsules and the robot is fitted with 20."""
    base = find_scenario("a1-fall-onto-human-nominal", Registry())
    grip = {"use": "grip", "config": {"backend": grip_backend}}
    detectors = [grip if name == "grip" else {"use": name} for name in DETECTORS]
    return Supervisor(msgspec.structs.replace(base, config={**base.config, "detectors": detectors}).supervisor())


def tick_us(judge: Supervisor, ticks: Sequence[Sequence[Sample]]) -> float:
    """Median CPU time of a tick, after warm-up."""
    judge.reset(0)
    spent = []
    for k, samples in enumerate(ticks):
        begin = time.process_time_ns()
        judge.step(samples, (k + 1) * PERIOD_NS)
        spent.append(time.process_time_ns() - begin)
    return statistics.median(spent[600:]) / 1e3


def rows() -> list[Row]:
    """One row per form of the grip filter."""
    ticks = stream()
    found = []
    for backend in ("scalar", "filterpy"):
        judge = supervisor(backend)
        with recorded() as calls:
            judge.reset(0)
            for k, samples in enumerate(ticks):
                judge.step(samples, (k + 1) * PERIOD_NS)
        bare = calls.cost_us(len(ticks))
        reference = sum(bare.values())
        value = statistics.median(tick_us(judge, ticks) for _ in range(3))
        ratio = value / reference
        largest = sorted(bare.items(), key=lambda i: -i[1])[:4]
        names = ", ".join(f"{name.rpartition('.')[2]} {us:.1f}" for name, us in largest)
        found.append(
            Row(
                f"tick of four detectors, TALOS, 20 x 14 capsules, {backend} grip filter",
                value,
                "us CPU",
                reference,
                f"sum of the bare library calls ({names}, ...)",
                ratio,
                "< 1.5 x and < 200 us",
                ratio < 1.5 and value < 200.0,
            )
        )
    return found
