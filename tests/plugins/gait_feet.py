"""Feet that step by a cycloid, measured with noise and latency: a walk to test detectors of the swing leg on."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from foreshock.messages import MotionPlan, Odometry, Vec3
from foreshock.records import Sample

SIDES = ("left", "right")
LEVEL = (0.0, 0.0, 0.0, 1.0)
STRIDE_S, SWING_S, STRIDE_M = 1.2, 0.5, 0.6
Deviation = Callable[[str, float], Vec3]
"""Of foot and time: how far the foot is off its plan (m)."""


def none(side: str, t: float) -> Vec3:  # a Deviation
    return (0.0, 0.0, 0.0)


def swings(side: str, t: float) -> bool:
    return 0.0 <= _phase(side, t)[1] < SWING_S


def _phase(side: str, t: float) -> tuple[int, float]:
    shifted = t - (0.0 if side == "left" else 0.5 * STRIDE_S)
    k = math.floor(shifted / STRIDE_S)
    return k, shifted - k * STRIDE_S


def planned(side: str, t: float, aside: Callable[[float], float] = lambda t: 0.0) -> Vec3:
    """The planned place: a cycloid over the stride, its plan aside by a function of time."""
    k, u = _phase(side, t)
    share = min(1.0, u / SWING_S)
    x = STRIDE_M * (k + share - math.sin(2.0 * math.pi * share) / (2.0 * math.pi))
    z = 0.02 * (1.0 - math.cos(2.0 * math.pi * share))
    return x, (0.1 if side == "left" else -0.1) + aside(t), z


def walk(
    seconds: float,
    deviation: Deviation = none,
    seed: int = 1,
    noise_m: float = 0.003,
    latency_s: float = 0.015,
    rate_hz: float = 50.0,
    aside: Callable[[float], float] = lambda t: 0.0,
) -> list[Sample]:
    """Samples by arrival: plan without delay, feet with noise and latency."""
    rng = np.random.default_rng(seed)
    samples = []
    for k in range(1, round(seconds * rate_hz) + 1):
        t = k / rate_hz
        now, then = round(t * 1e9), t - latency_s
        for side in SIDES:
            plan = planned(side, t, aside)
            rate = _rate(lambda s, side=side: planned(side, s, aside), t)
            samples.append(Sample(now, f"talos/{side}_foot/plan", Odometry(plan, LEVEL, rate, (0.0,) * 3), k))
        support = tuple(side for side in SIDES if not swings(side, t))
        samples.append(Sample(now, "talos/plan/motion", MotionPlan((0.0, 0.0, 0.8), support), k))
        for side in SIDES:
            at = (
                np.array(planned(side, then, aside))
                + np.array(deviation(side, then))
                + noise_m * rng.standard_normal(3)
            )
            place = Odometry(tuple(at.tolist()), LEVEL, (0.0,) * 3, (0.0,) * 3)
            samples.append(Sample(round(then * 1e9), f"talos/{side}_foot/odometry", place, k, now))
    return samples


def _rate(at: Callable[[float], Vec3], t: float) -> Vec3:
    before, after = at(t - 1e-4), at(t + 1e-4)
    x, y, z = ((b - a) / 2e-4 for a, b in zip(before, after, strict=True))
    return x, y, z


def by_tick(samples: Sequence[Sample]) -> list[tuple[int, list[Sample]]]:
    """Samples grouped by arrival."""
    ticks: dict[int, list[Sample]] = {}
    for s in samples:
        ticks.setdefault(s.received_ns if s.received_ns >= 0 else s.stamp_ns, []).append(s)
    return sorted(ticks.items())
