"""Intervention protocols of all accident modes, as the policy ``protocol``."""

from __future__ import annotations

from collections.abc import Sequence

from foreshock.hookspecs import hookimpl
from foreshock.policy import PolicySpec
from foreshock_detectors.protocols._actions import MODE_ACTIONS
from foreshock_detectors.protocols._modes import PROTOCOLS, Protocol
from foreshock_detectors.protocols._policy import ProtocolConfig, ProtocolPolicy

__all__ = ["MODE_ACTIONS", "PROTOCOLS", "Protocol", "ProtocolConfig", "ProtocolPolicy", "foreshock_policies"]


@hookimpl
def foreshock_policies() -> Sequence[PolicySpec]:
    """The policy ``protocol``."""
    summary = "the actions that fit one accident mode, cheap ones at caution, protective ones at T < 0.3"
    return [PolicySpec("protocol", ProtocolPolicy, ProtocolConfig, MODE_ACTIONS, summary)]
