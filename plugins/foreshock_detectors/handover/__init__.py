"""Handover detector: the partner takes hold at another time than the robot's plan has it."""

from __future__ import annotations

from collections.abc import Sequence

from foreshock.detector import Detector, DetectorSpec, Input
from foreshock.hookspecs import hookimpl
from foreshock.messages import Humans, TaskPhase, WrenchStamped
from foreshock_detectors._standstill import BODY_S, TRACKED_S
from foreshock_detectors.handover._config import HandoverConfig

__all__ = ["HandoverConfig", "foreshock_detectors", "inputs"]


def inputs(config: HandoverConfig) -> tuple[Input, ...]:
    """The plan, the wrist's wrench and the humans; without any of them neither early nor late can be told."""
    age = config.max_age_s
    return (
        Input("plan", "plan/handover", TaskPhase, max_age_s=age),
        Input("wrench", "right_wrist/wrench", WrenchStamped, max_age_s=age, max_standstill_s=BODY_S),
        Input("humans", "humans/pose", Humans, max_age_s=age, max_standstill_s=TRACKED_S),
    )


def _build(config: HandoverConfig) -> Detector:
    from foreshock_detectors.handover._detector import HandoverDetector

    return HandoverDetector(config)


@hookimpl
def foreshock_detectors() -> Sequence[DetectorSpec]:
    """The handover detector."""
    return (
        DetectorSpec(
            id="handover",
            kinds=("timing-mismatch",),
            inputs=inputs,
            build=_build,
            config=HandoverConfig,
            warm_up_s=0.1,
            summary="a partner who takes hold earlier or later than the handover's plan has it",
        ),
    )
