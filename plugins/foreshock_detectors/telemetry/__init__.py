"""Telemetry detector: latency spikes, delay, dropout and reordering on the links that samples come by."""

from __future__ import annotations

from collections.abc import Sequence

from foreshock.detector import Detector, DetectorSpec, Input
from foreshock.hookspecs import hookimpl
from foreshock.messages import Message
from foreshock.taxonomy import PrecursorKind
from foreshock_detectors.telemetry._config import TelemetryConfig

__all__ = ["TelemetryConfig", "foreshock_detectors", "foreshock_precursors"]


def _build(config: TelemetryConfig) -> Detector:
    from foreshock_detectors.telemetry._detector import TelemetryDetector

    return TelemetryDetector(config)


@hookimpl
def foreshock_detectors() -> Sequence[DetectorSpec]:
    """The telemetry detector. Its input is optional, since it must speak when everything is silent."""
    return (
        DetectorSpec(
            id="telemetry",
            kinds=("control-latency-spike", "communication-delay", "message-dropout", "message-reordering"),
            inputs=(Input("any", "*", Message, required=False),),
            build=_build,
            config=TelemetryConfig,
            warm_up_s=0.3,
            summary="latency spikes, delay, dropout and reordering per communication link",
        ),
    )


@hookimpl
def foreshock_precursors() -> Sequence[PrecursorKind]:
    """Two kinds that the paper does not name; its systems class has communication delay alone."""
    source = "Foreshock: loss and incorrect sequence are communication errors of IEC 61784-3, as is the paper's delay"
    return (
        PrecursorKind("message-dropout", "Message dropout", "system-telemetry", source, ("A9", "A12")),
        PrecursorKind("message-reordering", "Message reordering", "system-telemetry", source, ("A9", "A12")),
    )
