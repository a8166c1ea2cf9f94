"""One tick: samples in, decision out, over evidence, risk, trust and policy.

The containments hold the detectors' own state; everything else that a tick remembers is in the frozen State.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import msgspec

from foreshock import evidence as ev
from foreshock.containment import ChannelView, Contained, proposals_of
from foreshock.messages import is_finite
from foreshock.policy import Arbiter, ArbiterState, Policy, Proposal, Situation
from foreshock.records import ChannelState, Decision, Health, Indication, Intervention, ProtectionLevel, Sample
from foreshock.risk import IndependentRisk
from foreshock.trust import Gates, LevelState, TrustModel, TrustState, level_step

__all__ = ["Pipeline", "State"]

AHEAD_NS = 10_000_000
"""A stamp further ahead of the tick than this is malformed."""


class State(msgspec.Struct, frozen=True):
    """What a tick remembers for the next."""

    tick: int = 0
    began_ns: int = 0
    evidence: ev.Evidence = ev.Evidence()
    carried: Mapping[ev.Key, Indication] = {}
    trust: TrustState = TrustState()
    overall: LevelState = LevelState()
    levels: Mapping[str, LevelState] = {}
    arbiter: ArbiterState = ArbiterState()
    health: Mapping[str, tuple[ChannelState, str]] = {}


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
        modes: codes of all accident modes.
    """

    def __init__(
        self,
        detectors: Sequence[Contained],
        window: ev.Window,
        risk: IndependentRisk,
        trust: TrustModel,
        gates: Gates,
        policies: Sequence[Policy],
        arbiter: Arbiter,
        modes: Sequence[str],
    ) -> None:
        self.detectors = tuple(detectors)
        self._window, self._risk, self._trust, self._gates = window, risk, trust, gates
        self._policies, self._arbiter, self._modes = tuple(policies), arbiter, tuple(modes)
        self.warm_up_ns = max((round(d.spec.warm_up_s * 1e9) for d in detectors), default=0)
        self._types: dict[str, tuple[type, ...]] = {}
        self._queues: dict[str, list[list[Sample]]] = {}
        everything: list[list[Sample]] = []
        for d in detectors:
            for i in d.inputs:
                if i.channel == "*":
                    everything.append(d.pending[i.name])
                    continue
                self._types[i.channel] = (*self._types.get(i.channel, ()), i.type)
                self._queues.setdefault(i.channel, []).append(d.pending[i.name])
        self._everything = everything
        self._rated = {i.channel for d in detectors for i in d.inputs if i.min_rate_hz > 0}
        self.channels: dict[str, ChannelView] = {c: ChannelView() for c in self._types}

    def reset(self, seed: int, now_ns: int) -> State:
        """Forget everything; the state to start from."""
        for c in self.channels:
            self.channels[c] = ChannelView()
        for d in self.detectors:
            d.reset(seed, now_ns)
        return State(began_ns=now_ns)

    def step(
        self, state: State, samples: Sequence[Sample], now_ns: int, verdicts: Mapping[str, str] | None = None
    ) -> tuple[State, Decision]:
        """Next state and the decision of one tick.

        Args:
            state: after the previous tick.
            samples: what arrived since.
            now_ns: time of the tick.
            verdicts: recorded wall-clock verdicts by detector id (late, hung).
        """
        for sample in samples:
            self._take(sample, now_ns)
        observed: dict[ev.Key, Indication] = {}
        carried: dict[ev.Key, Indication] = {}
        health: dict[str, tuple[ChannelState, str]] = {}
        lost: list[str] = []
        unobserved: set[str] = set()
        reported: set[str] = set()
        for d in self.detectors:
            name = d.spec.id
            outcome = d.tick(now_ns, self.channels, verdicts.get(name, "") if verdicts else "")
            health[name] = (outcome.state, outcome.reason)
            if outcome.state != "ok":
                lost.append(name)
                unobserved |= d.kinds
                continue
            if not outcome.due:
                before = {k: i for k, i in state.carried.items() if k[2] == name}
                carried.update(before)
                reported |= {k[0] for k in before}
                unobserved |= d.kinds - {k[0] for k in before}
                continue
            for i in outcome.said:
                key = (i.kind, i.subject, name)
                observed[key] = carried[key] = i
                reported.add(i.kind)
            unobserved |= outcome.missing
            if outcome.missing:
                health[name] = ("ok", f"does not observe {', '.join(sorted(outcome.missing))}")
        for channel, view in self.channels.items():
            if view.fault:
                health[channel] = ("failed", view.fault)
        unobserved -= reported
        tracks, precursors = ev.step(state.evidence, self._window, now_ns, observed, lost, carried)
        # a subject that its detector no longer speaks of is not observed either
        unobserved |= {p.kind for p in precursors if p.frozen}
        risk = self._risk.estimate(precursors)
        warm = now_ns - state.began_ns < self.warm_up_ns
        trust_state, trust, overdue = self._trust.step(state.trust, risk, sorted(unobserved), now_ns)
        if warm:
            trust_state, overdue = msgspec.structs.replace(trust_state, unobserved_ns={}), False
        overall = level_step(state.overall, self._gates, trust.control_trust, overdue, now_ns)
        levels = {
            mode: level_step(state.levels.get(mode, LevelState()), self._gates, t, False, now_ns)
            for mode, t in trust.control_by_mode.items()
        }
        times = [i.time_to_event_s for i in carried.values() if i.time_to_event_s is not None]
        soonest = min(times, default=None)
        by_mode = {mode: s.level for mode, s in levels.items()}
        arbiter = state.arbiter
        held: tuple[Intervention, ...] = ()
        changes: tuple[Intervention, ...] = ()
        if not warm:
            situation = Situation(
                now_ns, by_mode, trust.control_by_mode, trust.control_trust, overall.level, precursors, soonest
            )
            proposals, fault = proposals_of(self._policies, situation, self._arbiter.actions)
            if fault:
                health["policy"] = ("failed", fault)
                overall = level_step(overall, self._gates, trust.control_trust, True, now_ns)
            if overall.level is ProtectionLevel.MINIMAL_RISK:
                why = fault or f"unobserved beyond the grace time: {', '.join(trust.unobserved)}"
                proposals.append(Proposal("minimal-risk", 1.0, ProtectionLevel.MINIMAL_RISK, "", why))
            arbiter, held, changes = self._arbiter.step(state.arbiter, situation, proposals)
        level = max(by_mode.values(), default=ProtectionLevel.NORMAL)
        if overall.level is ProtectionLevel.MINIMAL_RISK:
            level = ProtectionLevel.MINIMAL_RISK
        news = _news(state.health, health, now_ns)
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
            not warm and level < ProtectionLevel.MINIMAL_RISK,
            soonest,
            tuple(observed.values()),
        )
        after = State(state.tick + 1, state.began_ns, tracks, carried, trust_state, overall, levels, arbiter, health)
        return after, decision

    def _take(self, sample: Sample, now_ns: int) -> None:
        """Give a sample to those who read its channel; what is malformed is kept from them and marks the channel."""
        view = self.channels.get(sample.channel)
        if view is not None:
            fault = self._fault(sample, now_ns)
            view.fault = fault
            if fault:
                return
            if view.latest is None or sample.stamp_ns >= view.latest.stamp_ns:
                view.latest = sample
            if sample.channel in self._rated:
                view.arrivals.append(now_ns)
            for queue in self._queues[sample.channel]:
                queue.append(sample)
        for queue in self._everything:
            queue.append(sample)

    def _fault(self, sample: Sample, now_ns: int) -> str:
        for wanted in self._types[sample.channel]:
            if not isinstance(sample.value, wanted):
                return f"{sample.channel} carries {type(sample.value).__name__}, {wanted.__name__} is expected"
        if not is_finite(sample.value):
            return f"{sample.channel} carries a number that is not finite"
        if sample.stamp_ns > now_ns + AHEAD_NS:
            return f"{sample.channel} is stamped {(sample.stamp_ns - now_ns) / 1e6:.0f} ms ahead of the supervisor"
        return ""


def _news(
    before: Mapping[str, tuple[ChannelState, str]], after: Mapping[str, tuple[ChannelState, str]], now_ns: int
) -> tuple[Health, ...]:
    """Health that changed; a reason that only counts on (an age) is not news."""
    news = [
        Health(now_ns, name, state, reason)
        for name, (state, reason) in after.items()
        if name not in before or before[name][0] != state or (state == "ok" and before[name][1] != reason)
    ]
    news += [Health(now_ns, name, "ok") for name in before if name not in after]
    return tuple(news)
