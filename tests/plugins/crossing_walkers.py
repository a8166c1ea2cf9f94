"""A robot and a human who walk by given functions of time, measured with noise: to test the navigation detector on."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from foreshock.messages import Capsule, HumanPose, Humans, Odometry, PlannedPath
from foreshock.records import Sample

Place = Callable[[float], tuple[float, float]]
"""x, y (m) at a time (s)."""
RADIUS_M = 0.25


def always(t: float) -> bool:  # a function of time
    return True


def straight(x: float, y: float, vx: float, vy: float) -> Place:
    """At (x, y) at time 0, constant velocity."""
    return lambda t: (x + vx * t, y + vy * t)


def encounter(
    robot: Place,
    human: Place,
    seconds: float,
    seed: int = 1,
    noise_m: float = 0.02,
    sight: Callable[[float], bool] = always,
    limb: Place | None = None,
) -> list[Sample]:
    """50 Hz odometry, 25 Hz people, 10 Hz plan of 3 s; the plan is the walk itself."""
    rng, samples = np.random.default_rng(seed), []

    def rate(place: Place, t: float) -> tuple[float, float]:
        (x0, y0), (x1, y1) = place(t - 0.05), place(t + 0.05)
        return (x1 - x0) / 0.1, (y1 - y0) / 0.1

    def odometry(place: Place, t: float, noise: float) -> Odometry:
        (x, y), (vx, vy) = place(t), rate(place, t)
        e = (noise * rng.standard_normal(4)).tolist()
        return Odometry(
            (x + e[0], y + e[1], 0.9), (0.0, 0.0, 0.0, 1.0), (vx + 5.0 * e[2], vy + 5.0 * e[3], 0.0), (0.0,) * 3
        )

    for k in range(1, round(seconds * 50.0) + 1):
        t, stamp = 0.02 * k, 20_000_000 * k
        samples.append(Sample(stamp, "talos/base/odometry", odometry(robot, t, 0.004), k))
        if limb is not None:
            samples.append(Sample(stamp, "talos/foot/odometry", odometry(limb, t, 0.004), k))
        if k % 5 == 1:
            ahead = [0.25 * i for i in range(13)]
            points = [robot(t + a) for a in ahead]
            xs, ys = tuple(p[0] for p in points), tuple(p[1] for p in points)
            samples.append(Sample(stamp, "talos/plan/path", PlannedPath(xs, ys, tuple(ahead)), k // 5))
        if k % 2 == 1:
            people: tuple[HumanPose, ...] = ()
            e = rng.standard_normal(4).tolist()
            if sight(t):
                (x, y), (vx, vy) = human(t), rate(human, t)
                x, y = x + noise_m * e[0], y + noise_m * e[1]
                trunk = Capsule("chest", (x, y, 0.9), (x, y, 1.5), RADIUS_M)
                velocity = (vx + 4.0 * noise_m * e[2], vy + 4.0 * noise_m * e[3], 0.0)
                people = (HumanPose("human-1", (trunk,), velocity, noise_m),)
            samples.append(Sample(stamp, "talos/humans/pose", Humans(people), k // 2))
    return samples
