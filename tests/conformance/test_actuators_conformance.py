"""The actuators detector behind the real supervisor."""

from __future__ import annotations

from collections.abc import Sequence

from actuator_stream import stream

from foreshock.records import Sample
from foreshock.testing import DetectorConformance
from foreshock_detectors.actuators import SPEC


class TestActuatorsConformance(DetectorConformance):
    spec = SPEC

    def recording(self) -> Sequence[Sample]:
        """The limit falls below the load at 2 s, and the joint sinks at 0.3 rad/s."""
        limit = lambda t: 57.6 if t < 2.0 else 15.0  # noqa: E731  # one expression
        rows = stream(4.0, limit=limit, off=lambda t: -0.3 * min(max(0.0, t - 2.1), 0.5))
        return [sample for row in rows for sample in row]
