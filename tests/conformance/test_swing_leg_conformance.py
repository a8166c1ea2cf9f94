"""The swing-leg detector behind the real supervisor."""

from __future__ import annotations

from collections.abc import Sequence

from gait_feet import walk
from test_swing_leg import SPEC, sideways

from foreshock.records import Sample
from foreshock.testing import DetectorConformance


class TestSwingLegConformance(DetectorConformance):
    spec = SPEC
    tick_s = 0.02

    def recording(self) -> Sequence[Sample]:
        """Seven seconds of walking; the left foot is pulled aside from 3.6 s on."""
        return sorted(walk(7.0, sideways(0.08, 3.6)), key=lambda s: max(s.received_ns, s.stamp_ns))
