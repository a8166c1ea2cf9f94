"""A stepped run: twin and supervisor in lockstep on simulated time. Nothing here reads a clock."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence

from msgspec.structs import replace

from foreshock.clock import NS_PER_S, ns, seconds
from foreshock.errors import ConfigError
from foreshock.journal import DigestJournal, Journal
from foreshock.records import Decision, Health, Intervention, ProtectionLevel
from foreshock.session.crashes import Crashes
from foreshock.session.faulty import FaultyTwin
from foreshock.session.run import Arm, Run, TimelineRow
from foreshock.session.scenario import Scenario
from foreshock.supervisor import Supervisor
from foreshock.twin import Twin, TwinEvent

__all__ = ["simulate", "warnings_of"]

AFTERMATH_S = 0.5
"""A run goes on for this long after the accident, so that its peak force is seen."""


def simulate(
    scenario: Scenario,
    twin: Twin,
    supervisor: Supervisor | None,
    arm: Arm,
    seed: int,
    *,
    detail: bool = True,
    scripted: Sequence[Intervention] = (),
    journals: Sequence[Journal] = (),
    progress: Callable[[float], None] | None = None,
) -> Run:
    """Run a scenario.

    Args:
        scenario: what to run.
        twin: where.
        supervisor: who judges; None if the arm is ``off``.
        arm: on (judges and acts), shadow (judges), off.
        seed: of all randomness in the twin and the detectors.
        detail: keep timeline, series and digest.
        scripted: interventions that nobody decides: each holds from its stamp on. For comparison with those that are
            decided; only without a supervisor that acts.
        journals: further records of every tick.
        progress: told the simulated time in s now and then.

    Raises:
        TwinError: the twin failed.
        ConfigError: the periods of twin and supervisor do not fit, or a fault fits neither.
    """
    if scripted and arm == "on":
        raise ConfigError(scenario.id, "scripted interventions would meet those of the supervisor", "; take arm off")
    waiting = deque(sorted(scripted, key=lambda i: i.stamp_ns))
    judge = supervisor if arm != "off" else None
    if judge is None and arm != "off":
        raise ConfigError(scenario.id, f"arm {arm!r} needs a supervisor")
    period = judge.period_ns if judge is not None else twin.period_ns
    if period % twin.period_ns:
        raise ConfigError(
            f"{scenario.id}: config.supervisor.period_s",
            f"{seconds(period):g} s is not a multiple of the twin's step of {seconds(twin.period_ns):g} s",
        )
    if scenario.faults:
        twin = FaultyTwin(twin, scenario.faults, scenario.id)
    ids = [spec.id for spec in judge.detectors] if judge is not None else []
    crashes = Crashes(scenario.faults if judge is not None else (), ids, seed, scenario.id)
    parameters = scenario.drawn(seed)
    twin.reset(parameters, seed)
    if judge is not None:
        judge.reset(seed)
    digest = DigestJournal()
    recorders = (digest, *journals) if detail else tuple(journals)
    tied = judge.taxonomy.kinds_of(scenario.mode) if judge is not None else frozenset()
    caution = judge.config.gates.of_modes(judge.taxonomy)[scenario.mode].caution if judge is not None else 1.0
    log = _Log(scenario.mode, tied, caution, detail)
    now, end, stop = 0, ns(scenario.duration_s), None
    told = 0
    ignored: set[str] = set()
    while now < end and (stop is None or now < stop):
        now += period
        while waiting and waiting[0].stamp_ns < now:
            change = waiting.popleft()
            if change.action in twin.actions:
                twin.intervene(change)
            else:
                ignored.add(change.action)
        samples = twin.advance(now)
        events = _events(scenario, twin)
        decision = None
        if judge is not None:
            decision = judge.step(samples, now, crashes.at(now))
            for recorder in recorders:
                recorder.tick(samples, decision, judge.verdicts_of(decision))
            if arm == "on":
                for change in decision.changes:
                    if change.action in twin.actions:
                        twin.intervene(change)
                    else:
                        ignored.add(change.action)
        log.tick(now, decision, events, twin)
        if stop is None and any(e.mode == scenario.mode for e in events):
            stop = now + ns(AFTERMATH_S)
        if progress is not None and now - told >= NS_PER_S // 4:
            told = now
            progress(seconds(now))
    events = _events(scenario, twin)
    accidents = [e for e in events if e.mode == scenario.mode]
    outcome = accidents[0].id if accidents else events[0].id if events else "none"
    policies = "+".join(p.use for p in judge.config.policies) if judge is not None else ""
    return Run(
        scenario.id,
        scenario.mode,
        arm,
        policies,
        seed,
        parameters,
        bool(accidents),
        outcome,
        events,
        seconds(now),
        log.first_s,
        log.gate_s,
        tuple(log.interventions),
        tuple(sorted(ignored)),
        tuple(log.health),
        tuple(log.rows),
        log.series,
        digest.digest if detail and judge is not None else "",
        log.max_level,
        warnings_of(judge, scenario.mode) if judge is not None else (),
        log.peak_p,
        None if accidents else log.safe_s,
    )


def warnings_of(supervisor: Supervisor, mode: str | None = None) -> tuple[str, ...]:
    """What of a supervisor's configuration is allowed but leaves it without sight or without means.

    Args:
        supervisor: what runs.
        mode: code of the accident mode that matters; None where any may.
    """
    found = []
    if mode is not None:
        taxonomy = supervisor.taxonomy
        seen = {taxonomy.kind(k).id for spec in supervisor.detectors for k in spec.kinds}
        if not seen & taxonomy.kinds_of(mode):
            ids = ", ".join(spec.id for spec in supervisor.detectors)
            found.append(f"no detector can see {mode} coming: no kind of {ids} is tied to it")
    if not supervisor.config.policies:
        found.append("policies is empty: nothing intervenes before the minimal risk condition")
    return tuple(found)


def _events(scenario: Scenario, twin: Twin) -> tuple[TwinEvent, ...]:
    """What the referee saw; what the scenario counts as its accident belongs to its mode."""
    events = tuple(twin.events())
    if not scenario.accidents:
        return events
    return tuple(replace(e, mode=scenario.mode) if e.id in scenario.accidents and not e.mode else e for e in events)


class _Log:
    """Collects what a Run keeps."""

    def __init__(self, mode: str, tied: frozenset[str], caution: float, detail: bool) -> None:
        self._mode, self._tied, self._caution, self._detail = mode, tied, caution, detail
        self._before: tuple[object, ...] = ()
        self._known: frozenset[str] = frozenset()
        self._events = 0
        self.first_s: dict[str, float] = {}
        self.gate_s: dict[str, float] = {}
        self.interventions: list[Intervention] = []
        self.health: list[Health] = []
        self.rows: list[TimelineRow] = []
        self.series: dict[str, list[float]] = {}
        self.max_level = 0
        self.peak_p: float | None = None
        self.safe_s: float | None = None
        self._began = False
        self._over = False

    def tick(self, now_ns: int, decision: Decision | None, events: Sequence[TwinEvent], twin: Twin) -> None:
        """Take one tick."""
        t = seconds(now_ns)
        news = tuple(f"{e.id} ({e.value:.0f} {e.unit})" if e.mode else e.id for e in events[self._events :])
        self._events = len(events)
        self._over = self._over or any(e.mode == self._mode for e in events)
        if decision is not None:
            self._judged(t, decision, news)
        elif news and self._detail:
            nan = math.nan
            self.rows.append(TimelineRow(t, (), nan, nan, nan, nan, nan, "", (), news))
        if self._detail:
            self._sample(t, decision, twin)

    def _judged(self, t: float, d: Decision, news: tuple[str, ...]) -> None:
        mode = self._mode
        self.interventions += d.changes
        self.health += d.health
        if not self._over:
            self.peak_p = max(self.peak_p or 0.0, d.risk.by_mode[mode])
        if not (d.trust.control_by_mode[mode] >= self._caution):
            self.safe_s = None
        elif self.safe_s is None:
            self.safe_s = t if self._began else 0.0
        self._began = True
        level = d.level if d.level is ProtectionLevel.MINIMAL_RISK else d.levels[mode]
        self.max_level = max(self.max_level, level)
        for gate in (ProtectionLevel.CAUTION, ProtectionLevel.PROTECTIVE):
            if level >= gate and gate.name.lower() not in self.gate_s:
                self.gate_s[gate.name.lower()] = t
        mine = [p for p in d.precursors if p.kind in self._tied]
        for p in mine:
            if p.kind not in self.first_s:
                self.first_s[p.kind] = t
        if not self._detail:
            return
        names = frozenset(f"{p.kind}@{p.subject}" if p.subject else p.kind for p in mine)
        m, q = d.risk.counts[mode]
        changed = tuple(f"{i.action} {i.strength:.2f}" for i in d.changes if _worth_a_row(i))
        state = (names, m, q, level)
        if state != self._before or changed or news:
            shown = tuple(sorted(n if n in self._known else f"+{n}" for n in names))
            trust, control = d.trust.by_mode[mode], d.trust.control_by_mode[mode]
            p_mode = d.risk.by_mode[mode]
            self.rows.append(
                TimelineRow(t, shown, m, q, p_mode, trust, control, level.name.lower().replace("_", "-"), changed, news)
            )
        self._before, self._known = state, names

    def _sample(self, t: float, d: Decision | None, twin: Twin) -> None:
        row: dict[str, float] = {"t_s": t}
        if d is not None:
            mode = self._mode
            m, q = d.risk.counts[mode]
            row |= {
                "p": d.risk.by_mode[mode],
                "trust": d.trust.by_mode[mode],
                "control_trust": d.trust.control_by_mode[mode],
                "p_overall": d.risk.probability,
                "m": m,
                "q": q,
                "level": float(d.levels[mode]),
                "time_to_event_s": math.nan if d.time_to_event_s is None else d.time_to_event_s,
            }
            for i in d.indications:
                name = f"{i.kind}@{i.subject}" if i.subject else i.kind
                row[f"stat:{name}"], row[f"threshold:{name}"] = i.statistic, i.threshold
                for measure, value in i.measures.items():
                    row[f"seen:{measure}"] = value
            for v in d.interventions:
                row[f"action:{v.action}"] = v.strength
        row |= {f"true:{k}": v for k, v in twin.probes().items()}
        length = len(self.series.get("t_s", ()))
        for key, value in row.items():
            self.series.setdefault(key, [math.nan] * length).append(value)
        for column in self.series.values():
            if len(column) <= length:
                column.append(math.nan)


def _worth_a_row(change: Intervention) -> bool:
    """Beginnings and ends; not every step of a ramp or scale."""
    return change.reasons[:1] != ("release ramp",) and change.action != "speed-scale"
