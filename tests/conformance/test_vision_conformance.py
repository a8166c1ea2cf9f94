"""The vision detector behind the real supervisor, on a person who hides and an arm that is taken for a tool in fog."""

from __future__ import annotations

import math
from collections.abc import Sequence

from vision_stream import Thing, frames, named, pictures

from foreshock.records import Sample
from foreshock.testing import DetectorConformance
from foreshock_detectors import vision


class TestVision(DetectorConformance):
    spec = vision.foreshock_detectors()[0]
    tick_s = 0.02

    def recording(self) -> Sequence[Sample]:
        """From 2 s on person and hand are hidden, confidence falls, an id and a class change, fog comes in."""
        fall = lambda t: 0.9 - 0.6 * min(max(t - 2.0, 0.0) / 0.3, 1.0)  # noqa: E731
        things = [
            named("p1", "human", x=lambda t: 4.0, visible=lambda t: 1.0 if t < 2.0 else 0.3),
            named("hand", "hand", visible=lambda t: 1.0 if t < 2.1 else 0.2),
            Thing(
                lambda t: "arm" if t < 2.2 else "arm-2",
                lambda t: "forearm" if t < 2.1 else "tool",
                x=lambda t: 1.0,
                confidence=fall,
            ),
        ]
        fog = lambda t: 0.25 * math.exp(-2.0 * max(t - 2.0, 0.0))  # noqa: E731
        samples = [*frames(things, 3.5), *pictures(3.5, contrast=fog)]
        return sorted(samples, key=lambda s: s.stamp_ns)
