"""The people detector keeps the contract of the port, on a human who looks away, reaches in and crouches."""

from __future__ import annotations

from collections.abc import Sequence

from people_scene import scene, straight

from foreshock.records import Sample
from foreshock.testing import DetectorConformance
from foreshock_detectors import people


class TestPeopleConformance(DetectorConformance):
    spec = people.foreshock_detectors()[0]

    def recording(self) -> Sequence[Sample]:
        """Away from 1 s to 4.5 s, a fast hand at 3.6 s, a crouch from 3.3 s to 4.6 s."""
        return scene(
            5.5,
            angle=lambda t: 1.3 if 1.0 <= t < 4.5 else 0.0,
            hand=straight(3.6, 3.0),
            lowered=lambda t: min(0.4, max(0.0, t - 3.0)) if t < 4.6 else 0.0,
        )
