"""Streams of a held object for the load detector: motion by formulas of time, and coloured sensor noise."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from foreshock.messages import Imu, Odometry
from foreshock.records import Sample

Signal = Callable[[float], float]
STILL: Signal = lambda t: 0.0  # noqa: E731


def about_y(angle: float, roll: float = 0.0, yaw: float = 0.0) -> tuple[float, float, float, float]:
    """Quaternion (x, y, z, w) of a pitch, after small rotations about x and z."""
    x, y, z, w = 0.5 * roll, math.sin(0.5 * angle), 0.5 * yaw, math.cos(0.5 * angle)
    norm = math.sqrt(x * x + y * y + z * z + w * w)
    return (x / norm, y / norm, z / norm, w / norm)


def derivative(f: Signal, t: float) -> float:
    return (f(t + 1e-5) - f(t - 1e-5)) / 2e-5


def stream(
    duration_s: float,
    wrist: Signal = STILL,
    tilt: Signal = STILL,
    command: Signal = STILL,
    yaw: Signal = STILL,
    seed: int = 0,
    rate_hz: float = 100.0,
    latency_s: float = 0.012,
) -> list[Sample]:
    """IMU at rate_hz, object and command at half of it, by arrival.

    wrist is the wrist's angle off its command, tilt the object's, both rad about y; yaw turns the object about the
    vertical. Noise: the gyro's has a correlation of 0.5 from sample to sample and a bias of 0.004 rad/s that wanders,
    the camera's is Laplace-distributed, with one frame in 500 off by 0.1 rad.
    """
    rng, out = np.random.default_rng(seed), []
    n = round(duration_s * rate_hz)
    coloured, white, bias = np.zeros(3), rng.normal(0.0, 0.0043, (n, 3)), 0.004
    for k in range(n):
        t = k / rate_hz
        stamp, arrival = round(t * 1e9), round((t + latency_s) * 1e9)
        coloured = 0.5 * coloured + white[k]
        bias += rng.normal(0.0, 1e-5)
        gyro = coloured + np.array((bias, derivative(lambda u: wrist(u) + command(u), t), -bias))
        imu = Imu(about_y(wrist(t) + command(t)), tuple(gyro.tolist()), (0.0, 0.0, 9.81))
        out.append(Sample(stamp, "talos/left_gripper/imu", imu, k, arrival))
        if k % 2:
            continue
        noise = rng.laplace(0.0, 0.003, 3).tolist()
        if rng.random() < 0.002:
            noise = [x + 0.1 for x in noise]
        seen = about_y(tilt(t) + command(t) + noise[0], noise[1], yaw(t) + noise[2])
        pose = Odometry((0.5, 0.0, 1.0), seen, (0.0,) * 3, (0.0,) * 3)
        out.append(Sample(stamp, "talos/left_gripper/object", pose, k // 2, arrival))
        wanted = Odometry((0.5, 0.0, 1.0), about_y(command(t)), (0.0,) * 3, (0.0, derivative(command, t), 0.0))
        out.append(Sample(stamp, "talos/left_gripper/object_command", wanted, k // 2, stamp))
    return sorted(out, key=lambda s: s.received_ns)
