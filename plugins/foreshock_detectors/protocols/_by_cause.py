"""The policy ``by-cause``: what came first tells the cause, and the cause tells which actions help."""

from __future__ import annotations

from collections.abc import Sequence

import msgspec

from foreshock.errors import ConfigError, nearest
from foreshock.policy import Proposal, Situation
from foreshock.records import ProtectionLevel
from foreshock.taxonomy import builtin_taxonomy
from foreshock_detectors.protocols._causes import CAUSES
from foreshock_detectors.protocols._policy import KNOWN

__all__ = ["ByCause", "ByCauseConfig"]


class ByCauseConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Settings.

    Attributes:
        mode: accident mode; one of those in CAUSES.
        always: these actions whatever the cause, at the same moments: to compare with; None chooses.
    """

    mode: str = "A1"
    always: tuple[str, ...] | None = None

    def __post_init__(self) -> None:
        code = builtin_taxonomy().mode(self.mode, "mode").code
        if code not in CAUSES:
            raise ConfigError("mode", f"by-cause knows no causes of {code}", f"; expected {', '.join(CAUSES)}")
        for action in self.always or ():
            if action not in KNOWN:
                raise ConfigError("always", f"unknown action {action!r}", nearest(action, KNOWN))


class ByCause:
    """Acts from the caution level on, and in A1 as soon as a fall is predicted.

    The cause is the kind with the earliest onset inside the window: what comes later is its consequence. A robot that
    tips over its heel slides in the end, and one that slides is thrown about in the end.
    """

    def __init__(self, config: ByCauseConfig) -> None:
        self._mode = builtin_taxonomy().mode(config.mode).code
        self._causes, self._always = CAUSES[self._mode], config.always
        self._by_kind = {kind: cause for cause in self._causes.causes for kind in cause.kinds}

    def propose(self, situation: Situation) -> Sequence[Proposal]:
        """The actions of the cause, at full strength; a level that is missing counts as the worst."""
        level = situation.levels.get(self._mode, ProtectionLevel.MINIMAL_RISK)
        left_s = situation.time_to(self._mode)
        if level < ProtectionLevel.CAUTION and (left_s is None or not self._causes.predicted):
            return ()
        actions, rule = self._chosen(situation, left_s)
        if self._always is not None:
            actions = self._always
        elif left_s is not None:
            actions += self._causes.mitigation
        level = max(level, ProtectionLevel.CAUTION)
        return [Proposal(a, 1.0, level, self._mode, f"{self._mode}: {rule}") for a in actions]

    def _chosen(self, situation: Situation, left_s: float | None) -> tuple[tuple[str, ...], str]:
        causes = self._causes
        known = [(p.onset_ns, p.kind) for p in situation.precursors if p.kind in self._by_kind]
        if not known:
            if left_s is not None and causes.predicted:
                return causes.predicted, "predicted before any precursor"
            return causes.after, "the evidence has gone, the level stands"
        first = min(known)[1]
        cause = self._by_kind[first]
        if cause.early and left_s is not None and left_s > causes.early_s:
            return cause.early, f"{first} came first, {left_s:.1f} s are left"
        return cause.actions, f"{first} came first"
