"""The recovery detector behind the real supervisor."""

from __future__ import annotations

from collections.abc import Sequence

from recovery_motion import Motion, pulse

from foreshock.records import Sample
from foreshock.testing import DetectorConformance
from foreshock_detectors.recovery import SPEC


class TestRecoveryConformance(DetectorConformance):
    spec = SPEC

    def recording(self) -> Sequence[Sample]:
        """Two seconds of standing, then one swing of arms and trunk with a human in reach."""
        turn = pulse(2.5, 1.8)
        motion = Motion({"shoulder": pulse(2.4, 2.5), "hip": turn}, gyro=turn, hand_speed=pulse(2.5, 2.0))
        return [sample for k in range(400) for sample in motion.samples(k).values()]
