"""The balance detector keeps the contract of the port, on TALOS standing, slipping, turning and swaying."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import ClassVar

from balance_motion import Motion, smooth_step

from foreshock.records import Sample
from foreshock.testing import DetectorConformance
from foreshock_detectors.balance import SPEC


class TestBalance(DetectorConformance):
    spec = SPEC
    omits: ClassVar = {
        "sway-amplitude-increase": "an amplitude needs a full window, unless it is already too large before",
    }

    def recording(self) -> Sequence[Sample]:
        """From 2.2 s on the left foot slides 6 mm, the torso rolls by 0.15 rad and the CoM swings by up to 60 mm."""
        motion = Motion(
            com_y=lambda t: 0.06 * smooth_step(t, 2.2, 0.6) * math.sin(1.4 * math.pi * (t - 2.2)),
            theta=lambda t: 0.15 * smooth_step(t, 2.7, 0.3),
            left_y=lambda t: 0.006 * smooth_step(t, 2.6, 0.15),
            plan_y=lambda t: 0.0,
        )
        instants = list(motion.samples(4.5, 0.005))
        return [s for samples in instants for s in samples.values()]
