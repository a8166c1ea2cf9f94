"""What every baseline does once it is triggered: the protective actions of one accident mode, at full strength."""

from __future__ import annotations

from collections.abc import Sequence

from foreshock.errors import ConfigError, nearest
from foreshock.policy import ACTIONS, Proposal
from foreshock.records import ProtectionLevel
from foreshock.taxonomy import builtin_taxonomy
from foreshock_detectors.protocols import MODE_ACTIONS, PROTOCOLS

__all__ = ["Protective", "check"]

KNOWN = {*ACTIONS, *(a.id for a in MODE_ACTIONS)}


def check(mode: str, actions: Sequence[str] | None) -> None:
    """Refuse a mode or an action that does not exist, and an arm that does nothing.

    Raises:
        ConfigError: names the setting, its value and the nearest name.
    """
    builtin_taxonomy().mode(mode, "mode")
    if actions is not None and not actions:
        raise ConfigError("actions", "empty; a baseline that does nothing is the arm off")
    for action in actions or ():
        if action not in KNOWN:
            raise ConfigError("actions", f"unknown action {action!r}", nearest(action, KNOWN))


class Protective:
    """Makes the proposals of a baseline.

    Args:
        mode: code or id of the accident mode.
        actions: what it does; None takes the protective actions of the policy ``protocol`` for the mode.

    Attributes:
        code: of the mode.
        cascade: taxonomy ids of its precursors in the order of Table 3.
    """

    def __init__(self, mode: str, actions: Sequence[str] | None) -> None:
        taxonomy = builtin_taxonomy()
        found = taxonomy.mode(mode, "mode")
        self.code = found.code
        self.cascade = tuple(taxonomy.kind(k).id for k in found.cascade)
        self._actions = PROTOCOLS[found.code].protective if actions is None else tuple(actions)

    def proposals(self, why: str) -> Sequence[Proposal]:
        """All actions at the protective level; none if why is empty."""
        if not why:
            return ()
        rule = f"{self.code}: {why}"
        return [Proposal(a, 1.0, ProtectionLevel.PROTECTIVE, self.code, rule) for a in self._actions]
