"""Trust (Eq. 2), control-level trust with recovery and caps, and the protection levels that it demands.

T = 1 - P is the paper's conceptual trust. control_trust <= T gates actions: it falls at once, recovers with a time
constant, and is capped while something is not observed. Gates are written ``not (trust >= gate)``: NaN closes them.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Literal, NamedTuple

import msgspec

from foreshock._strict import within
from foreshock.errors import ConfigError, nearest
from foreshock.records import ProtectionLevel, RiskEstimate, Trust
from foreshock.taxonomy import Taxonomy

__all__ = [
    "Edges",
    "GateChange",
    "Gates",
    "LevelState",
    "TrustModel",
    "TrustSettings",
    "TrustState",
    "edge_step",
    "level_step",
    "levels_step",
]


class TrustSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """How control-level trust follows trust.

    Attributes:
        recovery_s: time constant of recovery; it falls at once.
        unobserved_cap: control_trust is at most this for modes, classes and overall, where a kind is not observed.
        grace_s: a kind that stays unobserved longer brings the minimal risk condition.
        acts_on: what trust is the complement of: the ``upper`` bound of P, or the model's own ``probability``, which a
            wrong model may put too low.

    Raises:
        ConfigError: a number that would switch the cap or the grace time off, such as NaN.
    """

    recovery_s: float = 0.5
    unobserved_cap: float = 0.8
    grace_s: float = 0.3
    acts_on: Literal["upper", "probability"] = "upper"

    def __post_init__(self) -> None:
        within("trust.recovery_s", self.recovery_s, 0.0, above=True)
        within("trust.unobserved_cap", self.unobserved_cap, 0.0, 1.0)
        within("trust.grace_s", self.grace_s, 0.0)


class Edges(NamedTuple):
    """What a level is judged by: gates, those of a level that holds, the level that latches, and the dwell."""

    caution: float
    caution_held: float
    protective: float
    protective_held: float
    latch: int
    dwell_ns: int


class GateChange(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Where the gates of one dimension of trust differ from the common ones; what is not given is as there."""

    caution: float | None = None
    protective: float | None = None
    hysteresis: float | None = None
    dwell_s: float | None = None
    latch: str | None = None


class Gates(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """At which control-level trust a protection level begins and ends, for every dimension of trust.

    Attributes:
        caution: below it, cheap and reversible actions.
        protective: below it, the safety protocols; 0.3 in the paper.
        hysteresis: a level is given up only this far above its gate.
        dwell_s: a level holds this long after the last tick that demanded it.
        latch: levels from this one on hold until an operator resets them; ``none`` for no latch.
        overall: what differs for overall trust.
        modes: what differs for an accident mode, by code.
        classes: what differs for a precursor class, by id.

    Raises:
        ConfigError: gates that are not in order or not within 0..1, or a negative hysteresis or dwell.
    """

    caution: float = 0.6
    protective: float = 0.3
    hysteresis: float = 0.1
    dwell_s: float = 1.0
    latch: str = "minimal-risk"
    overall: GateChange = GateChange()
    modes: dict[str, GateChange] = {}
    classes: dict[str, GateChange] = {}

    def __post_init__(self) -> None:
        if not (0.0 <= self.protective <= self.caution <= 1.0):
            raise ConfigError("gates", f"protective {self.protective} <= caution {self.caution} must hold within 0..1")
        if self.latch not in LATCHES:
            problem = f"{self.latch!r} is not one of {', '.join(LATCHES)}"
            raise ConfigError("gates.latch", problem, nearest(self.latch, LATCHES))
        within("gates.hysteresis", self.hysteresis, 0.0, 1.0)
        within("gates.dwell_s", self.dwell_s, 0.0)
        self._with("overall", self.overall)
        for group, changes in (("modes", self.modes), ("classes", self.classes)):
            for name, change in changes.items():
                self._with(f"{group}.{name}", change)

    def _with(self, place: str, change: GateChange) -> Gates:
        """These gates with the change of one dimension, checked."""
        given = {f: v for f in change.__struct_fields__ if (v := getattr(change, f)) is not None}
        if not given:
            return self
        common = {f: getattr(self, f) for f in change.__struct_fields__}
        try:
            return Gates(**{**common, **given})
        except ConfigError as e:
            raise ConfigError(e.place.replace("gates", f"gates.{place}", 1), e.problem, e.hint) from None

    def edges(self) -> Edges:
        """What a level is judged by."""
        extra = self.hysteresis
        return Edges(
            self.caution,
            min(self.caution + extra, 1.0),
            self.protective,
            min(self.protective + extra, 1.0),
            LATCHES[self.latch],
            round(self.dwell_s * 1e9),
        )

    def of_overall(self) -> Gates:
        """The gates of overall trust."""
        return self._with("overall", self.overall)

    def of_modes(self, taxonomy: Taxonomy) -> dict[str, Gates]:
        """The gates of every accident mode, by code.

        Raises:
            ConfigError: a change for a mode that does not exist.
        """
        return self._of_all("modes", self.modes, taxonomy.codes)

    def of_classes(self, taxonomy: Taxonomy) -> dict[str, Gates]:
        """The gates of every precursor class, by id.

        Raises:
            ConfigError: a change for a class that does not exist.
        """
        return self._of_all("classes", self.classes, [c.id for c in taxonomy.classes])

    def _of_all(self, group: str, changes: Mapping[str, GateChange], known: Iterable[str]) -> dict[str, Gates]:
        known = tuple(known)
        for name in changes:
            if name not in known:
                raise ConfigError(f"gates.{group}.{name}", "no such dimension of trust", nearest(name, known))
        return {name: self._with(f"{group}.{name}", changes.get(name, GateChange())) for name in known}


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
    by_class: Mapping[str, float] = {}
    unobserved_ns: Mapping[str, int] = {}


class TrustModel:
    """Trust over a fixed set of configured kinds: overall, by accident mode and by precursor class."""

    def __init__(self, settings: TrustSettings, taxonomy: Taxonomy, kinds: Iterable[str]) -> None:
        self._settings = settings
        self._modes = {kind: taxonomy.modes_of(kind) for kind in kinds}
        self._class = {kind: taxonomy.class_of(kind) for kind in self._modes}
        self._watching = {code: {k for k, modes in self._modes.items() if code in modes} for code in taxonomy.codes}
        self._all_seen = {code: 1.0 if watched else 0.0 for code, watched in self._watching.items()}

    def step(
        self, state: TrustState, risk: RiskEstimate, unobserved: Sequence[str], now_ns: int
    ) -> tuple[TrustState, Trust, bool]:
        """Next state, trust now, and whether some kind is unobserved for longer than the grace time."""
        settings = self._settings
        since: dict[str, int] = {}
        overdue = False
        gain = 1.0 if state.at_ns < 0 else 1.0 - math.exp((state.at_ns - now_ns) / (settings.recovery_s * 1e9))
        if settings.acts_on == "upper":
            p, p_by_mode, p_by_class = risk.upper, risk.upper_by_mode, risk.upper_by_class
        else:
            p, p_by_mode, p_by_class = risk.probability, risk.by_mode, risk.by_class
        trust, by_mode, by_class = _complement(p), _complements(p_by_mode), _complements(p_by_class)
        target, modes, classes, coverage = trust, by_mode, by_class, self._all_seen
        if unobserved:
            since = {kind: state.unobserved_ns.get(kind, now_ns) for kind in unobserved}
            overdue = any(now_ns - t > settings.grace_s * 1e9 for t in since.values())
            cap = settings.unobserved_cap
            target = min(trust, cap)
            modes = _capped(by_mode, {mode for kind in unobserved for mode in self._modes[kind]}, cap)
            classes = _capped(by_class, {self._class[kind] for kind in unobserved}, cap)
            coverage = self._coverage(unobserved)
        overall = _follow(state.overall, target, gain)
        control, control_by_class = _followed(state.by_mode, modes, gain), _followed(state.by_class, classes, gain)
        now = Trust(
            trust,
            overall,
            by_mode,
            control,
            by_class,
            1.0 - len(unobserved) / len(self._modes) if self._modes else 0.0,
            tuple(sorted(unobserved)),
            control_by_class,
            coverage.copy(),
        )
        return TrustState(now_ns, overall, control, control_by_class, since), now, overdue

    def _coverage(self, unobserved: Sequence[str]) -> dict[str, float]:
        """Share of the configured kinds of each mode that are observed; 0 where none is configured."""
        return {
            code: 1.0 - len(watched.intersection(unobserved)) / len(watched) if watched else 0.0
            for code, watched in self._watching.items()
        }


def _complement(p: float) -> float:
    """T = 1 - P (Eq. 2); no trust in what is not a probability."""
    return 1.0 - p if 0.0 <= p <= 1.0 else 0.0


def _complements(risks: Mapping[str, float]) -> dict[str, float]:
    """_complement of each, without a call for each."""
    return {group: 1.0 - p if 0.0 <= p <= 1.0 else 0.0 for group, p in risks.items()}


def _capped(trust: Mapping[str, float], those: Collection[str], cap: float) -> dict[str, float]:
    return {group: min(t, cap) if group in those else t for group, t in trust.items()}


def _followed(before: Mapping[str, float], targets: dict[str, float], gain: float) -> dict[str, float]:
    """Control-level trust of each group after a tick."""
    if targets == before:
        return targets.copy()
    return {g: t if t <= (old := before.get(g, 1.0)) else _follow(old, t, gain) for g, t in targets.items()}


def _follow(old: float, target: float, gain: float) -> float:
    return target if target <= old else old + (target - old) * gain


LEVELS = tuple(ProtectionLevel)
NORMAL, CAUTION, PROTECTIVE, MINIMAL_RISK = map(int, LEVELS)


class LevelState(msgspec.Struct, frozen=True, gc=False):
    """One level's memory: the level that holds, and when each level was last demanded (-1: never)."""

    level: ProtectionLevel = ProtectionLevel.NORMAL
    demanded_ns: tuple[int, int, int, int] = (-1, -1, -1, -1)


FRESH = LevelState()
NORMAL_LEVEL, _, PROTECTIVE_LEVEL, MINIMAL_RISK_LEVEL = LEVELS


def level_step(state: LevelState, gates: Gates, trust: float, overdue: bool, now_ns: int) -> LevelState:
    """The protection level after a tick: escalation at once, release after hysteresis and dwell, latches held.

    Monotone over open-loop histories: pointwise lower trust never gives a lower level.
    """
    return edge_step(state, gates.edges(), trust, overdue, now_ns)


def edge_step(state: LevelState, edges: Edges, trust: float, overdue: bool, now_ns: int) -> LevelState:
    """level_step, with what it asks of the gates worked out before."""
    level = state.level
    caution, caution_held, protective, protective_held, latch, dwell_ns = edges
    if level is NORMAL_LEVEL and trust >= caution and not overdue:
        return state
    held = int(level)
    _, caution_ns, protective_ns, minimal_ns = state.demanded_ns
    after = NORMAL
    if not (trust >= (caution_held if held >= CAUTION else caution)):
        caution_ns, after = now_ns, CAUTION
    elif held >= CAUTION and (latch <= CAUTION or (caution_ns >= 0 and now_ns - caution_ns < dwell_ns)):
        after = CAUTION
    if not (trust >= (protective_held if held >= PROTECTIVE else protective)):
        protective_ns, after = now_ns, PROTECTIVE
    elif held >= PROTECTIVE and (latch <= PROTECTIVE or (protective_ns >= 0 and now_ns - protective_ns < dwell_ns)):
        after = PROTECTIVE
    if overdue:
        minimal_ns, after = now_ns, MINIMAL_RISK
    elif held >= MINIMAL_RISK and (latch <= MINIMAL_RISK or (minimal_ns >= 0 and now_ns - minimal_ns < dwell_ns)):
        after = MINIMAL_RISK
    return LevelState(LEVELS[after], (-1, caution_ns, protective_ns, minimal_ns))


def levels_step(
    states: Mapping[str, LevelState], edges: Mapping[str, Edges], trust: Mapping[str, float], now_ns: int
) -> Mapping[str, LevelState]:
    """edge_step of every accident mode or class, by its control-level trust and its own gates.

    Lost evidence is the overall level's concern.
    """
    changed: dict[str, LevelState] = {}
    alarmed: LevelState | None = None
    for group, t in trust.items():
        state, its = states.get(group, FRESH), edges[group]
        level = state.level
        if level is NORMAL_LEVEL and t >= its.caution:
            continue  # edge_step would give it back
        if level is not MINIMAL_RISK_LEVEL and not t >= its.protective and state.demanded_ns[3] < 0:
            # what edge_step gives wherever trust is below both gates, made once
            if alarmed is None:
                alarmed = LevelState(PROTECTIVE_LEVEL, (-1, now_ns, now_ns, -1))
            changed[group] = alarmed
        else:
            changed[group] = edge_step(state, its, t, False, now_ns)
    if len(states) == len(trust):
        return {**states, **changed} if changed else states
    # a reset leaves dimensions out, which begin afresh
    return {group: changed.get(group) or states.get(group, FRESH) for group in trust}
