"""The load detector keeps the contract of the port, on an object that tilts in the grip of a wrist that then shakes."""

from __future__ import annotations

import math
from collections.abc import Sequence

from load_stream import stream

from foreshock.records import Sample
from foreshock.testing import DetectorConformance
from foreshock_detectors.load import SPEC


class TestLoad(DetectorConformance):
    spec = SPEC

    def recording(self) -> Sequence[Sample]:
        """The object tilts by 0.1 rad from 1.5 s on; the wrist shakes with 0.4 rad/s at 20 Hz from 2.5 s on."""
        return stream(
            4.0,
            wrist=lambda t: 0.0032 * math.sin(125.7 * t) if t > 2.5 else 0.0,
            tilt=lambda t: 0.1 * min(max((t - 1.5) / 0.8, 0.0), 1.0),
        )
