"""Restart detector: abrupt and unexpected starts, delayed stops, overshoot after a start, starts and stops off plan."""

from __future__ import annotations

from collections.abc import Sequence

from foreshock.detector import Detector, DetectorSpec, Input
from foreshock.hookspecs import hookimpl
from foreshock.messages import JointState, MotionCommand, Odometry, TaskPhase
from foreshock_detectors._standstill import BODY_S
from foreshock_detectors.restart._config import RestartConfig

__all__ = ["RestartConfig", "foreshock_detectors", "inputs"]


def inputs(config: RestartConfig) -> tuple[Input, ...]:
    """The measured motion and its command; the plan's phase is optional, without it nothing is said of timing."""
    if config.motion == "odometry":
        motion = Input("motion", "base/odometry", Odometry, max_age_s=config.max_age_s, max_standstill_s=BODY_S)
    else:
        motion = Input("motion", "joints/state", JointState, max_age_s=config.max_age_s, max_standstill_s=BODY_S)
    return (
        motion,
        Input("command", "motion/command", MotionCommand, max_age_s=config.max_age_s),
        Input("phase", "task/phase", TaskPhase, max_age_s=config.max_age_s, required=False),
    )


def _build(config: RestartConfig) -> Detector:
    from foreshock_detectors.restart._detector import RestartDetector

    return RestartDetector(config)


@hookimpl
def foreshock_detectors() -> Sequence[DetectorSpec]:
    """The restart detector."""
    return (
        DetectorSpec(
            id="restart",
            kinds=(
                "abrupt-motion-onset", "unexpected-restart", "delayed-stop", "restart-overshoot", "timing-mismatch",
            ),
            inputs=inputs,
            build=_build,
            config=RestartConfig,
            summary="starts that are abrupt, not permitted or too fast, stops that come late, both off the plan",
        ),
    )  # fmt: skip
