"""Balance precursors of a biped: foot micro-slip, torso angular spike, CoM lateral deviation, sway increase.

Whole-body kinematics by Pinocchio on any URDF with two soles; TALOS by default.
"""

from __future__ import annotations

from collections.abc import Sequence

from foreshock.detector import Detector, DetectorSpec, Input
from foreshock.hookspecs import hookimpl
from foreshock.messages import Imu, JointState, MotionPlan, Odometry, WrenchStamped
from foreshock_detectors._standstill import BODY_S
from foreshock_detectors.balance._config import BalanceConfig

__all__ = ["SPEC", "BalanceConfig", "foreshock_detectors"]

_MAX_AGE_S = 0.05
_MIN_RATE_HZ = 50.0


def _build(config: BalanceConfig) -> Detector:
    from foreshock_detectors.balance._detector import BalanceDetector

    return BalanceDetector(config)


SPEC = DetectorSpec(
    id="balance",
    kinds=("foot-micro-slip", "torso-angular-spike", "com-lateral-deviation", "sway-amplitude-increase"),
    inputs=(
        Input("joints", "joints/state", JointState, _MAX_AGE_S, _MIN_RATE_HZ, max_standstill_s=BODY_S),
        Input("odometry", "base/odometry", Odometry, _MAX_AGE_S, _MIN_RATE_HZ, max_standstill_s=BODY_S),
        Input("imu", "imu/torso", Imu, _MAX_AGE_S, _MIN_RATE_HZ, required=False, max_standstill_s=BODY_S),
        Input(
            "left_wrench",
            "left_sole/wrench",
            WrenchStamped,
            _MAX_AGE_S,
            _MIN_RATE_HZ,
            required=False,
            max_standstill_s=BODY_S,
        ),
        Input(
            "right_wrench",
            "right_sole/wrench",
            WrenchStamped,
            _MAX_AGE_S,
            _MIN_RATE_HZ,
            required=False,
            max_standstill_s=BODY_S,
        ),
        Input("plan", "plan/motion", MotionPlan, 0.1, 0.0, required=False),
    ),
    build=_build,
    config=BalanceConfig,
    warm_up_s=1.5,
    extra="balance",
    summary="foot slip, torso rate, CoM deviation and sway of a biped, by whole-body kinematics",
)


@hookimpl
def foreshock_detectors() -> Sequence[DetectorSpec]:
    """The balance detector."""
    return (SPEC,)
