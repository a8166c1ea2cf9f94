"""The restart detector keeps the contract of the port, on a late stop and a restart that nobody asked for."""

from __future__ import annotations

from collections.abc import Sequence

from restart_motion import ramp, stream

from foreshock.records import Sample
from foreshock.testing import DetectorConformance
from foreshock_detectors import restart


class TestRestartConformance(DetectorConformance):
    spec = restart.foreshock_detectors()[0]

    def recording(self) -> Sequence[Sample]:
        """Stop asked for at 1.5 s, standstill at 2.1 s, planned restart at 4 s, actual one at 2.6 s."""

        def speed(t: float) -> float:
            if t < 2.5:
                return 0.5 * min(1.0, max(0.0, (2.1 - t) / 0.6))
            return ramp(t, 2.6, 3.0, 0.6) if t < 3.6 else 0.0

        return stream(
            speed, lambda t: 0.5 if t < 1.5 else 0.0, 4.5, stop=lambda t: t >= 1.5, enabled=lambda t: t < 1.5,
            phase=lambda t: (0, 1.5 - t) if t < 1.5 else (1, 4.0 - t),
        )  # fmt: skip
