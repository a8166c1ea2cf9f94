"""The grip detector behind the real supervisor."""

from __future__ import annotations

import math
from collections.abc import Sequence

from test_grip import SPEC, G, Scene, ramp, step

from foreshock.records import Sample
from foreshock.testing import DetectorConformance
from foreshock_detectors import grip


class TestGripConformance(DetectorConformance):
    spec = SPEC
    config = grip.GripConfig()

    def recording(self) -> Sequence[Sample]:
        """A grasp of an object 40 % too heavy, that then slips, and a gripper that begins to shake."""
        scene = Scene(
            lambda t: 1.4 * G * ramp(t, 0.6, 0.3) - step(t, 2.2, 1.0),
            normal=lambda t: 30.0 + (1.5 * math.sin(20 * math.pi * t) if t > 2.6 else 0.0),
            command=lambda t: 30.0,
            grasping=lambda t: t >= 0.5,
        )
        return scene.samples(3.2, 200.0)
