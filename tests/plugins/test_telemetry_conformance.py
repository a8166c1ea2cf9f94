"""The telemetry detector behind the real supervisor."""

from __future__ import annotations

from collections.abc import Sequence

from test_telemetry import SPEC, message

from foreshock.records import Sample
from foreshock.testing import DetectorConformance
from foreshock_detectors import telemetry


class TestTelemetryConformance(DetectorConformance):
    spec = SPEC
    precursors = telemetry.foreshock_precursors()

    def recording(self) -> Sequence[Sample]:
        """Two channels; one is overtaken, then late for half a second, then silent for 0.2 s."""
        samples = [message(i, channel="imu/state") for i in range(600)]
        for i in range(600):
            if 460 <= i < 500:
                continue
            samples.append(message(i, 90.0 if 200 <= i < 400 else 14.0 if i == 100 else 3.0))
        return sorted(samples, key=lambda s: s.received_ns)
