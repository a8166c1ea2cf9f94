"""Proximity precursors: a human inside the protective separation distance, and clearance that narrows.

Capsules around the robot's collision meshes by Pinocchio, distances by python-fcl, S_p by ISO/TS 15066. Any URDF; TALOS
by default.
"""

from __future__ import annotations

from collections.abc import Sequence

from foreshock.detector import Detector, DetectorSpec, Input
from foreshock.hookspecs import hookimpl
from foreshock.messages import Humans, JointState, Odometry
from foreshock_detectors._standstill import BODY_S, TRACKED_S
from foreshock_detectors.proximity._config import ProximityConfig

__all__ = ["SPEC", "ProximityConfig", "foreshock_detectors"]

_MAX_AGE_S = 0.05
_MIN_RATE_HZ = 50.0
_HUMANS_MAX_AGE_S = 0.2
_HUMANS_MIN_RATE_HZ = 10.0


def _build(config: ProximityConfig) -> Detector:
    from foreshock_detectors.proximity._detector import ProximityDetector

    return ProximityDetector(config)


SPEC = DetectorSpec(
    id="proximity",
    kinds=("human-proximity-breach", "narrowing-clearance"),
    inputs=(
        Input("joints", "joints/state", JointState, _MAX_AGE_S, _MIN_RATE_HZ, max_standstill_s=BODY_S),
        Input("odometry", "base/odometry", Odometry, _MAX_AGE_S, _MIN_RATE_HZ, max_standstill_s=BODY_S),
        Input("humans", "humans/pose", Humans, _HUMANS_MAX_AGE_S, _HUMANS_MIN_RATE_HZ, max_standstill_s=TRACKED_S),
    ),
    build=_build,
    config=ProximityConfig,
    warm_up_s=0.5,
    extra="proximity",
    summary="humans inside the protective separation distance, and clearance that narrows, by capsule distances",
)


@hookimpl
def foreshock_detectors() -> Sequence[DetectorSpec]:
    """The proximity detector."""
    return (SPEC,)
