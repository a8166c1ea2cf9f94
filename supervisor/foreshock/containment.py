"""Contains plugins: feeds a detector, checks what it and a policy say. The one place with a broad except.

Whatever goes wrong in a detector or its inputs makes its kinds unobserved, with a reason; never absent. SystemExit and
the like are contained too (native bindings raise panics outside Exception); only the operator's interrupt passes.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping, Sequence

import msgspec

from foreshock._strict import within
from foreshock.clock import ns
from foreshock.detector import Detector, DetectorSpec, Input, Inputs
from foreshock.errors import nearest
from foreshock.evidence import Key
from foreshock.messages import is_finite
from foreshock.policy import ActionSpec, Policy, Proposal, Situation
from foreshock.records import ChannelState, Indication, ProtectionLevel, Sample, SampleRef
from foreshock.taxonomy import Taxonomy

__all__ = ["AHEAD_NS", "ChannelView", "Contained", "Outcome", "proposals_of"]

AHEAD_NS = 10_000_000
"""A stamp further ahead of the tick than this is malformed; less is the skew of two synchronised clocks."""


def _said_by(e: BaseException) -> str:
    """Type and message of an exception, even if its message cannot be had."""
    try:
        return f"{type(e).__name__}: {e}"
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
    """

    state: ChannelState
    reason: str = ""
    said: Mapping[Key, Indication] = {}
    due: bool = True


NOT_DUE = Outcome("ok", due=False)


class ChannelView:
    """Newest valid sample of a channel, whether one was malformed, and its arrivals within a second.

    Args:
        needs: the inputs that read this channel.
        queues: where each of them waits for new samples.
    """

    __slots__ = ("_queues", "_rated", "_type", "_types", "arrivals", "fault", "fault_ns", "latest")

    def __init__(self, needs: Sequence[Input], queues: Sequence[list[Sample]]) -> None:
        self._types = tuple({need.type: None for need in needs})
        self._type = self._types[0] if len(self._types) == 1 else None
        self._rated = any(need.min_rate_hz > 0 for need in needs)
        self._queues = tuple(queues)
        self.reset()

    def reset(self) -> None:
        """Forget what was seen."""
        self.latest: Sample | None = None
        self.fault = ""
        self.fault_ns = -1
        self.arrivals: deque[int] = deque()

    def take(self, sample: Sample, now_ns: int) -> bool:
        """Give a sample to those who read the channel, if it is valid; a malformed one marks the channel.

        A valid sample clears a fault of an earlier tick only: of two in one tick the malformed one is still a gap.
        """
        stamp_ns, value = sample.stamp_ns, sample.value
        sound = type(stamp_ns) is int and stamp_ns <= now_ns + AHEAD_NS and type(value) is self._type
        fault = "" if sound and is_finite(value) else self._fault_of(sample, now_ns)
        if fault:
            self.fault, self.fault_ns = fault, now_ns
            return False
        if self.fault and self.fault_ns < now_ns:
            self.fault = ""
        if self.latest is None or stamp_ns >= self.latest.stamp_ns:
            self.latest = sample
        if self._rated:
            self.arrivals.append(now_ns)
        for queue in self._queues:
            queue.append(sample)
        return True

    def _fault_of(self, sample: Sample, now_ns: int) -> str:
        if type(sample.stamp_ns) is not int:
            return f"{sample.channel} has the stamp {sample.stamp_ns!r}, an int of nanoseconds is expected"
        for wanted in self._types:
            if not isinstance(sample.value, wanted):
                return f"{sample.channel} carries {type(sample.value).__name__}, {wanted.__name__} is expected"
        if not is_finite(sample.value):
            return f"{sample.channel} carries a number that is not finite"
        if sample.stamp_ns > now_ns + AHEAD_NS:
            return f"{sample.channel} is stamped {(sample.stamp_ns - now_ns) / 1e6:.0f} ms ahead of the supervisor"
        return ""

    def lacks(self, need: Input, max_age_ns: int, now_ns: int, since_ns: int) -> str:
        """Why the channel does not serve this input now; empty if it does."""
        if self.fault:
            return self.fault
        if self.latest is None:
            return f"no {need.type.__name__} on {need.channel} since reset"
        age = now_ns - self.latest.stamp_ns
        if age > max_age_ns:
            return f"{need.channel} is {age / 1e6:.0f} ms old, at most {need.max_age_s * 1e3:.0f} ms is allowed"
        if need.min_rate_hz > 0.0 and now_ns - since_ns >= 1_000_000_000:
            while self.arrivals and self.arrivals[0] <= now_ns - 1_000_000_000:
                self.arrivals.popleft()
            if len(self.arrivals) < need.min_rate_hz:
                return f"{need.channel} has {len(self.arrivals)} samples/s, {need.min_rate_hz:g} are needed"
        return ""


class Contained:
    """One detector behind its guard.

    Args:
        spec: what it declares.
        detector: the object.
        inputs: its inputs with full channel names.
        taxonomy: to resolve aliases of kinds.
        max_failures: after so many failures it stays failed until reset.
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
        times |= {f"inputs.{i.name}.min_rate_hz": i.min_rate_hz for i in self.inputs}
        for name, value in times.items():
            within(f"detector {spec.id}: {name}", value, 0.0)
        self._period_ns, self._warm_up_ns = ns(spec.period_s), ns(spec.warm_up_s)
        self._needs = tuple((i, ns(i.max_age_s)) for i in self.inputs if i.channel != "*")
        self.pending: dict[str, list[Sample]] = {i.name: [] for i in self.inputs}
        self._start(0, 0)

    def _start(self, seed: int, now_ns: int) -> None:
        self._seed, self._failures, self._why = seed, 0, ""
        self._began_ns, self._due_ns = now_ns, now_ns
        for queue in self.pending.values():
            queue.clear()

    def reset(self, seed: int, now_ns: int = 0) -> str:
        """Start anew; the reason if the detector fails to."""
        self._start(seed, now_ns)
        try:
            self.detector.reset(seed)
        except KeyboardInterrupt:
            raise
        except BaseException as e:  # noqa: BLE001 # containment: whatever a plugin raises must not end the supervisor
            self._failures, self._why = self._max_failures, f"reset raised {_said_by(e)}"
        return self._why

    def tick(self, now_ns: int, channels: Mapping[str, ChannelView], verdict: str = "") -> Outcome:
        """Update the detector if it is due.

        Args:
            now_ns: time of the tick.
            channels: view of every channel by full name.
            verdict: a recorded wall-clock verdict (late, hung) that makes it unobserved in this tick.
        """
        if self._failures >= self._max_failures:
            self._drop()
            return Outcome("failed", self._why)
        if verdict:
            self._drop()
            return self._failed(verdict, now_ns)
        latest: dict[str, Sample] = {}
        for need, max_age_ns in self._needs:
            view = channels[need.channel]
            reason = view.lacks(need, max_age_ns, now_ns, self._began_ns)
            if not reason:
                assert view.latest is not None  # noqa: S101 # lacks() says so
                latest[need.name] = view.latest
            elif need.required:
                self._drop()
                return Outcome("unobserved", reason)
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
        """Count the failure and begin again, with warm-up; give up after too many."""
        failures = self._failures + 1
        if failures >= self._max_failures:
            self._failures, self._why = failures, f"gave up after {failures} failures; the last: {reason}"
            return Outcome("failed", self._why)
        self.reset(self._seed, now_ns)
        self._failures = max(self._failures, failures)
        return Outcome("failed", reason)

    def _checked(self, said: object, now_ns: int) -> dict[Key, Indication]:
        # lists and tuples first: the test against the abstract class is slow
        if not isinstance(said, (list, tuple)) and (isinstance(said, (str, bytes)) or not isinstance(said, Sequence)):
            raise TypeError(f"update() gave {type(said).__name__}, a sequence of Indication is expected")
        checked: dict[Key, Indication] = {}
        kinds, name = self.kinds, self.spec.id
        for i in said:
            sound = type(i) is Indication and i.kind in kinds and _is_sound(i, now_ns)
            kind = i.kind if sound else self._kind_of(i, now_ns)
            key = (kind, i.subject, name)
            if key in checked:
                raise ValueError(f"{i.kind}: two indications for subject {i.subject!r}")
            checked[key] = _detached(i) if sound else _plain(i, kind)
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


STR, FLOAT = {str}, {float}


def _is_sound(i: Indication, now_ns: int) -> bool:
    """Whether every field has just its declared type and range, as nearly always; else _kind_of and _plain judge."""
    if type(i.evidence) is not tuple or type(i.measures) is not dict:
        return False
    for ref in i.evidence:
        if type(ref) is not SampleRef or type(ref.channel) is not str or type(ref.stamp_ns) is not int:
            return False
    if i.measures and not (set(map(type, i.measures)) == STR and set(map(type, i.measures.values())) == FLOAT):
        return False
    statistic, threshold, severity, tte = i.statistic, i.threshold, i.severity, i.time_to_event_s
    return (
        type(statistic) is type(threshold) is type(severity) is float
        and math.isfinite(statistic + threshold)
        and 0.0 <= severity <= 1.0
        and (tte is None or (type(tte) is float and 0.0 <= tte < math.inf))
        and type(i.stamp_ns) is int
        and i.stamp_ns <= now_ns + AHEAD_NS
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
