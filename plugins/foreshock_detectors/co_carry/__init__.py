"""Co-carry detector: uneven load sharing, phase mismatch and grip desync of a load that two carry."""

from __future__ import annotations

from collections.abc import Sequence

from foreshock.detector import Detector, DetectorSpec, Input
from foreshock.hookspecs import hookimpl
from foreshock.messages import GripState, Odometry, Scalar, WrenchStamped
from foreshock_detectors._standstill import BODY_S, TRACKED_S
from foreshock_detectors.co_carry._config import CoCarryConfig

__all__ = ["CoCarryConfig", "foreshock_detectors", "inputs"]


def inputs(config: CoCarryConfig) -> tuple[Input, ...]:
    """Wrist, agreed share, tracked load and gripper. None is required: each kind is unobserved without its own."""
    age, rate = config.max_age_s, config.min_rate_hz
    return (
        Input("wrench", "wrist/wrench", WrenchStamped, age, rate, required=False, max_standstill_s=BODY_S),
        Input("share", "plan/share", Scalar, age, required=False),
        Input("load", "load/odometry", Odometry, age, rate, required=False, max_standstill_s=TRACKED_S),
        Input("grip", "gripper/state", GripState, age, rate, required=False, max_standstill_s=BODY_S),
    )


def _build(config: CoCarryConfig) -> Detector:
    from foreshock_detectors.co_carry._detector import CoCarryDetector

    return CoCarryDetector(config)


@hookimpl
def foreshock_detectors() -> Sequence[DetectorSpec]:
    """The co-carry detector."""
    return (
        DetectorSpec(
            id="co-carry",
            kinds=("uneven-load-sharing", "phase-mismatch", "grip-desync"),
            inputs=inputs,
            build=_build,
            config=CoCarryConfig,
            warm_up_s=2.0,
            summary="a load that two carry: its share, the phase of its ends, and the grip against its swing",
        ),
    )
