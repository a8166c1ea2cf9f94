"""The co-carry detector behind the real supervisor."""

from __future__ import annotations

from collections.abc import Sequence

from co_carry_stream import Carried

from foreshock.records import Sample
from foreshock.testing import DetectorConformance
from foreshock_detectors import co_carry


class TestCoCarry(DetectorConformance):
    spec = co_carry.foreshock_detectors()[0]
    tick_s = 0.02

    def recording(self) -> Sequence[Sample]:
        """From 3 s on the robot carries more than agreed, its end falls behind, and its grip with it."""

        def late(t: float) -> float:
            return 0.1 + min(max(t - 3.0, 0.0), 1.0)

        return Carried(
            share=lambda t: 0.5 + 0.25 * min(max(t - 3.0, 0.0), 1.0), lag=lambda t: 1.6 * late(t),
            grip_lag=lambda t: 1.6 * late(t),
        ).samples(6.0)  # fmt: skip
