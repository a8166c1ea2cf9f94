"""``speed-separation``: speed and separation monitoring by ISO/TS 15066, 5.5.4, and nothing else."""

from __future__ import annotations

from collections.abc import Sequence

import msgspec

from foreshock.errors import ConfigError
from foreshock.policy import Proposal, Situation
from foreshock.taxonomy import builtin_taxonomy
from foreshock_detectors.baselines._protective import Protective, check

__all__ = ["SpeedSeparation", "SpeedSeparationConfig"]

BREACH = "human-proximity-breach"


class SpeedSeparationConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Settings.

    Attributes:
        mode: whose actions it takes.
        actions: what it does; None takes the mode's protective actions.
        kinds: what says that a separation is not kept.
    """

    mode: str
    actions: tuple[str, ...] | None = None
    kinds: tuple[str, ...] = (BREACH,)

    def __post_init__(self) -> None:
        check(self.mode, self.actions)
        if not self.kinds:
            raise ConfigError("kinds", "empty; nothing would ever trigger it")
        for kind in self.kinds:
            builtin_taxonomy().kind(kind, "kinds")


class SpeedSeparation:
    """Acts while some human is nearer than the protective separation distance S_p.

    The comparison with S_p = S_h + S_r + S_s + C + Z_d + Z_r is that of the detector of ``human-proximity-breach``
    (``proximity`` ships; without one that reports the kind this policy never acts). Motion resumes as soon as the
    separation is kept again, as the standard permits: a breach that is cleared but still in the window does not count;
    one that nobody observes any more does.
    """

    def __init__(self, config: SpeedSeparationConfig) -> None:
        self._do = Protective(config.mode, config.actions)
        self._kinds = frozenset(builtin_taxonomy().kind(k).id for k in config.kinds)

    def propose(self, situation: Situation) -> Sequence[Proposal]:
        """What holds now."""
        near = [p for p in situation.precursors if p.kind in self._kinds and (p.phase != "cleared" or p.frozen)]
        if not near:
            return ()
        nearest = min(near, key=lambda p: (p.statistic - p.threshold, p.subject))
        return self._do.proposals(f"{nearest.kind} of {nearest.subject or 'a human'}")
