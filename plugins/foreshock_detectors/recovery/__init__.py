"""Recovery precursors: a robot that saves its balance by throwing trunk and arms, with people in reach."""

from __future__ import annotations

from collections.abc import Sequence

from foreshock.detector import Detector, DetectorSpec, Input
from foreshock.hookspecs import hookimpl
from foreshock.messages import Humans, Imu, JointState, Odometry
from foreshock_detectors._standstill import BODY_S, TRACKED_S
from foreshock_detectors.recovery._config import RecoveryConfig

__all__ = ["SPEC", "RecoveryConfig", "foreshock_detectors"]

_MIN_RATE_HZ = 50.0


def _build(config: RecoveryConfig) -> Detector:
    from foreshock_detectors.recovery._detector import RecoveryDetector

    return RecoveryDetector(config)


def _inputs(config: RecoveryConfig) -> tuple[Input, ...]:
    """All optional: each kind is unobserved by itself while what it needs is missing."""
    hands = tuple(
        Input(f"hand-{arm}", f"{arm}/odometry", Odometry, 0.05, _MIN_RATE_HZ, required=False, max_standstill_s=BODY_S)
        for arm in config.arms
    )
    return (
        Input("joints", "joints/state", JointState, 0.05, _MIN_RATE_HZ, required=False, max_standstill_s=BODY_S),
        Input("plan", "joints/plan", JointState, 0.1, 10.0, required=False),
        Input("torso", "imu/torso", Imu, 0.05, _MIN_RATE_HZ, required=False, max_standstill_s=BODY_S),
        Input("humans", "humans/pose", Humans, 0.2, 10.0, required=False, max_standstill_s=TRACKED_S),
        *hands,
    )


SPEC = DetectorSpec(
    id="recovery",
    kinds=("excessive-arm-velocity", "rapid-torso-recovery", "human-proximity-breach"),
    inputs=_inputs,
    build=_build,
    config=RecoveryConfig,
    deadline_s=0.002,
    summary="arms and trunk thrown to save the balance, and people inside the arms' protective separation distance",
)


@hookimpl
def foreshock_detectors() -> Sequence[DetectorSpec]:
    """The recovery detector."""
    return (SPEC,)
