"""``reactive-stop``: protects at the first precursor, whichever of the cascade it is."""

from __future__ import annotations

from collections.abc import Sequence

import msgspec

from foreshock.policy import Proposal, Situation
from foreshock_detectors.baselines._protective import Protective, check

__all__ = ["ReactiveStop", "ReactiveStopConfig"]


class ReactiveStopConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """mode: whose cascade triggers it; actions: what it does, None takes the mode's protective actions."""

    mode: str
    actions: tuple[str, ...] | None = None

    def __post_init__(self) -> None:
        check(self.mode, self.actions)


class ReactiveStop:
    """Acts while any kind of the mode's cascade (Table 3) is in the window. It counts nothing and waits for nothing."""

    def __init__(self, config: ReactiveStopConfig) -> None:
        self._do = Protective(config.mode, config.actions)
        self._cascade = frozenset(self._do.cascade)

    def propose(self, situation: Situation) -> Sequence[Proposal]:
        """What holds now."""
        first = min(((p.onset_ns, p.kind) for p in situation.precursors if p.kind in self._cascade), default=None)
        return self._do.proposals(f"first precursor {first[1]}" if first else "")
