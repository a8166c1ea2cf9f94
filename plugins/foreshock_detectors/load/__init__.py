"""Load detector: instability of the wrist that holds an object, and slow tilt of that object."""

from __future__ import annotations

from collections.abc import Sequence

from foreshock.detector import Detector, DetectorSpec, Input
from foreshock.hookspecs import hookimpl
from foreshock.messages import Imu, Odometry
from foreshock_detectors._standstill import BODY_S, TRACKED_S
from foreshock_detectors.load._config import LoadConfig

__all__ = ["SPEC", "LoadConfig", "foreshock_detectors", "inputs"]


def inputs(config: LoadConfig) -> tuple[Input, ...]:
    """IMU of the gripper, pose of the held object as seen, and as commanded.

    The command is required: without it a wanted rotation could not be told from an unstable wrist or a drift.
    """
    gripper, age = config.gripper, config.max_age_s
    return (
        Input("imu", f"{gripper}/imu", Imu, max_age_s=age, max_standstill_s=BODY_S),
        Input("object", f"{gripper}/object", Odometry, max_age_s=age, max_standstill_s=TRACKED_S),
        Input("command", f"{gripper}/object_command", Odometry, max_age_s=age),
    )


def _build(config: LoadConfig) -> Detector:
    from foreshock_detectors.load._detector import LoadDetector

    return LoadDetector(config)


SPEC = DetectorSpec(
    id="load",
    kinds=("wrist-instability", "tilt-drift"),
    inputs=inputs,
    build=_build,
    config=LoadConfig,
    deadline_s=0.002,
    warm_up_s=0.3,
    summary="shaking wrist and slow tilt of a held object, against its commanded motion",
)


@hookimpl
def foreshock_detectors() -> Sequence[DetectorSpec]:
    """The load detector."""
    return (SPEC,)
