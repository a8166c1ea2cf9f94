"""Intervention protocols of all accident modes as the policy ``protocol``; ``by-cause`` chooses by what came first."""

from __future__ import annotations

from collections.abc import Sequence

from foreshock.hookspecs import hookimpl
from foreshock.policy import PolicySpec
from foreshock_detectors.protocols._actions import MODE_ACTIONS
from foreshock_detectors.protocols._by_cause import ByCause, ByCauseConfig
from foreshock_detectors.protocols._causes import CAUSES
from foreshock_detectors.protocols._modes import PROTOCOLS, Protocol
from foreshock_detectors.protocols._policy import ProtocolConfig, ProtocolPolicy

__all__ = [
    "CAUSES",
    "MODE_ACTIONS",
    "PROTOCOLS",
    "ByCause",
    "ByCauseConfig",
    "Protocol",
    "ProtocolConfig",
    "ProtocolPolicy",
    "foreshock_policies",
]


@hookimpl
def foreshock_policies() -> Sequence[PolicySpec]:
    """The policies ``protocol`` and ``by-cause``."""
    summary = "the actions that fit one accident mode, cheap ones at caution, protective ones at T < 0.3"
    chooses = (
        "the actions that help against what came first, from caution on or once an accident is predicted; A1 to A3"
    )
    return [
        PolicySpec("protocol", ProtocolPolicy, ProtocolConfig, MODE_ACTIONS, summary),
        PolicySpec("by-cause", ByCause, ByCauseConfig, MODE_ACTIONS, chooses),
    ]
