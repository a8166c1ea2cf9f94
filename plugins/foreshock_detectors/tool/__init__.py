"""Tool detector: oscillation of a tool's tip, its orientation towards people, and the stability of its hold."""

from __future__ import annotations

from collections.abc import Sequence

from foreshock.detector import Detector, DetectorSpec, Input
from foreshock.hookspecs import hookimpl
from foreshock.messages import Humans, Odometry, WrenchStamped
from foreshock_detectors._standstill import BODY_S, TRACKED_S
from foreshock_detectors.tool._config import ToolConfig

__all__ = ["SPEC", "ToolConfig", "foreshock_detectors", "inputs"]


def inputs(config: ToolConfig) -> tuple[Input, ...]:
    """Pose of the tool's tip and its command (required); people; wrist wrench and the one that the process explains.

    The poses are in one frame with the people; the tool's x axis is its working axis. Both wrenches are in the same
    axes. Without people the orientation is unobserved, without either wrench the stability.
    """
    tool, age = config.tool, config.max_age_s
    return (
        Input("pose", f"{tool}/odometry", Odometry, max_age_s=age, max_standstill_s=BODY_S),
        Input("command", f"{tool}/command", Odometry, max_age_s=age),
        Input(
            "humans",
            "humans/pose",
            Humans,
            max_age_s=config.humans_max_age_s,
            required=False,
            max_standstill_s=TRACKED_S,
        ),
        Input("wrench", f"{tool}/wrench", WrenchStamped, max_age_s=age, required=False, max_standstill_s=BODY_S),
        Input("expected", f"{tool}/expected_wrench", WrenchStamped, max_age_s=age, required=False),
    )


def _build(config: ToolConfig) -> Detector:
    from foreshock_detectors.tool._detector import ToolDetector

    return ToolDetector(config)


SPEC = DetectorSpec(
    id="tool",
    kinds=("tool-tip-oscillation", "unsafe-orientation", "loss-of-tool-stability"),
    inputs=inputs,
    build=_build,
    config=ToolConfig,
    deadline_s=0.002,
    warm_up_s=0.3,
    summary="oscillating tip, unsafe orientation and unstable hold of a tool, beside people",
)


@hookimpl
def foreshock_detectors() -> Sequence[DetectorSpec]:
    """The tool detector."""
    return (SPEC,)
