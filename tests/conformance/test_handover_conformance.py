"""The handover detector behind the real supervisor."""

from __future__ import annotations

from collections.abc import Sequence

from handover_stream import Handover

from foreshock.records import Sample
from foreshock.testing import DetectorConformance
from foreshock_detectors import handover


class TestHandover(DetectorConformance):
    spec = handover.foreshock_detectors()[0]
    tick_s = 0.02

    def recording(self) -> Sequence[Sample]:
        """A partner who pulls 1.5 s early."""
        return Handover(arrives=1.3, pulls=1.5).samples(4.0)
