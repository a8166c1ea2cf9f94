"""Actuator precursors: a drive that cannot give the torque asked of it, and a joint that leaves its command."""

from __future__ import annotations

from collections.abc import Sequence

from foreshock.detector import Detector, DetectorSpec, Input
from foreshock.hookspecs import hookimpl
from foreshock.messages import JointState
from foreshock_detectors._standstill import BODY_S
from foreshock_detectors.actuators._config import ActuatorsConfig

__all__ = ["SPEC", "ActuatorsConfig", "foreshock_detectors"]

_MAX_AGE_S = 0.1
_MIN_RATE_HZ = 25.0


def _build(config: ActuatorsConfig) -> Detector:
    from foreshock_detectors.actuators._detector import ActuatorsDetector

    return ActuatorsDetector(config)


SPEC = DetectorSpec(
    id="actuators",
    kinds=("torque-saturation", "actuator-drift"),
    inputs=(
        Input("joints", "joints/state", JointState, _MAX_AGE_S, _MIN_RATE_HZ, max_standstill_s=BODY_S),
        Input("command", "joints/command", JointState, _MAX_AGE_S, _MIN_RATE_HZ),
    ),
    build=_build,
    config=ActuatorsConfig,
    deadline_s=0.002,
    summary="drives at the end of their torque, and joints that leave their command",
)


@hookimpl
def foreshock_detectors() -> Sequence[DetectorSpec]:
    """The actuators detector."""
    return (SPEC,)
