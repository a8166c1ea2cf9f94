"""Grip detector: micro-slip, force oscillation and mass misestimation of what a gripper holds."""

from __future__ import annotations

from collections.abc import Sequence

from foreshock.detector import Detector, DetectorSpec, Input
from foreshock.hookspecs import hookimpl
from foreshock.messages import GripState
from foreshock_detectors._standstill import BODY_S
from foreshock_detectors.grip._config import GripConfig

__all__ = ["GripConfig", "foreshock_detectors", "inputs"]


def inputs(config: GripConfig) -> tuple[Input, ...]:
    """One input per gripper, ``<gripper>/state``, named ``grip`` if there is one, else ``grip-<gripper>``.

    All are required: one silent gripper makes the whole detector unobserved, since a kind that is still reported for
    the other hand would hide it.
    """
    return tuple(
        Input(
            name,
            f"{gripper}/state",
            GripState,
            max_age_s=config.max_age_s,
            min_rate_hz=config.min_rate_hz,
            max_standstill_s=BODY_S,
        )
        for name, gripper in config.names
    )


def _build(config: GripConfig) -> Detector:
    from foreshock_detectors.grip._detector import GripDetector

    return GripDetector(config)


@hookimpl
def foreshock_detectors() -> Sequence[DetectorSpec]:
    """The grip detector."""
    return (
        DetectorSpec(
            id="grip",
            kinds=("grip-micro-slip", "grip-oscillation", "mass-misestimation"),
            inputs=inputs,
            build=_build,
            config=GripConfig,
            warm_up_s=0.3,
            extra="grip",
            summary="micro-slip, oscillation and wrong mass of a held object, from normal and tangential grip force",
        ),
    )
