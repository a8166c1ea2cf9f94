"""First-party policies for A1: the paper's gate alone, a ladder that begins with cheap actions, a plain count."""

from __future__ import annotations

from collections.abc import Sequence

import msgspec

from foreshock.errors import ConfigError, nearest
from foreshock.hookspecs import hookimpl
from foreshock.policy import ACTIONS, PolicySpec, Proposal, Situation
from foreshock.records import ProtectionLevel
from foreshock.taxonomy import builtin_taxonomy

__all__ = ["CountRule", "CountRuleConfig", "Ladder", "LadderConfig", "PaperGate", "PaperGateConfig"]

PROTOCOLS = ("step-suppression", "arm-reconfiguration", "compliance-tuning", "balance-lock")
"""The four safety protocols of section 3.3."""


class PaperGateConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """mode: the accident mode whose trust gates the protocols."""

    mode: str = "A1"

    def __post_init__(self) -> None:
        builtin_taxonomy().mode(self.mode, "mode")


class PaperGate:
    """All four protocols at T < 0.3 (the protective gate), nothing before, as in section 3.3.

    What the arbiter withholds from any policy it withholds here too: a protocol that takes longer than the predicted
    time to the fall is not begun.
    """

    def __init__(self, config: PaperGateConfig) -> None:
        self._mode = builtin_taxonomy().mode(config.mode).code

    def propose(self, situation: Situation) -> Sequence[Proposal]:
        """The four protocols at full strength while the mode is at the protective level."""
        level = situation.levels.get(self._mode, ProtectionLevel.MINIMAL_RISK)
        if level < ProtectionLevel.PROTECTIVE:
            return ()
        return [Proposal(a, 1.0, level, self._mode, f"{self._mode}: T below the protective gate") for a in PROTOCOLS]


class CountRuleConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """mode: the accident mode whose cascade (Table 3) is counted; least: how many of its kinds act."""

    mode: str = "A1"
    least: int = 2

    def __post_init__(self) -> None:
        cascade = builtin_taxonomy().mode(self.mode, "mode").cascade
        if not 1 <= self.least <= len(cascade):
            raise ConfigError("least", f"{self.least!r} is not within 1..{len(cascade)}, the length of the cascade")


class CountRule:
    """All four protocols while so many of the cascade's kinds are in the window: a plain rule to compare with.

    It asks no model. The level that it acts at is the protective one, whatever trust says.
    """

    def __init__(self, config: CountRuleConfig) -> None:
        taxonomy = builtin_taxonomy()
        mode = taxonomy.mode(config.mode)
        self._mode, self._least = mode.code, config.least
        self._cascade = frozenset(taxonomy.kind(k).id for k in mode.cascade)

    def propose(self, situation: Situation) -> Sequence[Proposal]:
        """The four protocols at full strength while enough kinds are in the window."""
        found = len(self._cascade.intersection([p.kind for p in situation.precursors]))
        if found < self._least:
            return ()
        rule = f"{self._mode}: {found} of {len(self._cascade)} precursors of the cascade"
        return [Proposal(a, 1.0, ProtectionLevel.PROTECTIVE, self._mode, rule) for a in PROTOCOLS]


class LadderConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Settings of the ladder.

    Attributes:
        mode: the accident mode whose trust gates steps and posture.
        caution: actions at the caution gate; cheap and reversible ones.
        protective: actions at the protective gate.
        full_speed_trust: overall control-level trust from which speed is not scaled.
        stop_trust: overall control-level trust at which the scale reaches its floor.
        slowest: the floor of the speed scale.
    """

    mode: str = "A1"
    caution: tuple[str, ...] = ("step-suppression",)
    protective: tuple[str, ...] = PROTOCOLS
    full_speed_trust: float = 0.75
    stop_trust: float = 0.3
    slowest: float = 0.1

    def __post_init__(self) -> None:
        builtin_taxonomy().mode(self.mode, "mode")
        if not 0.0 <= self.slowest < 1.0:
            raise ConfigError(
                "slowest", f"{self.slowest!r} is not a share of full speed", "; expected 0 <= slowest < 1"
            )
        if not 0.0 <= self.stop_trust < self.full_speed_trust <= 1.0:
            limits = f"stop_trust {self.stop_trust!r} < full_speed_trust {self.full_speed_trust!r}"
            raise ConfigError("full_speed_trust", f"{limits} must hold within 0..1")
        for name, actions in (("caution", self.caution), ("protective", self.protective)):
            for action in actions:
                if action not in ACTIONS:
                    raise ConfigError(name, f"unknown action {action!r}", nearest(action, ACTIONS))


class Ladder:
    """Speed scale from overall trust, cheap actions at the caution gate, all protocols at the protective gate."""

    def __init__(self, config: LadderConfig) -> None:
        self._c, self._mode = config, builtin_taxonomy().mode(config.mode).code

    def propose(self, situation: Situation) -> Sequence[Proposal]:
        """What holds now; the speed scale never rises when trust falls."""
        c, proposals = self._c, []
        scale = self.speed(situation.overall)
        if not scale >= 1.0:
            rule = f"speed scaled to {scale:.2f} by overall trust"
            proposals.append(Proposal("speed-scale", 1.0 - scale, situation.overall_level, "", rule))
        level = situation.levels.get(self._mode, ProtectionLevel.MINIMAL_RISK)
        if level >= ProtectionLevel.PROTECTIVE:
            rule = f"{self._mode}: trust below the protective gate"
            actions: tuple[str, ...] = (*c.protective, "impact-mitigation")
        elif level >= ProtectionLevel.CAUTION:
            rule = f"{self._mode}: trust below the caution gate"
            actions = c.caution
        else:
            return proposals
        return proposals + [Proposal(a, 1.0, level, self._mode, rule) for a in actions]

    def speed(self, trust: float) -> float:
        """Share of full speed allowed at this overall trust; NaN gives the floor."""
        c = self._c
        if trust >= c.full_speed_trust:
            return 1.0
        if not trust > c.stop_trust:
            return c.slowest
        return c.slowest + (1.0 - c.slowest) * (trust - c.stop_trust) / (c.full_speed_trust - c.stop_trust)


@hookimpl
def foreshock_policies() -> Sequence[PolicySpec]:
    """The ladder, the paper's gate, and a count to compare them with."""
    return [
        PolicySpec(
            "ladder",
            Ladder,
            LadderConfig,
            summary="speed scale and step suppression early, all four protocols at T < 0.3",
        ),
        PolicySpec("paper-gate", PaperGate, PaperGateConfig, summary="all four protocols at T < 0.3, nothing before"),
        PolicySpec(
            "count-rule",
            CountRule,
            CountRuleConfig,
            summary="all four protocols while two of the cascade's three precursors are present; no model",
        ),
    ]
