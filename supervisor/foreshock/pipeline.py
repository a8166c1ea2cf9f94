"""One tick: samples in, decision out, over evidence, risk, trust and policy.

The containments hold the detectors' own state; everything else that a tick remembers is in the frozen State.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from types import MappingProxyType

import msgspec

from foreshock import evidence as ev
from foreshock.containment import AHEAD_NS, ChannelView, Contained, proposals_of
from foreshock.errors import BadInputError, nearest
from foreshock.messages import is_finite
from foreshock.policy import Arbiter, ArbiterState, Policy, Proposal, Situation
from foreshock.records import ChannelState, Decision, Health, Indication, Intervention, ProtectionLevel, Sample
from foreshock.risk import IndependentRisk
from foreshock.trust import Gates, LevelState, TrustModel, TrustState, level_step

__all__ = ["Pipeline", "State"]


class State(msgspec.Struct, frozen=True):
    """What a tick remembers for the next.

    Attributes:
        tick: number of the next tick.
        began_ns: when warm-up began.
        evidence: tracks inside the window.
        carried: the last indications of detectors that are ok.
        spoken: (kind, subject) pairs of which each detector spoke when it was last ok.
        predicted: tick and time_to_event_s of predictions that nobody has withdrawn.
        missing: configured kinds that were never observed since reset.
        trust: control-level trust.
        overall: protection level from overall trust and lost evidence.
        levels: protection level per accident mode.
        arbiter: what the arbiter has seen.
        health: state and reason of detectors and channels.
    """

    tick: int = 0
    began_ns: int = 0
    evidence: ev.Evidence = ev.Evidence()
    carried: Mapping[ev.Key, Indication] = {}
    spoken: Mapping[str, frozenset[tuple[str, str]]] = {}
    predicted: Mapping[ev.Key, tuple[int, float]] = {}
    missing: frozenset[str] = frozenset()
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
            BadInputError: a verdict on a detector that does not run.
        """
        ids = [d.spec.id for d in self.detectors]
        for name in verdicts or ():
            if name not in ids:
                raise BadInputError("verdicts", f"no detector {name!r} runs", nearest(name, ids))
        for sample in samples:
            self._take(sample, now_ns)
        observed: dict[ev.Key, Indication] = {}
        carried: dict[ev.Key, Indication] = {}
        health: dict[str, tuple[ChannelState, str]] = {}
        spoken: dict[str, frozenset[tuple[str, str]]] = {}
        lost: list[str] = []
        silent: dict[str, frozenset[str]] = {}
        for d in self.detectors:
            name = d.spec.id
            outcome = d.tick(now_ns, self.channels, verdicts.get(name, "") if verdicts else "")
            health[name] = (outcome.state, outcome.reason)
            if outcome.state != "ok":
                lost.append(name)
                silent[name] = d.kinds
                continue
            if outcome.due:
                for i in outcome.said:
                    observed[i.kind, i.subject, name] = i
                said = {k: i for k, i in observed.items() if k[2] == name}
            else:
                said = {k: i for k, i in state.carried.items() if k[2] == name}
            carried.update(said)
            spoken[name] = frozenset(k[:2] for k in said)
            silent[name] = d.kinds - {k[0] for k in said}
        for channel, view in self.channels.items():
            if view.fault:
                health[channel] = ("failed", view.fault)
        unobserved = _unobserved(silent, spoken, state.spoken)
        missing = state.missing - {k[0] for k in carried}
        tracks, precursors = ev.step(state.evidence, self._window, now_ns, observed, lost, carried)
        # a subject that its detector no longer speaks of is not observed either
        unobserved |= {p.kind for p in precursors if p.frozen}
        partial = _partial(silent, tracks, lost)
        for name, what in partial.items():
            health[name] = ("unobserved", f"does not observe {', '.join(what)}")
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
        predicted = _predicted(state.predicted, observed, tracks, lost, now_ns)
        times = self._times(predicted, now_ns)
        soonest = min(times.values(), default=None)
        by_mode = {mode: s.level for mode, s in levels.items()}
        arbiter = state.arbiter
        held: tuple[Intervention, ...] = ()
        changes: tuple[Intervention, ...] = ()
        if not warm:
            # read-only: a policy is a plugin, and must not write into what the next tick starts from
            seen_levels, seen_trust = MappingProxyType(by_mode), MappingProxyType(trust.control_by_mode)
            situation = Situation(
                now_ns, seen_levels, seen_trust, trust.control_trust, overall.level, precursors, soonest, times
            )
            proposals, fault = proposals_of(self._policies, situation, self._arbiter.actions)
            if fault:
                health["policy"] = ("failed", fault)
                overall = level_step(overall, self._gates, trust.control_trust, True, now_ns)
            if overall.level is ProtectionLevel.MINIMAL_RISK:
                why = fault or "latched until an operator resets it"
                if overdue:
                    why = f"unobserved beyond the grace time: {', '.join(trust.unobserved)}"
                proposals.append(Proposal("minimal-risk", 1.0, ProtectionLevel.MINIMAL_RISK, "", why))
            arbiter, held, changes = self._arbiter.step(state.arbiter, situation, proposals)
        level = max(by_mode.values(), default=ProtectionLevel.NORMAL)
        if overall.level is ProtectionLevel.MINIMAL_RISK:
            level = ProtectionLevel.MINIMAL_RISK
        # a detector fails a few times at most before it is given up, so that each reason is worth telling
        steady = {*partial, *(name for name in ids if health[name][0] == "failed")}
        news = _news(state.health, health, steady, now_ns)
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
            tuple(observed.values()),
        )
        after = State(
            state.tick + 1,
            state.began_ns,
            tracks,
            carried,
            {**state.spoken, **spoken},
            predicted,
            missing,
            trust_state,
            overall,
            levels,
            arbiter,
            health,
        )
        return after, decision

    def _times(self, predicted: Mapping[ev.Key, tuple[int, float]], now_ns: int) -> dict[str, float]:
        """Shortest predicted time (s) from now per accident mode that one is predicted for."""
        times: dict[str, float] = {}
        for (kind, _, _), (at_ns, time_s) in predicted.items():
            left_s = max(0.0, time_s - (now_ns - at_ns) / 1e9)
            for mode in self._risk.modes_of(kind):
                times[mode] = min(left_s, times.get(mode, left_s))
        return times

    def _take(self, sample: Sample, now_ns: int) -> None:
        """Give a sample to those who read its channel; what is malformed is kept from them and marks the channel."""
        view = self.channels.get(sample.channel)
        if view is not None:
            fault = self._fault(sample, now_ns)
            view.judge(fault, now_ns)
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
        if type(sample.stamp_ns) is not int:
            return f"{sample.channel} has the stamp {sample.stamp_ns!r}, an int of nanoseconds is expected"
        for wanted in self._types[sample.channel]:
            if not isinstance(sample.value, wanted):
                return f"{sample.channel} carries {type(sample.value).__name__}, {wanted.__name__} is expected"
        if not is_finite(sample.value):
            return f"{sample.channel} carries a number that is not finite"
        if sample.stamp_ns > now_ns + AHEAD_NS:
            return f"{sample.channel} is stamped {(sample.stamp_ns - now_ns) / 1e6:.0f} ms ahead of the supervisor"
        return ""


def _unobserved(
    silent: Mapping[str, frozenset[str]],
    spoken: Mapping[str, frozenset[tuple[str, str]]],
    before: Mapping[str, frozenset[tuple[str, str]]],
) -> set[str]:
    """Kinds that some detector does not observe now and that nobody else observes in its place.

    Another detector stands in only if it speaks of every subject of which the silent one spoke when it was last ok: the
    right foot's slip detector does not watch the left foot.

    Args:
        silent: declared kinds of which a detector does not speak now.
        spoken: pairs (kind, subject) of which each detector that is ok speaks now.
        before: the same of every detector when it was last ok.
    """
    now = frozenset().union(*spoken.values())
    unobserved: set[str] = set()
    for name, kinds in silent.items():
        for kind in kinds:
            owed = {pair for pair in before.get(name, frozenset()) if pair[0] == kind}
            if not owed or not owed <= now:
                unobserved.add(kind)
    return unobserved


def _partial(silent: Mapping[str, frozenset[str]], evidence: ev.Evidence, lost: Sequence[str]) -> dict[str, list[str]]:
    """What detectors that are otherwise ok do not speak of although they should: kinds, and ``kind@subject``."""
    found = {name: sorted(kinds) for name, kinds in silent.items() if kinds and name not in lost}
    for (kind, subject, name), track in sorted(evidence.tracks.items(), key=lambda item: item[0]):
        if track.frozen_ns >= 0 and name not in lost and kind not in silent.get(name, ()):
            found.setdefault(name, []).append(f"{kind}@{subject}" if subject else kind)
    return found


def _predicted(
    before: Mapping[ev.Key, tuple[int, float]],
    observed: Mapping[ev.Key, Indication],
    evidence: ev.Evidence,
    lost: Sequence[str],
    now_ns: int,
) -> dict[ev.Key, tuple[int, float]]:
    """Predictions that stand: silence does not withdraw one while its evidence stands, and its time runs on."""
    said = {k: (now_ns, i.time_to_event_s) for k, i in observed.items() if i.time_to_event_s is not None}
    kept = {k: p for k, p in before.items() if k not in observed and (k in evidence.tracks or k[2] in lost)}
    return {**kept, **said}


def _news(
    before: Mapping[str, tuple[ChannelState, str]],
    after: Mapping[str, tuple[ChannelState, str]],
    steady: Collection[str],
    now_ns: int,
) -> tuple[Health, ...]:
    """Health that changed; a reason that only counts on (an age) is not news, one of the steady names is."""
    news = [
        Health(now_ns, name, state, reason)
        for name, (state, reason) in after.items()
        if name not in before
        or before[name][0] != state
        or ((state == "ok" or name in steady) and before[name][1] != reason)
    ]
    news += [Health(now_ns, name, "ok") for name in before if name not in after]
    return tuple(news)
