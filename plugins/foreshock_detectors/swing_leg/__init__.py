"""Swing-leg detector: a swing foot that leaves its planned path."""

from __future__ import annotations

from collections.abc import Sequence

from foreshock.detector import Detector, DetectorSpec, Input
from foreshock.hookspecs import hookimpl
from foreshock.messages import MotionPlan, Odometry
from foreshock_detectors._standstill import BODY_S
from foreshock_detectors.swing_leg._config import SwingLegConfig

__all__ = ["SwingLegConfig", "foreshock_detectors", "inputs"]


def inputs(config: SwingLegConfig) -> tuple[Input, ...]:
    """Measured and planned motion of each foot, and which of them the plan loads."""
    return (
        Input("plan", "plan/motion", MotionPlan, config.max_age_s, config.min_rate_hz),
        *(
            Input(name, channel, Odometry, config.max_age_s, config.min_rate_hz, max_standstill_s=standstill_s)
            for foot in config.feet
            for name, channel, standstill_s in (
                (foot, f"{foot}_foot/odometry", BODY_S),
                (f"{foot}-plan", f"{foot}_foot/plan", 0.0),
            )
        ),
    )


def _build(config: SwingLegConfig) -> Detector:
    from foreshock_detectors.swing_leg._detector import SwingLegDetector

    return SwingLegDetector(config)


@hookimpl
def foreshock_detectors() -> Sequence[DetectorSpec]:
    """The swing-leg detector."""
    return (
        DetectorSpec(
            id="swing-leg",
            kinds=("swing-leg-drift",),
            inputs=inputs,
            build=_build,
            config=SwingLegConfig,
            warm_up_s=0.2,
            summary="swing foot off its planned path, per foot",
        ),
    )
