"""The policy ``protocol``: the protocol of one accident mode, and the speed scale of the ladder."""

from __future__ import annotations

from collections.abc import Sequence

import msgspec

from foreshock.errors import ConfigError, nearest
from foreshock.policy import ACTIONS, Proposal, Situation
from foreshock.records import ProtectionLevel
from foreshock.taxonomy import builtin_taxonomy
from foreshock_detectors.policies import Ladder, LadderConfig
from foreshock_detectors.protocols._actions import MODE_ACTIONS
from foreshock_detectors.protocols._modes import PROTOCOLS

__all__ = ["ProtocolConfig", "ProtocolPolicy"]

KNOWN = {*ACTIONS, *(a.id for a in MODE_ACTIONS)}


class ProtocolConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Settings of the protocol.

    Attributes:
        mode: the accident mode whose trust gates it.
        caution: actions at the caution gate; None takes the mode's.
        protective: actions at the protective gate; None takes the mode's.
        scale_speed: scale speed by overall trust as the ladder does.
    """

    mode: str
    caution: tuple[str, ...] | None = None
    protective: tuple[str, ...] | None = None
    scale_speed: bool = True

    def __post_init__(self) -> None:
        builtin_taxonomy().mode(self.mode, "mode")
        for name, actions in (("caution", self.caution), ("protective", self.protective)):
            for action in actions or ():
                if action not in KNOWN:
                    raise ConfigError(name, f"unknown action {action!r}", nearest(action, KNOWN))


class ProtocolPolicy:
    """Proposes the actions of the mode's level, at full strength."""

    def __init__(self, config: ProtocolConfig) -> None:
        self._mode = builtin_taxonomy().mode(config.mode).code
        shipped = PROTOCOLS[self._mode]
        self._caution = shipped.caution if config.caution is None else config.caution
        self._protective = shipped.protective if config.protective is None else config.protective
        self._ladder = Ladder(LadderConfig(self._mode, (), ())) if config.scale_speed else None

    def propose(self, situation: Situation) -> Sequence[Proposal]:
        """What holds now. A level that is missing counts as the worst."""
        mode = self._mode
        scale = self._ladder.speed(situation.overall) if self._ladder is not None else 1.0
        proposals = []
        if not scale >= 1.0:
            rule = f"speed scaled to {scale:.2f} by overall trust"
            proposals.append(Proposal("speed-scale", 1.0 - scale, situation.overall_level, "", rule))
        level = situation.levels.get(mode, ProtectionLevel.MINIMAL_RISK)
        if level >= ProtectionLevel.PROTECTIVE:
            actions, gate = self._protective, "protective"
        elif level >= ProtectionLevel.CAUTION:
            actions, gate = self._caution, "caution"
        else:
            return proposals
        return proposals + [Proposal(a, 1.0, level, mode, f"{mode}: trust below the {gate} gate") for a in actions]
