"""The policy port, the actions, and the arbiter that merges what policies propose.

A policy turns protection levels into proposals; the arbiter chooses what is feasible before the predicted accident
(rule 6: stop is not always safe), resolves conflicts per resource, and lets released actions ramp down.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

import msgspec

from foreshock.records import Intervention, Precursor, ProtectionLevel

__all__ = [
    "ACTIONS",
    "MINIMAL_RISK",
    "ActionSpec",
    "Arbiter",
    "ArbiterState",
    "Policy",
    "PolicySpec",
    "Proposal",
    "Situation",
]


class ActionSpec(msgspec.Struct, frozen=True):
    """What an action is.

    Attributes:
        id: kebab-case id.
        title: for people.
        resources: what it takes hold of; of two proposals for one resource the arbiter keeps one.
        duration_s: how long it takes until it helps; of a mitigation, how long before the accident it must begin.
        may_worsen: precursor kinds in whose presence it may make things worse.
        mitigates: it softens the accident instead of preventing it.
        resumes: motion begins again when it is released, which is announced: an abrupt restart is itself a precursor.
        stops: it freezes the robot; in the presence of a kind that it may worsen it topples a biped (rule 6).
        source: where it comes from.
    """

    id: str
    title: str
    resources: tuple[str, ...]
    duration_s: float
    may_worsen: tuple[str, ...] = ()
    mitigates: bool = False
    resumes: bool = False
    stops: bool = False
    source: str = ""


MINIMAL_RISK = "minimal-risk"
"""The action where nothing is observed any more, or nobody permits motion; the arbiter always finds time for it."""
PAPER = "section 3.3, safety protocols at T < 0.3"
ACTIONS: Mapping[str, ActionSpec] = {
    a.id: a
    for a in (
        ActionSpec("speed-scale", "scale speed and force down", ("speed",), 0.0, source="ISO 10218-1 reduced speed"),
        ActionSpec("announce", "light and sound", ("signal",), 0.0, source="ISO 12100, 6.4.3; ISO 7731"),
        ActionSpec("step-suppression", "halt the next planned step", ("steps",), 0.15, resumes=True, source=PAPER),
        ActionSpec("arm-reconfiguration", "extend the arms for counter-torque", ("arms",), 0.3, source=PAPER),
        ActionSpec(
            "compliance-tuning",
            "more joint damping and foot contact stiffness",
            ("joint-damping",),
            0.02,
            may_worsen=("foot-micro-slip",),
            source=PAPER,
        ),
        ActionSpec("balance-lock", "power-assisted balance lock", ("balance",), 0.05, source=PAPER),
        ActionSpec(
            MINIMAL_RISK,
            "go to the minimal risk condition",
            ("motion",),
            0.2,
            resumes=True,
            source="ISO 22737, ISO 34501",
        ),
        ActionSpec(
            "impact-mitigation",
            "soften the impact, away from the human",
            ("arms", "legs"),
            0.25,
            mitigates=True,
            source="design rule 6",
        ),
    )
}
"""Actions that the core knows; a policy may bring its own."""


class Situation(msgspec.Struct, frozen=True):
    """What a policy sees.

    Attributes:
        now_ns: time of the tick.
        levels: protection level per accident mode.
        trust: control-level trust per accident mode.
        overall: control-level trust overall.
        overall_level: protection level from overall trust and from lost evidence.
        precursors: evidence inside the window.
        time_to_event_s: shortest predicted time to any accident, None if none is predicted.
        times: shortest predicted time per accident mode that one is predicted for; None where modes are not told apart.
        class_levels: protection level per precursor class.
        class_trust: control-level trust per precursor class.
    """

    now_ns: int
    levels: Mapping[str, ProtectionLevel]
    trust: Mapping[str, float]
    overall: float
    overall_level: ProtectionLevel
    precursors: Sequence[Precursor]
    time_to_event_s: float | None
    times: Mapping[str, float] | None = None
    class_levels: Mapping[str, ProtectionLevel] = {}
    class_trust: Mapping[str, float] = {}

    def time_to(self, mode: str) -> float | None:
        """Predicted time to an accident of this mode; ``""`` means of any."""
        return self.time_to_event_s if self.times is None or not mode else self.times.get(mode)


class Proposal(msgspec.Struct, frozen=True, gc=False):
    """An action that a policy wants: strength 0..1, for which mode, at which level, by which rule."""

    action: str
    strength: float
    level: ProtectionLevel
    mode: str = ""
    rule: str = ""


class Policy(Protocol):
    """Maps a situation to proposals; a pure function."""

    def propose(self, situation: Situation) -> Sequence[Proposal]:
        """The actions that should hold now."""


class PolicySpec(msgspec.Struct, frozen=True):
    """What a policy declares: id, the actions that it may propose beyond ACTIONS, config Struct, build, one line."""

    id: str
    build: Callable[[Any], Policy]
    config: type[msgspec.Struct]
    actions: tuple[ActionSpec, ...] = ()
    summary: str = ""


class ArbiterState(msgspec.Struct, frozen=True):
    """What the arbiter has seen: actions that hold, since when each was engaged, and how far each is released.

    releasing maps an action to the tick that released it and its strength then; held are the active ones, by action.
    settled is what was asked for in the last tick, if the same asked again changes nothing: None while a release ramps,
    a time to the accident is predicted or a mitigation holds, all of which depend on the time.
    """

    active: Mapping[str, Intervention] = {}
    engaged_ns: Mapping[str, int] = {}
    releasing: Mapping[str, tuple[int, float]] = {}
    held: tuple[Intervention, ...] = ()
    settled: tuple[frozenset[Proposal], frozenset[str]] | None = None


ANNOUNCE = "announce"
UNCONDITIONAL = frozenset({"speed-scale", MINIMAL_RISK})
MITIGATION_NS = 500_000_000
"""A mitigation that has begun holds for so long: as long as the last part of a fall takes."""


class Arbiter:
    """Merges proposals into interventions.

    Args:
        actions: every action that may be proposed, by id.
        release_s: a released action ramps to zero over this time, since an abrupt restart is itself a precursor.
        step: a strength that falls is announced when it moved by this much; one that rises always is.
    """

    def __init__(self, actions: Mapping[str, ActionSpec], release_s: float, step: float = 0.05) -> None:
        self.actions = actions
        self._release_ns = round(release_s * 1e9)
        self._step = step

    def remaining_s(self, state: ArbiterState, action: str, now_ns: int) -> float:
        """Time until an action helps; what is already engaged is on its way."""
        since = state.engaged_ns.get(action, now_ns)
        return max(0.0, self.actions[action].duration_s - (now_ns - since) / 1e9)

    def feasible(
        self, state: ArbiterState, proposals: Sequence[Proposal], now_ns: int, time_to_event_s: float | None
    ) -> list[Proposal]:
        """Proposals that help before the predicted accident.

        An engaged action is kept. A mitigation stands only when nothing new can prevent the accident any more and no
        more time is left than the mitigation itself needs.
        """
        mitigate = [p for p in proposals if self.actions[p.action].mitigates]
        prevent = [p for p in proposals if not self.actions[p.action].mitigates]
        committed = [p for p in mitigate if self._committed(state, p.action, now_ns)]
        if time_to_event_s is None:
            return prevent + committed
        keep = [
            p
            for p in prevent
            if p.action in UNCONDITIONAL
            or p.action in state.engaged_ns
            or self.remaining_s(state, p.action, now_ns) <= time_to_event_s
        ]
        hope = any(
            p.action not in UNCONDITIONAL and 0.0 < self.remaining_s(state, p.action, now_ns) <= time_to_event_s
            for p in keep
        )
        if not hope:
            keep += [p for p in mitigate if p not in committed and time_to_event_s <= self.actions[p.action].duration_s]
        return keep + committed

    def _upright(self, proposals: list[Proposal], present: frozenset[str]) -> list[Proposal]:
        """Without the stops that would topple the robot, as long as something else is left that helps in time.

        What is left is faster than the predicted accident: the proposals are feasible ones.
        """
        toppling = [p for p in proposals if self._topples(p, present)]
        if not toppling:
            return proposals
        others = [
            p
            for p in proposals
            if p not in toppling and p.action not in (*UNCONDITIONAL, ANNOUNCE) and not self.actions[p.action].mitigates
        ]
        return [p for p in proposals if p not in toppling] if others else proposals

    def _topples(self, proposal: Proposal, present: frozenset[str]) -> bool:
        spec = self.actions[proposal.action]
        return spec.stops and not present.isdisjoint(spec.may_worsen)

    def _committed(self, state: ArbiterState, action: str, now_ns: int) -> bool:
        """Whether a mitigation has begun so lately that it is not given up: a prediction at its edge flickers."""
        since = state.engaged_ns.get(action)
        return since is not None and action not in state.releasing and now_ns - since < MITIGATION_NS

    def choose(self, proposals: Sequence[Proposal], present: frozenset[str]) -> list[Proposal]:
        """One proposal per resource: mitigation, then level, then not worsening a present kind, then strength, id.

        Proposals of one action are one, at the highest level and strength that any of them asks for.
        """
        merged = {p.action: p for p in proposals}
        if len(merged) < len(proposals):
            merged.clear()
            for p in sorted(proposals, key=lambda p: (p.action, -p.level, -p.strength, p.mode, p.rule)):
                first = merged.setdefault(p.action, p)
                if p.strength > first.strength:
                    merged[p.action] = msgspec.structs.replace(first, strength=p.strength)

        def rank(p: Proposal) -> tuple[bool, int, bool, float, str]:
            spec = self.actions[p.action]
            return (not spec.mitigates, -p.level, not present.isdisjoint(spec.may_worsen), -p.strength, p.action)

        taken: set[str] = set()
        chosen: list[Proposal] = []
        for p in sorted(merged.values(), key=rank):
            resources = self.actions[p.action].resources
            if taken.isdisjoint(resources):
                taken.update(resources)
                chosen.append(p)
        return chosen

    def step(
        self, state: ArbiterState, situation: Situation, proposals: Sequence[Proposal]
    ) -> tuple[ArbiterState, tuple[Intervention, ...], tuple[Intervention, ...]]:
        """Next state, the interventions that hold, and those that the robot must be told of now."""
        if not proposals and not state.active:
            return state, (), ()
        now = situation.now_ns
        present = frozenset([p.kind for p in situation.precursors if p.phase != "cleared"])
        timed = situation.time_to_event_s is not None or bool(situation.times)
        asked = frozenset(proposals)
        if not timed and state.settled == (asked, present):
            return state, state.held, ()
        wanted = [p for p in proposals if p.strength > 0.0]
        feasible = [
            p
            for mode in dict.fromkeys(p.mode for p in wanted)
            for p in self._upright(
                self.feasible(state, [p for p in wanted if p.mode == mode], now, situation.time_to(mode)), present
            )
        ]
        active: dict[str, Intervention] = {}
        engaged: dict[str, int] = {}
        changes: list[Intervention] = []
        chosen = self.choose(feasible, present)
        if resumed := self._resumed(state, chosen):
            why = f"motion resumes: {', '.join(resumed)} is released"
            chosen.append(Proposal(ANNOUNCE, 1.0, ProtectionLevel.NORMAL, "", why))
        for p in chosen:
            held = state.active.get(p.action)
            if held is None or p.action in state.releasing or self._moved(held.strength, p.strength):
                seen = [f"{e.kind}@{e.subject}" if e.subject else e.kind for e in situation.precursors]
                held = Intervention(now, p.action, p.strength, p.mode, (p.rule, *seen))
                changes.append(held)
            active[p.action] = held
            engaged[p.action] = state.engaged_ns.get(p.action, now)
        releasing: dict[str, tuple[int, float]] = {}
        leaving = [(action, held) for action, held in state.active.items() if action not in active]
        taken = {r: a for a in active for r in self.actions[a].resources} if leaving else {}
        for action, held in leaving:
            successors = sorted({taken[r] for r in self.actions[action].resources if r in taken})
            if successors:
                reason = f"gives way to {', '.join(successors)}"
                changes.append(Intervention(now, action, 0.0, held.mode, ("released", reason)))
                continue
            since, full = state.releasing.get(action, (now, held.strength))
            gone = (now - since) / self._release_ns if self._release_ns else 1.0
            left = full * (1.0 - gone)
            if left <= 0.0:
                changes.append(Intervention(now, action, 0.0, held.mode, ("released",)))
                continue
            releasing[action] = (since, full)
            if self._moved(held.strength, left):
                held = Intervention(now, action, left, held.mode, ("release ramp",))
                changes.append(held)
            active[action] = held
            engaged[action] = state.engaged_ns.get(action, now)
        held_now = tuple(active[a] for a in sorted(active))
        timed = timed or bool(releasing) or bool(resumed) or any(self.actions[a].mitigates for a in active)
        after = ArbiterState(active, engaged, releasing, held_now, None if timed else (asked, present))
        return after, held_now, tuple(sorted(changes, key=lambda i: i.action))

    def _resumed(self, state: ArbiterState, chosen: Sequence[Proposal]) -> list[str]:
        """Actions that end now, so that motion begins again, and that nobody has announced."""
        wanted = {p.action for p in chosen}
        if wanted.issuperset(state.active) or ANNOUNCE in wanted or ANNOUNCE not in self.actions:
            return []
        taken = {r for a in wanted for r in self.actions[a].resources}
        going = [self.actions[a] for a in sorted(state.active.keys() - wanted)]
        return [a.id for a in going if a.resumes and taken.isdisjoint(a.resources)]

    def _moved(self, old: float, new: float) -> bool:
        return new > old or old - new >= self._step or (new != old and new == 0.0)
