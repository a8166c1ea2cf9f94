"""``capture-point``: protects when the capture point says that a fall is near, and sees no other precursor."""

from __future__ import annotations

from collections.abc import Sequence

import msgspec

from foreshock._strict import within
from foreshock.policy import Proposal, Situation
from foreshock_detectors.baselines._protective import Protective, check

__all__ = ["CapturePoint", "CapturePointConfig"]

FALL = "A1"
DEVIATION = "com-lateral-deviation"


class CapturePointConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Settings.

    Attributes:
        mode: whose actions it takes.
        actions: what it does; None takes the mode's protective actions.
        within_s: it acts at a predicted time to the fall of at most this. By default one support phase of slow walking
            (0.5 s), which is also more than any action against a fall takes (arm-reconfiguration, 0.3 s).
        deviation: whether the kind ``com-lateral-deviation`` triggers it as well: the capture margin is part of it.
    """

    mode: str = FALL
    actions: tuple[str, ...] | None = None
    within_s: float = 0.5
    deviation: bool = True

    def __post_init__(self) -> None:
        check(self.mode, self.actions)
        within("within_s", self.within_s, 0.0, above=True)


class CapturePoint:
    """Acts while the predicted fall is near, or the centre of mass has left its place between the feet.

    The time is that after which the capture point xi = x + xdot / w0 reaches the edge of the support, predicted by
    the detector ``balance`` for mode A1; without a detector that predicts it this policy never acts.
    """

    def __init__(self, config: CapturePointConfig) -> None:
        self._c, self._do = config, Protective(config.mode, config.actions)

    def propose(self, situation: Situation) -> Sequence[Proposal]:
        """What holds now."""
        left_s = situation.time_to(FALL)
        if left_s is not None and not left_s > self._c.within_s:
            return self._do.proposals(f"fall predicted in {left_s:.2f} s, {self._c.within_s:g} s or less acts")
        if self._c.deviation:
            for p in situation.precursors:
                if p.kind == DEVIATION and (p.phase != "cleared" or p.frozen):
                    return self._do.proposals(f"{DEVIATION} {p.statistic:.3f} {p.unit}")
        return ()
