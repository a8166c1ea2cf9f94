"""Contains plugins: feeds a detector, checks what it and a policy say. The one place with a broad except.

Whatever goes wrong in a detector or its inputs makes its kinds unobserved, with a reason; never absent. SystemExit and
the like are contained too (native bindings raise panics outside Exception); only the operator's interrupt passes.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import msgspec

from foreshock._strict import within
from foreshock.channels import AHEAD_NS, ChannelView
from foreshock.clock import ns
from foreshock.detector import Detector, DetectorSpec, Input, Inputs
from foreshock.errors import nearest
from foreshock.evidence import Key
from foreshock.policy import ActionSpec, Policy, Proposal, Situation
from foreshock.records import ChannelState, Indication, ProtectionLevel, Sample, SampleRef
from foreshock.taxonomy import Taxonomy
from foreshock.verdicts import GAVE_UP, VERDICT, VerdictError

__all__ = ["FAILURES_NS", "Contained", "Outcome", "proposals_of"]

FAILURES_NS = 60_000_000_000
"""Failures of a detector count together within this time of ticks: a crash loop gives up, a late verdict a week not."""


def _said_by(e: BaseException) -> str:
    """Type and message of an exception, even if its message cannot be had or holds what no journal can write."""
    try:
        return f"{type(e).__name__}: {e}".encode("utf-8", "backslashreplace").decode()
    except Exception as worse:  # noqa: BLE001 # containment: the message is the plugin's code as well
        return f"{type(e).__name__} (its message raised {type(worse).__name__})"


def proposals_of(
    policies: Sequence[Policy], situation: Situation, actions: Mapping[str, ActionSpec]
) -> tuple[list[Proposal], str]:
    """What the policies propose, and the reason if one of them failed; a failed policy is a reason for minimal risk."""
    found: list[Proposal] = []
    for policy in policies:
        try:
            for p in policy.propose(situation):
                if type(p) is not Proposal:
                    raise TypeError(f"propose() gave a {type(p).__name__} where a Proposal is expected")
                if p.action not in actions:
                    raise ValueError(f"action {p.action!r} is not declared{nearest(p.action, actions)}")
                if not 0.0 <= p.strength <= 1.0:
                    raise ValueError(f"strength {p.strength} of {p.action} is not within 0..1")
                if type(p.mode) is not str or type(p.rule) is not str:
                    raise TypeError(f"mode {p.mode!r} and rule {p.rule!r} of {p.action} must be str")
                if type(p.action) is str and type(p.strength) is float and type(p.level) is ProtectionLevel:
                    found.append(p)
                else:
                    level = ProtectionLevel(p.level)
                    found.append(Proposal(str(p.action), float(p.strength), level, p.mode, p.rule))
        except KeyboardInterrupt:
            raise
        except BaseException as e:  # noqa: BLE001 # containment, as below
            return found, f"policy {type(policy).__name__} failed: {_said_by(e)}"
    return found, ""


class Outcome(msgspec.Struct, frozen=True):
    """What one tick of a detector gave.

    Attributes:
        state: of the detector.
        reason: why it is not ok.
        said: indications of this update; empty if it was not due or not ok.
        due: whether it was its turn.
        judged: whether a verdict fell in this tick.
    """

    state: ChannelState
    reason: str = ""
    said: Mapping[Key, Indication] = {}
    due: bool = True
    judged: bool = False


NOT_DUE = Outcome("ok", due=False)


class Contained:
    """One detector behind its guard.

    Args:
        spec: what it declares.
        detector: the object.
        inputs: its inputs with full channel names.
        taxonomy: to resolve aliases of kinds.
        max_failures: after so many failures within FAILURES_NS it stays failed until reset.
    """

    def __init__(
        self,
        spec: DetectorSpec,
        detector: Detector,
        inputs: Sequence[Input],
        taxonomy: Taxonomy,
        max_failures: int = 3,
    ) -> None:
        self.spec, self.detector, self.inputs = spec, detector, tuple(inputs)
        self.kinds = frozenset(taxonomy.kind(k, f"detector {spec.id}").id for k in spec.kinds)
        self._alias = {name: k.id for k in map(taxonomy.kind, self.kinds) for name in (k.id, *k.aliases)}
        self._max_failures = max_failures
        times = {"period_s": spec.period_s, "warm_up_s": spec.warm_up_s}
        times |= {f"inputs.{i.name}.max_age_s": i.max_age_s for i in self.inputs}
        times |= {f"inputs.{i.name}.max_standstill_s": i.max_standstill_s for i in self.inputs}
        times |= {f"inputs.{i.name}.min_rate_hz": i.min_rate_hz for i in self.inputs}
        for name, value in times.items():
            within(f"detector {spec.id}: {name}", value, 0.0)
        self._period_ns, self._warm_up_ns = ns(spec.period_s), ns(spec.warm_up_s)
        self._needs = tuple((i, ns(i.max_age_s), ns(i.max_standstill_s)) for i in self.inputs if i.channel != "*")
        self.pending: dict[str, list[Sample]] = {i.name: [] for i in self.inputs}
        self._failed_ns: tuple[int, ...] = ()
        self._start(0, 0)

    def _start(self, seed: int, now_ns: int) -> None:
        self._seed, self._why = seed, ""  # why: it was given up
        self._began_ns, self._due_ns = now_ns, now_ns
        for queue in self.pending.values():
            queue.clear()

    def reset(self, seed: int, now_ns: int = 0) -> str:
        """Start anew, with all failures forgotten; the reason if the detector fails to."""
        self._failed_ns = ()
        return self._restart(seed, now_ns)

    def _restart(self, seed: int, now_ns: int) -> str:
        self._start(seed, now_ns)
        try:
            self.detector.reset(seed)
        except KeyboardInterrupt:
            raise
        except VerdictError as e:
            self._why = f"{VERDICT}{GAVE_UP}reset raised {e}"
        except BaseException as e:  # noqa: BLE001 # containment: whatever a plugin raises must not end the supervisor
            self._why = f"reset raised {_said_by(e)}"
        return self._why

    def tick(self, now_ns: int, channels: Mapping[str, ChannelView], verdict: str | None = None) -> Outcome:
        """Update the detector if it is due.

        Args:
            now_ns: time of the tick.
            channels: view of every channel by full name.
            verdict: a recorded wall-clock verdict (late, hung) that makes it unobserved in this tick. One that begins
                with ``gave up: `` ends it until reset: a child that could not be restarted.
        """
        if self._why:
            self._drop()
            return Outcome("failed", self._why)
        if verdict is not None:
            self._drop()
            return self._judged(verdict, now_ns)
        latest: dict[str, Sample] = {}
        for need, max_age_ns, max_standstill_ns in self._needs:
            view = channels[need.channel]
            reason = view.lacks(need, max_age_ns, max_standstill_ns, now_ns, self._began_ns)
            if not reason:
                assert view.latest is not None  # noqa: S101 # lacks() says so
                latest[need.name] = view.latest
            elif need.required:
                self._drop()
                return Outcome("unobserved", reason)
            elif 0 < max_standstill_ns < view.still_ns:
                self.pending[need.name].clear()  # unlike one that is silent, a frozen stream goes on to arrive
        if now_ns < self._due_ns:
            return NOT_DUE
        self._due_ns = now_ns + self._period_ns
        new = {name: tuple(queue) for name, queue in self.pending.items()}
        self._drop()
        try:
            said = self.detector.update(now_ns, Inputs(latest, new))
            checked = self._checked(said, now_ns)
        except KeyboardInterrupt:
            raise
        except VerdictError as e:
            return self._judged(str(e), now_ns)
        except BaseException as e:  # noqa: BLE001 # containment, as above
            return self._failed(_said_by(e), now_ns)
        if now_ns - self._began_ns < self._warm_up_ns:
            return Outcome("warm-up", f"{self.spec.warm_up_s:g} s after reset")
        return Outcome("ok", "", checked)

    def _drop(self) -> None:
        for queue in self.pending.values():
            if queue:
                queue.clear()

    def _failed(self, reason: str, now_ns: int) -> Outcome:
        """Count the failure and begin again, with warm-up; give up after too many within FAILURES_NS."""
        self._failed_ns = (*(t for t in self._failed_ns if now_ns - t < FAILURES_NS), now_ns)
        failures = len(self._failed_ns)
        if failures >= self._max_failures:
            self._why = f"gave up after {failures} failures; the last: {reason}"
            return Outcome("failed", self._why)
        self._restart(self._seed, now_ns)
        if self._why.startswith(VERDICT):
            # told in this very tick, since a replay takes all that happened in a tick from one verdict
            self._why += f", after: {reason}"
            return Outcome("failed", self._why, judged=True)
        return Outcome("failed", reason)

    def _judged(self, verdict: str, now_ns: int) -> Outcome:
        """A verdict is a failure that does not follow from what came in, and is named so that a replay can feed it."""
        reason = VERDICT + verdict
        if verdict.startswith(GAVE_UP):
            self._why = reason
            return Outcome("failed", reason, judged=True)
        return msgspec.structs.replace(self._failed(reason, now_ns), judged=True)

    def _checked(self, said: object, now_ns: int) -> dict[Key, Indication]:
        # lists and tuples first: the test against the abstract class is slow
        if not isinstance(said, (list, tuple)) and (isinstance(said, (str, bytes)) or not isinstance(said, Sequence)):
            raise TypeError(f"update() gave {type(said).__name__}, a sequence of Indication is expected")
        checked: dict[Key, Indication] = {}
        kinds, name, latest_ns = self.kinds, self.spec.id, now_ns + AHEAD_NS
        evidence: object = ()  # of the last sound one; indications of one update often share theirs
        for i in said:
            if type(i) is Indication and i.kind in kinds and _is_sound(i, latest_ns, evidence):
                kind, evidence, taken = i.kind, i.evidence, _detached(i)
            else:
                kind = self._kind_of(i, now_ns)
                taken = _plain(i, kind)
            key = (kind, i.subject, name)
            if key in checked:
                raise ValueError(f"{i.kind}: two indications for subject {i.subject!r}")
            checked[key] = taken
        return checked

    def _kind_of(self, i: object, now_ns: int) -> str:
        """The taxonomy's id of an indication that is not sound at first sight; raises what is wrong with it."""
        if type(i) is not Indication:
            raise TypeError(f"update() gave a {type(i).__name__} where an Indication is expected")
        kind = self._alias.get(i.kind)
        if kind is None:
            raise ValueError(f"kind {i.kind!r} is not among the declared {', '.join(sorted(self.kinds))}")
        if not (math.isfinite(i.statistic) and math.isfinite(i.threshold) and 0.0 <= i.severity <= 1.0):
            numbers = f"statistic {i.statistic}, threshold {i.threshold}, severity {i.severity} (0..1)"
            raise ValueError(f"{i.kind}: {numbers} are not all finite numbers")
        if i.time_to_event_s is not None and not 0.0 <= i.time_to_event_s < math.inf:
            raise ValueError(f"{i.kind}: time_to_event_s {i.time_to_event_s} is not a finite time from now")
        if type(i.present) is not bool or type(i.subject) is not str or type(i.unit) is not str:
            said_of = f"present {i.present!r} must be a bool, subject {i.subject!r} and unit {i.unit!r} str"
            raise TypeError(f"{i.kind}: {said_of}")
        if type(i.stamp_ns) is not int:
            raise TypeError(f"{i.kind}: stamp {i.stamp_ns!r} must be an int of nanoseconds")
        if i.stamp_ns > now_ns + AHEAD_NS:
            raise ValueError(f"{i.kind}: stamp {i.stamp_ns} ns lies after the tick at {now_ns} ns")
        return kind


def _is_sound(i: Indication, latest_ns: int, evidence: object) -> bool:
    """Whether every field has just its declared type and range, as nearly always; else _kind_of and _plain judge.

    Args:
        i: judged.
        latest_ns: the latest stamp that it may have.
        evidence: a tuple that was found sound before.
    """
    measures, refs = i.measures, i.evidence
    if type(measures) is not dict:
        return False
    if refs is not evidence:
        if type(refs) is not tuple:
            return False
        for ref in refs:
            if type(ref) is not SampleRef or type(ref.channel) is not str or type(ref.stamp_ns) is not int:
                return False
    for name, value in measures.items():
        if type(name) is not str or type(value) is not float:
            return False
    statistic, threshold, severity, tte = i.statistic, i.threshold, i.severity, i.time_to_event_s
    return (
        type(statistic) is type(threshold) is type(severity) is float
        and math.isfinite(statistic + threshold)
        and 0.0 <= severity <= 1.0
        and (tte is None or (type(tte) is float and 0.0 <= tte < math.inf))
        and type(i.stamp_ns) is int
        and i.stamp_ns <= latest_ns
        and type(i.present) is bool
        and type(i.subject) is type(i.unit) is str
    )


def _detached(i: Indication) -> Indication:
    """A copy: a detector that reuses its dict of measures must not rewrite what was decided and recorded."""
    return msgspec.structs.replace(i, measures=i.measures.copy()) if i.measures else i


def _plain(i: Indication, kind: str) -> Indication:
    """An indication of builtin types under the taxonomy's id, so that journals can write it; numpy's floats are common.

    Raises:
        TypeError, ValueError: its evidence or measures are not what they must be.
    """
    for ref in i.evidence:
        if type(ref) is not SampleRef or type(ref.channel) is not str or type(ref.stamp_ns) is not int:
            raise TypeError(f"{i.kind}: evidence {ref!r} is not a SampleRef")
    numbers = [float(x) for x in i.measures.values()]
    for name in i.measures:
        if type(name) is not str:
            raise TypeError(f"{i.kind}: measure {name!r} is not named by a str")
    return msgspec.structs.replace(
        i,
        kind=kind,
        statistic=float(i.statistic),
        threshold=float(i.threshold),
        severity=float(i.severity),
        evidence=tuple(i.evidence),
        time_to_event_s=None if i.time_to_event_s is None else float(i.time_to_event_s),
        measures=dict(zip(i.measures, numbers, strict=True)),
    )
