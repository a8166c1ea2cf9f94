"""Streams of a held tool for the tool detector: motion by formulas of time, and noise of its own kinds."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from foreshock.messages import Capsule, HumanPose, Humans, Odometry, WrenchStamped
from foreshock.records import Sample

Signal = Callable[[float], float]
PERIOD_S = 0.01
ZERO: Signal = lambda t: 0.0  # noqa: E731
FAR: Signal = lambda t: 9.0  # noqa: E731


def turned(yaw: float) -> tuple[float, float, float, float]:
    return (0.0, 0.0, math.sin(0.5 * yaw), math.cos(0.5 * yaw))


def stream(
    duration_s: float,
    place: Signal = ZERO,
    path: Signal = ZERO,
    yaw: Signal = ZERO,
    yaw_command: Signal = ZERO,
    human_y: Signal = FAR,
    human_x: float = 0.8,
    torque: Signal = ZERO,
    kick: Signal = ZERO,
    seed: int = 0,
    latency_s: float = 0.012,
) -> list[Sample]:
    """Pose, command and wrenches at 100 Hz, people at 25 Hz, by arrival.

    place is the tip's y off its path, path the wanted y (m); yaw the axis off its command (rad); a human is a trunk of
    0.15 m radius at (human_x, human_y), the tip at (0.7, path + place). torque is what the process explains, kick what
    it does not (N m). The tip's noise is uniform and quantised at 0.2 mm, torque's is of Student with 4 degrees of
    freedom; one wrench in 400 is off by 5 N m.
    """
    rng, out = np.random.default_rng(seed), []
    for k in range(round(duration_s / PERIOD_S)):
        t = k * PERIOD_S
        stamp, arrival = round(t * 1e9), round((t + latency_s) * 1e9)
        mark = [round(x / 2e-4) * 2e-4 for x in rng.uniform(-4e-4, 4e-4, 3).tolist()]
        noise = (0.12 * rng.standard_t(4, 3)).tolist()
        spike = 5.0 if rng.random() < 0.0025 else 0.0
        at = (0.7 + mark[0], path(t) + place(t) + mark[1], 1.0 + mark[2])
        pose = Odometry(at, turned(yaw(t) + yaw_command(t)), (0.0,) * 3, (0.0,) * 3)
        rate = (yaw_command(t + 1e-5) - yaw_command(t - 1e-5)) / 2e-5
        wanted = Odometry((0.7, path(t), 1.0), turned(yaw_command(t)), (0.0,) * 3, (0.0, 0.0, rate))
        explained = torque(t)
        felt = (noise[0], noise[1], explained * (1.0 + 0.02 * math.sin(3.0 * t)) + kick(t) + noise[2] + spike)
        out.append(Sample(stamp, "talos/tool/odometry", pose, k, arrival))
        out.append(Sample(stamp, "talos/tool/command", wanted, k, stamp))
        out.append(Sample(stamp, "talos/tool/wrench", WrenchStamped((0.0,) * 3, felt), k, arrival))
        expected = WrenchStamped((0.0,) * 3, (0.0, 0.0, explained))
        out.append(Sample(stamp, "talos/tool/expected_wrench", expected, k, arrival))
        if k % 4 == 0:
            x, y = human_x + 0.01 * float(rng.normal()), human_y(t) + 0.01 * float(rng.normal())
            trunk = Capsule("chest", (x, y, 0.9), (x, y, 1.5), 0.15)
            out.append(Sample(stamp, "talos/humans/pose", Humans((HumanPose("h", (trunk,)),)), k // 4, arrival))
    return sorted(out, key=lambda s: s.received_ns)
