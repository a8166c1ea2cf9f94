"""People detector: rapid reach-in, gaze diversion, inattentiveness and posture lowering of each tracked human."""

from __future__ import annotations

from collections.abc import Sequence

from foreshock.detector import Detector, DetectorSpec, Input
from foreshock.hookspecs import hookimpl
from foreshock.messages import Gaze, Humans, Odometry
from foreshock_detectors._standstill import BODY_S, TRACKED_S
from foreshock_detectors.people._config import PeopleConfig

__all__ = ["PeopleConfig", "foreshock_detectors", "inputs"]


def inputs(config: PeopleConfig) -> tuple[Input, ...]:
    """``humans/pose``, one optional gaze per configured human, and the base where the workspace moves with it."""
    found = [Input("humans", "humans/pose", Humans, max_age_s=config.max_age_s, max_standstill_s=TRACKED_S)]
    found += [
        Input(name, f"{human}/gaze", Gaze, max_age_s=config.max_age_s, required=False, max_standstill_s=TRACKED_S)
        for name, human in config.gazes
    ]
    if config.workspace_frame == "base":
        found.append(Input("base", "base/odometry", Odometry, max_age_s=config.max_age_s, max_standstill_s=BODY_S))
    return tuple(found)


def _build(config: PeopleConfig) -> Detector:
    from foreshock_detectors.people._detector import PeopleDetector

    return PeopleDetector(config)


@hookimpl
def foreshock_detectors() -> Sequence[DetectorSpec]:
    """The people detector."""
    return (
        DetectorSpec(
            id="people",
            kinds=("rapid-reach-in", "gaze-diversion", "human-inattentiveness", "posture-lowering"),
            inputs=inputs,
            build=_build,
            config=PeopleConfig,
            warm_up_s=0.1,
            summary="what a human does beside the robot: reaching in fast, looking away, not looking, crouching",
        ),
    )
