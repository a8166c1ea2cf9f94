"""Vision detector: every perceptual kind of the paper, from tracked detections and image statistics."""

from __future__ import annotations

from collections.abc import Sequence

from foreshock.detector import Detector, DetectorSpec, Input
from foreshock.hookspecs import hookimpl
from foreshock.messages import Detections, ImageStatistics
from foreshock_detectors._standstill import TRACKED_S
from foreshock_detectors.vision._config import KINDS, VisionConfig

__all__ = ["VisionConfig", "foreshock_detectors", "inputs"]


def inputs(config: VisionConfig) -> tuple[Input, ...]:
    """``vision/detections`` for the kinds about tracks, ``camera/statistics`` for visual degradation.

    The statistics are optional beside detections: without them visual degradation alone is unobserved.
    """
    tracks = any(kind != "visual-degradation" for kind in config.kinds)
    found: tuple[Input, ...] = ()
    if tracks:
        found = (
            Input(
                "detections",
                "vision/detections",
                Detections,
                config.max_age_s,
                config.min_rate_hz,
                max_standstill_s=TRACKED_S,
            ),
        )
    if "visual-degradation" in config.kinds:
        statistics = Input("statistics", "camera/statistics", ImageStatistics, config.max_age_s, required=not tracks)
        found = (*found, statistics)
    return found


def _build(config: VisionConfig) -> Detector:
    from foreshock_detectors.vision._detector import VisionDetector

    return VisionDetector(config)


@hookimpl
def foreshock_detectors() -> Sequence[DetectorSpec]:
    """The vision detector."""
    return (
        DetectorSpec(
            id="vision",
            kinds=KINDS,
            inputs=inputs,
            build=_build,
            config=VisionConfig,
            warm_up_s=0.65,
            summary="occlusion, confidence, identity and class of tracked detections; quality of the camera image",
            reports=lambda config: config.kinds,
        ),
    )
