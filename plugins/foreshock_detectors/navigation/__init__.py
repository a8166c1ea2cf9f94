"""Navigation detector: the ways of robot and human meet, they come together fast, they share too little room."""

from __future__ import annotations

from collections.abc import Sequence

from foreshock.detector import Detector, DetectorSpec, Input
from foreshock.hookspecs import hookimpl
from foreshock.messages import Humans, Odometry, PlannedPath
from foreshock_detectors._standstill import BODY_S, TRACKED_S
from foreshock_detectors.navigation._config import NavigationConfig

__all__ = ["NavigationConfig", "foreshock_detectors", "inputs"]


def inputs(config: NavigationConfig) -> tuple[Input, ...]:
    """Base, people, the robot's planned path, and the odometry of each limb of its own."""
    return (
        Input("odometry", "base/odometry", Odometry, config.max_age_s, max_standstill_s=BODY_S),
        Input("humans", "humans/pose", Humans, config.humans_max_age_s, max_standstill_s=TRACKED_S),
        Input("path", "plan/path", PlannedPath, config.path_max_age_s),
        *(
            Input(limb, f"{limb}/odometry", Odometry, config.max_age_s, max_standstill_s=BODY_S)
            for limb in config.limbs
        ),
    )


def _build(config: NavigationConfig) -> Detector:
    from foreshock_detectors.navigation._detector import NavigationDetector

    return NavigationDetector(config)


@hookimpl
def foreshock_detectors() -> Sequence[DetectorSpec]:
    """The navigation detector."""
    return (
        DetectorSpec(
            id="navigation",
            kinds=("path-convergence", "path-overlap", "high-approach-speed", "narrow-shared-space"),
            inputs=inputs,
            build=_build,
            config=NavigationConfig,
            warm_up_s=0.5,
            summary="paths that meet, approach that is too fast for the distance, too little room, per human",
        ),
    )
