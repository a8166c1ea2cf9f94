"""Contains plugins: feeds a detector, checks what it and a policy say. The one place with a broad except.

Whatever goes wrong in a detector or its inputs makes its kinds unobserved, with a reason; never absent. SystemExit and
the like are contained too (native bindings raise panics outside Exception); only the operator's interrupt passes.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping, Sequence
from types import NoneType

import msgspec

from foreshock._strict import within
from foreshock.clock import ns
from foreshock.detector import Detector, DetectorSpec, Input, Inputs
from foreshock.errors import nearest
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
        missing: declared kinds that it left out although it is ok.
    """

    state: ChannelState
    reason: str = ""
    said: tuple[Indication, ...] = ()
    due: bool = True
    missing: frozenset[str] = frozenset()


class ChannelView:
    """Newest valid sample of a channel, whether one was malformed, and its arrivals within a second."""

    __slots__ = ("arrivals", "fault", "fault_ns", "latest")

    def __init__(self) -> None:
        self.latest: Sample | None = None
        self.fault = ""
        self.fault_ns = -1
        self.arrivals: deque[int] = deque()

    def judge(self, fault: str, now_ns: int) -> None:
        """Note what is wrong with a sample that arrived, if anything.

        A valid sample clears a fault of an earlier tick only: of two in one tick the malformed one is still a gap.
        """
        if fault:
            self.fault, self.fault_ns = fault, now_ns
        elif self.fault and self.fault_ns < now_ns:
            self.fault = ""

    def state(self, need: Input, now_ns: int, since_ns: int) -> tuple[ChannelState, str]:
        """Whether the channel serves this input now, and if not why."""
        if self.fault:
            return "failed", self.fault
        if self.latest is None:
            return "stale", f"no {need.type.__name__} on {need.channel} since reset"
        age = now_ns - self.latest.stamp_ns
        if age > ns(need.max_age_s):
            return (
                "stale",
                f"{need.channel} is {age / 1e6:.0f} ms old, at most {need.max_age_s * 1e3:.0f} ms is allowed",
            )
        if need.min_rate_hz > 0.0 and now_ns - since_ns >= 1_000_000_000:
            while self.arrivals and self.arrivals[0] <= now_ns - 1_000_000_000:
                self.arrivals.popleft()
            if len(self.arrivals) < need.min_rate_hz:
                return "late", f"{need.channel} has {len(self.arrivals)} samples/s, {need.min_rate_hz:g} are needed"
        return "ok", ""


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
        self._period_ns = ns(spec.period_s)
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
        for need in self.inputs:
            if need.channel == "*":
                continue
            view = channels[need.channel]
            state, reason = view.state(need, now_ns, self._began_ns)
            if state == "ok":
                assert view.latest is not None  # noqa: S101 # state() says so
                latest[need.name] = view.latest
            elif need.required:
                self._drop()
                return Outcome("unobserved", reason)
        if now_ns < self._due_ns:
            return Outcome("ok", due=False)
        self._due_ns = now_ns + self._period_ns
        new = {name: tuple(queue) for name, queue in self.pending.items()}
        self._drop()
        try:
            said = self.detector.update(now_ns, Inputs(latest, new))
            checked, missing = self._checked(said, now_ns)
        except KeyboardInterrupt:
            raise
        except BaseException as e:  # noqa: BLE001 # containment, as above
            return self._failed(_said_by(e), now_ns)
        if now_ns - self._began_ns < ns(self.spec.warm_up_s):
            return Outcome("warm-up", f"{self.spec.warm_up_s:g} s after reset")
        return Outcome("ok", "", checked, True, missing)

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

    def _checked(self, said: object, now_ns: int) -> tuple[tuple[Indication, ...], frozenset[str]]:
        if isinstance(said, (str, bytes)) or not isinstance(said, Sequence):
            raise TypeError(f"update() gave {type(said).__name__}, a sequence of Indication is expected")
        checked: list[Indication] = []
        subjects: set[tuple[str, str]] = set()
        for i in said:
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
            if (kind, i.subject) in subjects:
                raise ValueError(f"{i.kind}: two indications for subject {i.subject!r}")
            subjects.add((kind, i.subject))
            checked.append(_plain(i, kind))
        return tuple(checked), self.kinds - {k for k, _ in subjects}


def _plain(i: Indication, kind: str) -> Indication:
    """An indication of builtin types under the taxonomy's id, so that journals can write it; numpy's floats are common.

    Raises:
        TypeError, ValueError: its evidence or measures are not what they must be.
    """
    for ref in i.evidence:
        if type(ref) is not SampleRef or type(ref.channel) is not str or type(ref.stamp_ns) is not int:
            raise TypeError(f"{i.kind}: evidence {ref!r} is not a SampleRef")
    tte = i.time_to_event_s
    types = {type(i.statistic), type(i.threshold), type(i.severity), *map(type, i.measures.values())}
    if types == {float} and i.kind == kind and type(tte) in (float, NoneType) and type(i.evidence) is tuple:
        # a copy: a detector that reuses its dict must not rewrite what was decided and recorded
        return msgspec.structs.replace(i, measures=_named(i)) if i.measures else i
    return msgspec.structs.replace(
        i,
        kind=kind,
        statistic=float(i.statistic),
        threshold=float(i.threshold),
        severity=float(i.severity),
        evidence=tuple(i.evidence),
        time_to_event_s=None if tte is None else float(tte),
        measures={name: float(x) for name, x in _named(i).items()},
    )


def _named(i: Indication) -> dict[str, float]:
    for name in i.measures:
        if type(name) is not str:
            raise TypeError(f"{i.kind}: measure {name!r} is not named by a str")
    return dict(i.measures)
