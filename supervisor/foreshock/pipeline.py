"""One tick: samples in, decision out, over evidence, risk, trust and policy.

The containments hold the detectors' own state; everything else that a tick remembers is in the frozen State.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

import msgspec

from foreshock import coverage as cov
from foreshock import evidence as ev
from foreshock.channels import ChannelView, unread
from foreshock.containment import Contained, proposals_of
from foreshock.detector import Input
from foreshock.errors import BadInputError, nearest
from foreshock.policy import MINIMAL_RISK, Arbiter, ArbiterState, Policy, Proposal, Situation
from foreshock.records import Decision, Explanation, Intervention, Precursor, ProtectionLevel, Sample
from foreshock.risk import RiskModel
from foreshock.taxonomy import Taxonomy
from foreshock.trust import Gates, LevelState, TrustModel, TrustState, edge_step, levels_step

__all__ = ["Pipeline", "State"]


class State(msgspec.Struct, frozen=True):
    """What a tick remembers for the next.

    Attributes:
        tick: number of the next tick.
        began_ns: when warm-up began.
        evidence: tracks inside the window.
        carried: the last indications of each detector that is ok.
        spoken: what each detector said when it was last ok.
        predicted: tick and time_to_event_s of predictions that nobody has withdrawn.
        missing: configured kinds that were never observed since reset.
        trust: control-level trust.
        overall: protection level from overall trust and lost evidence.
        levels: protection level per accident mode.
        class_levels: protection level per precursor class.
        arbiter: what the arbiter has seen.
        health: state and reason of detectors and channels.
    """

    tick: int = 0
    began_ns: int = 0
    evidence: ev.Evidence = ev.Evidence()
    carried: Mapping[str, cov.Said] = {}
    spoken: Mapping[str, cov.Said] = {}
    predicted: Mapping[ev.Key, cov.Prediction] = {}
    missing: frozenset[str] = frozenset()
    trust: TrustState = TrustState()
    overall: LevelState = LevelState()
    levels: Mapping[str, LevelState] = {}
    class_levels: Mapping[str, LevelState] = {}
    arbiter: ArbiterState = ArbiterState()
    health: cov.HealthMap = {}


PROTECTIVE = ProtectionLevel.PROTECTIVE


class Pipeline:
    """The fixed machinery of one supervisor.

    Args:
        detectors: contained, sorted by id.
        window: of the evidence.
        risk: precursors to RiskEstimate.
        trust: RiskEstimate to Trust.
        gates: trust to protection levels.
        policies: levels to proposals.
        arbiter: proposals to interventions.
        taxonomy: whose modes and classes are the dimensions of trust.

    Raises:
        ConfigError: the gates name a dimension that does not exist.
    """

    def __init__(
        self,
        detectors: Sequence[Contained],
        window: ev.Window,
        risk: RiskModel,
        trust: TrustModel,
        gates: Gates,
        policies: Sequence[Policy],
        arbiter: Arbiter,
        taxonomy: Taxonomy,
    ) -> None:
        self.detectors = tuple(detectors)
        self._window, self._risk, self._trust = window, risk, trust
        self._gates, self._mode_gates = gates.of_overall(), gates.of_modes(taxonomy)
        self._edges = self._gates.edges()
        self._mode_edges = {mode: g.edges() for mode, g in self._mode_gates.items()}
        self._class_edges = {class_: g.edges() for class_, g in gates.of_classes(taxonomy).items()}
        self._policies, self._arbiter = tuple(policies), arbiter
        self.warm_up_ns = max((round(d.spec.warm_up_s * 1e9) for d in detectors), default=0)
        self._ids = [d.spec.id for d in self.detectors]
        self._everything: list[list[Sample]] = []
        readers: dict[str, list[tuple[Input, list[Sample]]]] = {}
        for d in self.detectors:
            for i in d.inputs:
                if i.channel == "*":
                    self._everything.append(d.pending[i.name])
                else:
                    readers.setdefault(i.channel, []).append((i, d.pending[i.name]))
        self.channels = {
            channel: ChannelView([need for need, _ in pairs], [queue for _, queue in pairs])
            for channel, pairs in readers.items()
        }

    def reset(self, seed: int, now_ns: int) -> State:
        """Forget everything; the state to start from."""
        for view in self.channels.values():
            view.reset()
        for d in self.detectors:
            d.reset(seed, now_ns)
        return State(began_ns=now_ns, missing=frozenset().union(*(d.kinds for d in self.detectors)))

    def step(
        self, state: State, samples: Sequence[Sample], now_ns: int, verdicts: Mapping[str, str] | None = None
    ) -> tuple[State, Decision]:
        """Next state and the decision of one tick.

        Args:
            state: after the previous tick.
            samples: what arrived since.
            now_ns: time of the tick.
            verdicts: recorded wall-clock verdicts by detector id (late, hung).

        Raises:
            BadInputError: a verdict on a detector that does not run, or one that is not a str.
        """
        for name, verdict in (verdicts or {}).items():
            if name not in self._ids:
                raise BadInputError("verdicts", f"no detector {name!r} runs", nearest(name, self._ids))
            if type(verdict) is not str:
                raise BadInputError(f"verdicts.{name}", f"{verdict!r} is not a str")
        malformed: dict[str, str] = {}
        for sample in samples:
            # a channel of no type cannot even be looked up
            view = self.channels.get(sample.channel) if type(getattr(sample, "channel", None)) is str else None
            if view is None:
                source, fault = unread(sample)
                if fault:
                    malformed[source] = fault
                    continue
            elif not view.take(sample, now_ns):
                continue
            for queue in self._everything:
                queue.append(sample)
        heard = cov.listen(self.detectors, self.channels, state.carried, verdicts or {}, now_ns)
        health = heard.health
        for channel, view in self.channels.items():
            if view.fault:
                health[channel] = ("failed", view.fault)
            elif view.still_ns and (frozen := view.frozen()):
                health[channel] = ("stale", frozen)
        for source, fault in malformed.items():
            health[source] = ("failed", fault)
        unobserved = cov.unobserved(heard, state.spoken)
        missing = state.missing
        if missing:
            missing = missing.difference([kind for said in heard.carried.values() for kind, _, _ in said])
        tracks, precursors = ev.step(state.evidence, self._window, now_ns, heard.observed, heard.lost, heard.standing)
        # a subject that its detector no longer speaks of is not observed either
        unobserved.update([p.kind for p in precursors if p.frozen])
        partial = cov.partial(heard, tracks)
        for name, what in partial.items():
            health[name] = ("unobserved", f"does not observe {', '.join(what)}")
        risk = self._risk.estimate(precursors)
        warm = now_ns - state.began_ns < self.warm_up_ns
        trust_state, trust, overdue = self._trust.step(state.trust, risk, sorted(unobserved), now_ns)
        if warm:
            trust_state, overdue = msgspec.structs.replace(trust_state, unobserved_ns={}), False
        overall = edge_step(state.overall, self._edges, trust.control_trust, overdue, now_ns)
        levels = levels_step(state.levels, self._mode_edges, trust.control_by_mode, now_ns)
        class_levels = levels_step(state.class_levels, self._class_edges, trust.control_by_class, now_ns)
        predicted = cov.standing_predictions(state.predicted, heard, tracks, now_ns)
        times = self._times(predicted, now_ns)
        soonest = min(times.values(), default=None)
        by_mode = {mode: s.level for mode, s in levels.items()}
        by_class = {class_: s.level for class_, s in class_levels.items()}
        arbiter = state.arbiter
        held: tuple[Intervention, ...] = ()
        changes: tuple[Intervention, ...] = ()
        if not warm:
            # read-only: a policy is a plugin, and must not write into what the next tick starts from
            seen_levels, seen_trust = MappingProxyType(by_mode), MappingProxyType(trust.control_by_mode)
            situation = Situation(
                now_ns,
                seen_levels,
                seen_trust,
                trust.control_trust,
                overall.level,
                precursors,
                soonest,
                times,
                MappingProxyType(by_class),
                MappingProxyType(trust.control_by_class),
            )
            proposals, fault = proposals_of(self._policies, situation, self._arbiter.actions)
            if fault:
                health["policy"] = ("failed", fault)
                overall = edge_step(overall, self._edges, trust.control_trust, True, now_ns)
            if overall.level is ProtectionLevel.MINIMAL_RISK:
                why = fault or "latched until an operator resets it"
                if overdue:
                    why = f"unobserved beyond the grace time: {', '.join(trust.unobserved)}"
                proposals.append(Proposal(MINIMAL_RISK, 1.0, ProtectionLevel.MINIMAL_RISK, "", why))
            arbiter, held, changes = self._arbiter.step(state.arbiter, situation, proposals)
        level = max(by_mode.values(), default=ProtectionLevel.NORMAL)
        if overall.level is ProtectionLevel.MINIMAL_RISK:
            level = ProtectionLevel.MINIMAL_RISK
        # a detector fails a few times at most before it is given up, so that each reason is worth telling
        news = cov.news(
            state.health,
            health,
            lambda: {*partial, *(name for name in self._ids if health[name][0] == "failed")},
            now_ns,
            heard.judged,
        )
        decision = Decision(
            now_ns,
            state.tick,
            precursors,
            risk,
            trust,
            level,
            by_mode,
            held,
            changes,
            news,
            # nobody may move before every configured kind has been observed once: silence is not safety
            not warm and not missing and level < ProtectionLevel.MINIMAL_RISK,
            soonest,
            tuple(heard.observed.values()),
            by_class,
            self._explanations(state, overall, levels, precursors),
        )
        after = State(
            state.tick + 1,
            state.began_ns,
            tracks,
            heard.carried,
            {**state.spoken, **heard.carried},
            predicted,
            missing,
            trust_state,
            overall,
            levels,
            class_levels,
            arbiter,
            health,
        )
        return after, decision

    def _explanations(
        self, before: State, overall: LevelState, levels: Mapping[str, LevelState], precursors: Sequence[Precursor]
    ) -> tuple[Explanation, ...]:
        """Why the overall level, or that of a mode, rose in this tick."""
        rises = [("", self._gates, before.overall, overall)] if overall is not before.overall else []
        if levels is not before.levels:
            rises += [(m, self._mode_gates[m], before.levels.get(m, LevelState()), s) for m, s in levels.items()]
        return tuple(
            [
                self._risk.explain(precursors, gates.protective if now.level >= PROTECTIVE else gates.caution, mode)
                for mode, gates, old, now in rises
                if now.level > old.level
            ]
        )

    def _times(self, predicted: Mapping[ev.Key, tuple[int, float]], now_ns: int) -> dict[str, float]:
        """Shortest predicted time (s) from now per accident mode that one is predicted for."""
        times: dict[str, float] = {}
        for (kind, _, _), (at_ns, time_s) in predicted.items():
            left_s = max(0.0, time_s - (now_ns - at_ns) / 1e9)
            for mode in self._risk.modes_of(kind):
                times[mode] = min(left_s, times.get(mode, left_s))
        return times
