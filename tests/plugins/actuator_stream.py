"""Streams of a joint that follows its command by a first-order lag, with a drive that clips: no supply, no queue."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from foreshock.messages import JointState
from foreshock.records import Sample

STEP_NS = 20_000_000
Course = Callable[[float], float]


def still(_: float) -> float:
    """Nothing."""
    return 0.0


def stream(
    seconds: float,
    command: Course = still,
    torque: Course = lambda _: 25.0,
    limit: Course = lambda _: 57.6,
    off: Course = still,
    lag_s: float = 0.02,
    seed: int = 0,
) -> list[list[Sample]]:
    """State and command of each 20 ms.

    Args:
        seconds: length.
        command: commanded position (rad) over time.
        torque: commanded torque (N m).
        limit: what the drive can give (N m).
        off: what is added to the joint's position (rad).
        lag_s: of the joint behind its command; beside it the encoder has 0.3 mrad of noise, the torque 0.4 N m.
        seed: of the noise.
    """
    rng = np.random.default_rng(seed)
    at, out = command(0.0), []
    for k in range(round(seconds * 50)):
        t, stamp = k * 0.02, (k + 1) * STEP_NS
        at += 0.02 / (lag_s + 0.02) * (command(t) - at)
        asked, z = torque(t), rng.standard_normal(2).tolist()
        given = max(-limit(t), min(limit(t), asked)) + 0.4 * z[0]
        state = JointState(("wrist", "elbow"), (0.1, at + off(t) + 0.0003 * z[1]), (0.0, 0.0), (1.0, given))
        order = JointState(("elbow", "wrist"), (command(t), 0.1), (0.0, 0.0), (asked, 1.0))
        out.append([Sample(stamp, "talos/joints/state", state, k), Sample(stamp, "talos/joints/command", order, k)])
    return out
