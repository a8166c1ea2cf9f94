"""A human as head and hands from closed forms, with white tracker noise: no plant stands behind it."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from foreshock.messages import Capsule, Gaze, HumanPose, Humans
from foreshock.records import Sample

MS = 1_000_000
STATURE_M = 1.8
NOISE_M = 0.01
GAZE_NOISE_RAD = 0.05
PERIOD_MS = 20

Place = Callable[[float], tuple[float, float, float]]


def hanging(t: float) -> tuple[float, float, float]:
    """A hand at the side of somebody who stands at x = 0.9 m."""
    return (0.9, -0.3, 0.8)


def straight(begin: float, speed: float, start: float = 0.9, end: float = 0.2) -> Place:
    """A hand at workspace height that goes from x = start to end at constant speed, from begin on."""
    return lambda t: (max(end, start - speed * max(0.0, t - begin)), 0.0, 1.0)


def scene(
    until_s: float,
    *,
    hand: Place = hanging,
    lowered: Callable[[float], float] = lambda t: 0.0,
    angle: Callable[[float], float] = lambda t: 0.0,
    confidence: Callable[[float], float] = lambda t: 1.0,
    x: Callable[[float], float] = lambda t: 0.9,
    there: Callable[[float], bool] = lambda t: True,
    seed: int = 0,
) -> list[Sample]:
    """Poses and gaze at 50 Hz, 30 ms old; angle is between the gaze and the direction to the origin at 1 m height."""
    rng = np.random.default_rng(seed)
    out = []
    for k in range(int(until_s * 1000 / PERIOD_MS)):
        at = (k + 1) * PERIOD_MS * MS
        t = at * 1e-9

        def near(p: tuple[float, float, float]) -> tuple[float, float, float]:
            dx, dy, dz = NOISE_M * rng.standard_normal(3)
            return (p[0] + float(dx), p[1] + float(dy), p[2] + float(dz))

        top = near((x(t), 0.0, STATURE_M - 0.1 - lowered(t)))
        h = near(hand(t))
        capsules = (Capsule("face", (top[0], top[1], top[2] - 0.1), top, 0.1), Capsule("hand", h, h, 0.05))
        people = (HumanPose("human-1", capsules),) if there(t) else ()
        pitch = math.atan2(1.0 - (STATURE_M - 0.15 - lowered(t)), x(t)) + GAZE_NOISE_RAD * rng.standard_normal()
        yaw = math.pi + angle(t) + GAZE_NOISE_RAD * rng.standard_normal()
        look = (math.cos(pitch) * math.cos(yaw), math.cos(pitch) * math.sin(yaw), math.sin(pitch))
        gaze = Gaze("human-1", look, confidence(t))
        out.append(Sample(at, "talos/humans/pose", Humans(people), k, at + 30 * MS))
        out.append(Sample(at, "talos/human-1/gaze", gaze, k, at + 30 * MS))
    return out
