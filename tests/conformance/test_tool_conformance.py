"""The tool detector keeps the contract of the port, on a tool that chatters, swings towards a human and bites."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import ClassVar

from tool_stream import stream

from foreshock.records import Sample
from foreshock.testing import DetectorConformance
from foreshock_detectors.tool import SPEC


class TestTool(DetectorConformance):
    spec = SPEC
    omits: ClassVar = {"loss-of-tool-stability": "needs a full window of both wrenches, which begins anew after a loss"}

    def recording(self) -> Sequence[Sample]:
        """Chatter at 6 Hz from 1.5 s, 0.3 rad aside from 2 s, and 5 N m that nothing explains from 2.5 s on."""
        return stream(
            4.0,
            place=lambda t: 0.015 * math.sin(37.7 * t) if t > 1.5 else 0.0,
            yaw=lambda t: 0.3 * min(max((t - 2.0) / 0.4, 0.0), 1.0),
            human_y=lambda t: 0.6,
            torque=lambda t: 6.0,
            kick=lambda t: 5.0 if t > 2.5 else 0.0,
        )
