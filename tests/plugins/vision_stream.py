"""Streams of detections and image statistics for tests, from a generator that knows nothing of the plants.

Confidence scatters as Student's t with four degrees of freedom (heavy tails) about its course; positions by 15 mm;
visible shares by 0.03; one detection in 200 is missed.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import msgspec
import numpy as np

from foreshock.messages import Detection, Detections, ImageStatistics
from foreshock.records import Sample

__all__ = ["Thing", "always", "frames", "named", "pictures"]

Course = Callable[[float], float]


def always(value: float) -> Course:
    """A course that stays."""
    return lambda t: value


CONTRAST, SHARPNESS, LUMINANCE, SATURATED = always(0.25), always(0.8), always(0.5), always(0.01)


class Thing(msgspec.Struct, frozen=True):
    """Something that a camera follows; all as functions of time (s)."""

    id: Callable[[float], str]
    class_id: Callable[[float], str]
    x: Course = always(2.0)
    y: Course = always(0.0)
    confidence: Course = always(0.9)
    visible: Course = always(1.0)
    there: Callable[[float], bool] = lambda t: True


def named(name: str, class_id: str, **courses: Callable[[float], float]) -> Thing:
    """A thing whose id and class stay."""
    return Thing(lambda t: name, lambda t: class_id, **courses)  # type: ignore[arg-type]


def frames(
    things: Sequence[Thing], seconds: float, rate_hz: float = 50.0, seed: int = 0, missed: float = 0.005
) -> list[Sample]:
    """``talos/vision/detections``."""
    rng = np.random.default_rng(seed)
    out = []
    for k in range(round(seconds * rate_hz)):
        t, found = (k + 1) / rate_hz, []
        for thing in things:
            scatter, place, share = 0.015 * rng.standard_t(4), 0.015 * rng.standard_normal(3), rng.standard_normal()
            if not thing.there(t) or rng.random() < missed:
                continue
            found.append(
                Detection(
                    thing.id(t),
                    thing.class_id(t),
                    float(np.clip(thing.confidence(t) + scatter, 0.0, 1.0)),
                    (float(thing.x(t) + place[0]), float(thing.y(t) + place[1]), float(1.0 + place[2])),
                    (0.3, 0.3, 0.3),
                    float(np.clip(thing.visible(t) + 0.03 * share, 0.0, 1.0)),
                )
            )
        out.append(Sample(round(1e9 * t), "talos/vision/detections", Detections(tuple(found)), k))
    return out


def pictures(
    seconds: float,
    contrast: Course = CONTRAST,
    sharpness: Course = SHARPNESS,
    luminance: Course = LUMINANCE,
    saturated: Course = SATURATED,
    rate_hz: float = 50.0,
    seed: int = 1,
) -> list[Sample]:
    """``talos/camera/statistics``, with 3 % of noise that is correlated over some 20 frames."""
    rng, slow = np.random.default_rng(seed), np.zeros(2)
    out = []
    for k in range(round(seconds * rate_hz)):
        t = (k + 1) / rate_hz
        slow = 0.95 * slow + np.sqrt(1.0 - 0.95**2) * 0.03 * rng.standard_normal(2)
        value = ImageStatistics(
            float(np.clip(luminance(t), 0.0, 1.0)),
            float(np.clip(contrast(t) * (1.0 + slow[0]), 0.0, 1.0)),
            float(np.clip(sharpness(t) * (1.0 + slow[1]), 0.0, 1.0)),
            float(np.clip(saturated(t), 0.0, 1.0)),
        )
        out.append(Sample(round(1e9 * t), "talos/camera/statistics", value, k))
    return out
