"""Baselines: policies that ask no model of risk, for the arms that campaigns compare the supervisor with.

They differ in what triggers them, not in what they do: each takes the protective actions of one accident mode.
"""

from __future__ import annotations

from collections.abc import Sequence

from foreshock.hookspecs import hookimpl
from foreshock.policy import PolicySpec
from foreshock_detectors.baselines._capture import CapturePoint, CapturePointConfig
from foreshock_detectors.baselines._reactive import ReactiveStop, ReactiveStopConfig
from foreshock_detectors.baselines._separation import SpeedSeparation, SpeedSeparationConfig
from foreshock_detectors.baselines._stl import Stl, StlConfig
from foreshock_detectors.protocols import MODE_ACTIONS

__all__ = [
    "CapturePoint",
    "CapturePointConfig",
    "ReactiveStop",
    "ReactiveStopConfig",
    "SpeedSeparation",
    "SpeedSeparationConfig",
    "Stl",
    "StlConfig",
    "foreshock_policies",
]


@hookimpl
def foreshock_policies() -> Sequence[PolicySpec]:
    """The four baselines."""
    return [
        PolicySpec(
            "capture-point",
            CapturePoint,
            CapturePointConfig,
            MODE_ACTIONS,
            "baseline: a mode's protective actions while a fall is near by the capture point",
        ),
        PolicySpec(
            "reactive-stop",
            ReactiveStop,
            ReactiveStopConfig,
            MODE_ACTIONS,
            "baseline: a mode's protective actions at the first precursor of its cascade",
        ),
        PolicySpec(
            "speed-separation",
            SpeedSeparation,
            SpeedSeparationConfig,
            MODE_ACTIONS,
            "baseline: a mode's protective actions while a human is nearer than ISO/TS 15066 allows",
        ),
        PolicySpec(
            "stl",
            Stl,
            StlConfig,
            MODE_ACTIONS,
            "baseline: a mode's protective actions while a formula of signal temporal logic is violated (RTAMT)",
        ),
    ]
