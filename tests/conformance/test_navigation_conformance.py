"""The navigation detector behind the real supervisor."""

from __future__ import annotations

from collections.abc import Sequence

from crossing_walkers import encounter
from test_navigation import ROBOT, SPEC, across

from foreshock.records import Sample
from foreshock.testing import DetectorConformance


class TestNavigationConformance(DetectorConformance):
    spec = SPEC
    tick_s = 0.02

    def recording(self) -> Sequence[Sample]:
        """A collision course through the meeting and beyond."""
        return encounter(ROBOT, across(), 8.0)
