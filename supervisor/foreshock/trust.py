"""Trust (Eq. 2), control-level trust with recovery and caps, and the protection levels that it demands.

T = 1 - P is the paper's conceptual trust. control_trust <= T gates actions: it falls at once, recovers with a time
constant, and is capped while something is not observed. Gates are written ``not (trust >= gate)``: NaN closes them.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence

import msgspec

from foreshock._strict import within
from foreshock.errors import ConfigError, nearest
from foreshock.records import ProtectionLevel, RiskEstimate, Trust
from foreshock.taxonomy import Taxonomy

__all__ = ["Gates", "LevelState", "TrustModel", "TrustSettings", "TrustState", "level_step", "levels_step"]


class TrustSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """How control-level trust follows trust.

    Attributes:
        recovery_s: time constant of recovery; it falls at once.
        unobserved_cap: control_trust is at most this for modes (and overall) of which a kind is not observed.
        grace_s: a kind that stays unobserved longer brings the minimal risk condition.

    Raises:
        ConfigError: a number that would switch the cap or the grace time off, such as NaN.
    """

    recovery_s: float = 0.5
    unobserved_cap: float = 0.8
    grace_s: float = 0.3

    def __post_init__(self) -> None:
        within("trust.recovery_s", self.recovery_s, 0.0, above=True)
        within("trust.unobserved_cap", self.unobserved_cap, 0.0, 1.0)
        within("trust.grace_s", self.grace_s, 0.0)


class Gates(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """At which control-level trust a protection level begins and ends.

    Attributes:
        caution: below it, cheap and reversible actions.
        protective: below it, the safety protocols; 0.3 in the paper.
        hysteresis: a level is given up only this far above its gate.
        dwell_s: a level holds this long after the last tick that demanded it.
        latch: levels from this one on hold until an operator resets them; ``none`` for no latch.

    Raises:
        ConfigError: gates that are not in order or not within 0..1, or a negative hysteresis or dwell.
    """

    caution: float = 0.6
    protective: float = 0.3
    hysteresis: float = 0.1
    dwell_s: float = 1.0
    latch: str = "minimal-risk"

    def __post_init__(self) -> None:
        if not (0.0 <= self.protective <= self.caution <= 1.0):
            raise ConfigError("gates", f"protective {self.protective} <= caution {self.caution} must hold within 0..1")
        if self.latch not in LATCHES:
            problem = f"{self.latch!r} is not one of {', '.join(LATCHES)}"
            raise ConfigError("gates.latch", problem, nearest(self.latch, LATCHES))
        within("gates.hysteresis", self.hysteresis, 0.0, 1.0)
        within("gates.dwell_s", self.dwell_s, 0.0)


LATCHES: Mapping[str, int] = {
    "none": ProtectionLevel.MINIMAL_RISK + 1,
    "protective": ProtectionLevel.PROTECTIVE,
    "minimal-risk": ProtectionLevel.MINIMAL_RISK,
}


class TrustState(msgspec.Struct, frozen=True):
    """Control-level trust after the last tick, and since when each unobserved kind is not observed."""

    at_ns: int = -1
    overall: float = 1.0
    by_mode: Mapping[str, float] = {}
    unobserved_ns: Mapping[str, int] = {}


class TrustModel:
    """Trust over a fixed set of configured kinds."""

    def __init__(self, settings: TrustSettings, taxonomy: Taxonomy, kinds: Iterable[str]) -> None:
        self._settings = settings
        self._modes = {kind: taxonomy.modes_of(kind) for kind in kinds}

    def step(
        self, state: TrustState, risk: RiskEstimate, unobserved: Sequence[str], now_ns: int
    ) -> tuple[TrustState, Trust, bool]:
        """Next state, trust now, and whether some kind is unobserved for longer than the grace time."""
        since = {kind: state.unobserved_ns.get(kind, now_ns) for kind in unobserved}
        overdue = any(now_ns - t > self._settings.grace_s * 1e9 for t in since.values())
        gain = 1.0 if state.at_ns < 0 else 1.0 - math.exp((state.at_ns - now_ns) / (self._settings.recovery_s * 1e9))
        cap = self._settings.unobserved_cap
        trust = _complement(risk.upper)
        overall = _follow(state.overall, min(trust, cap) if unobserved else trust, gain)
        by_mode = _complements(risk.by_mode)
        targets = by_mode
        if unobserved:
            capped = {mode for kind in unobserved for mode in self._modes[kind]}
            targets = {mode: min(t, cap) if mode in capped else t for mode, t in by_mode.items()}
        before = state.by_mode
        if targets == before:
            control = targets.copy()
        else:
            control = {
                mode: t if t <= (old := before.get(mode, 1.0)) else _follow(old, t, gain) for mode, t in targets.items()
            }
        now = Trust(
            trust,
            overall,
            by_mode,
            control,
            _complements(risk.by_class),
            1.0 - len(unobserved) / len(self._modes) if self._modes else 0.0,
            tuple(sorted(unobserved)),
        )
        return TrustState(now_ns, overall, control, since), now, overdue


def _complement(p: float) -> float:
    """T = 1 - P (Eq. 2); no trust in what is not a probability."""
    return 1.0 - p if 0.0 <= p <= 1.0 else 0.0


def _complements(risks: Mapping[str, float]) -> dict[str, float]:
    """_complement of each, without a call for each."""
    return {group: 1.0 - p if 0.0 <= p <= 1.0 else 0.0 for group, p in risks.items()}


def _follow(old: float, target: float, gain: float) -> float:
    return target if target <= old else old + (target - old) * gain


LEVELS = tuple(ProtectionLevel)
NORMAL, CAUTION, PROTECTIVE, MINIMAL_RISK = map(int, LEVELS)


class LevelState(msgspec.Struct, frozen=True):
    """One level's memory: the level that holds, and when each level was last demanded (-1: never)."""

    level: ProtectionLevel = ProtectionLevel.NORMAL
    demanded_ns: tuple[int, int, int, int] = (-1, -1, -1, -1)


FRESH = LevelState()


def level_step(state: LevelState, gates: Gates, trust: float, overdue: bool, now_ns: int) -> LevelState:
    """The protection level after a tick: escalation at once, release after hysteresis and dwell, latches held.

    Monotone over open-loop histories: pointwise lower trust never gives a lower level.
    """
    if state.level is ProtectionLevel.NORMAL and trust >= gates.caution and not overdue:
        return state
    held, latch, dwell_ns = int(state.level), LATCHES[gates.latch], round(gates.dwell_s * 1e9)
    demanded = list(state.demanded_ns)
    level = NORMAL
    for candidate, edge in ((CAUTION, gates.caution), (PROTECTIVE, gates.protective), (MINIMAL_RISK, 0.0)):
        holds = held >= candidate
        gate = min(edge + gates.hysteresis, 1.0) if holds else edge
        wanted = overdue if candidate == MINIMAL_RISK else not (trust >= gate)
        if wanted:
            demanded[candidate] = now_ns
        last = demanded[candidate]
        if wanted or (holds and (candidate >= latch or (last >= 0 and now_ns - last < dwell_ns))):
            level = candidate
    return LevelState(LEVELS[level], (demanded[0], demanded[1], demanded[2], demanded[3]))


def levels_step(
    states: Mapping[str, LevelState], gates: Gates, trust: Mapping[str, float], now_ns: int
) -> dict[str, LevelState]:
    """level_step of every accident mode, by its control-level trust; lost evidence is the overall level's concern."""
    after: dict[str, LevelState] = {}
    for mode, t in trust.items():
        state = states.get(mode, FRESH)
        calm = state.level is ProtectionLevel.NORMAL and t >= gates.caution  # as level_step itself begins
        after[mode] = state if calm else level_step(state, gates, t, False, now_ns)
    return after
