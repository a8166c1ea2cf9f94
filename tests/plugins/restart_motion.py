"""Streams of a motion, its command and its plan, from closed forms: no plant stands behind them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from foreshock.messages import JointState, MotionCommand, TaskPhase
from foreshock.records import Sample

MS = 1_000_000
LEVER_M = 0.7
SPEED_NOISE_M_S = 0.005

Curve = Callable[[float], float]


def ramp(t: float, begin: float, acceleration: float, top: float) -> float:
    """Speed that rises linearly from begin on."""
    return min(top, max(0.0, acceleration * (t - begin)))


def stream(
    speed: Curve,
    command: Curve,
    until_s: float,
    *,
    enabled: Callable[[float], bool] = lambda t: True,
    stop: Callable[[float], bool] = lambda t: False,
    phase: Callable[[float], tuple[int, float]] | None = None,
    seed: int = 0,
    period_ms: int = 10,
) -> list[Sample]:
    """Samples of all channels by arrival, the motion 5 ms old; phase gives (number, due in s), None sends none."""
    rng = np.random.default_rng(seed)
    out = []
    for k in range(int(until_s * 1000 / period_ms)):
        at = (k + 1) * period_ms * MS
        t = at * 1e-9
        rate = (speed(t) + SPEED_NOISE_M_S * rng.standard_normal()) / LEVER_M
        out += [
            Sample(at, "talos/motion/command", MotionCommand(enabled(t), stop(t), command(t)), k, at),
            Sample(at, "talos/joints/state", JointState(("arm_right_1_joint",), (0.0,), (rate,)), k, at + 5 * MS),
        ]
        if phase is not None:
            out.append(Sample(at, "talos/task/phase", TaskPhase(*phase(t)), k, at))
    return sorted(out, key=lambda s: s.received_ns)
