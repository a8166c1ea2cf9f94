"""What every detector must do, as an inheritable test class for the test suites of plugin authors.

    class TestHotMotor(DetectorConformance):
        spec = SPEC

        def recording(self) -> Sequence[Sample]:
            return overload_of_the_left_knee()

pytest collects the inherited tests; this module itself does not import pytest. Every test plays the recording through
the real supervisor, so that what is tested is what a robot will get.
"""

# ruff: noqa: S101 # these are tests; each assert carries its message, since pytest rewrites no asserts here
from __future__ import annotations

import math
import statistics
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any, ClassVar

import msgspec

from foreshock.clock import ns
from foreshock.detector import DetectorSpec, Input
from foreshock.messages import is_finite
from foreshock.records import Decision, Sample
from foreshock.supervisor import build_detector, kinds_of
from foreshock.taxonomy import PrecursorKind, builtin_taxonomy
from foreshock.testing._purity import Purity
from foreshock.testing.faults import disordered, duplicated, frozen, silenced, spoiled
from foreshock.testing.rig import Call, Play, Rig, arrival_ns
from foreshock.testing.spec_checks import spec_checks

__all__ = ["DetectorConformance"]

LONGEST_S = 120.0
LOSSES = {"silent": silenced, "not-a-number": spoiled, "frozen": frozen}


class DetectorConformance:
    """Inherit, name the class ``Test...``, and give ``spec`` and ``recording()``.

    Attributes:
        spec: the detector under test.
        config: its settings for the recording; its defaults if None.
        precursors: kinds that its plugin adds to the taxonomy.
        omits: kind -> why the detector may leave it out of an answer although all its inputs are there. Such a kind
            counts as unobserved for that time, which lowers trust: say here that it is meant.
        robot: first part of the channels in the recording.
        tick_s: tick period of the supervisor.
    """

    spec: ClassVar[DetectorSpec]
    config: ClassVar[msgspec.Struct | None] = None
    precursors: ClassVar[Sequence[PrecursorKind]] = ()
    omits: ClassVar[Mapping[str, str]] = {}
    robot: ClassVar[str] = "talos"
    tick_s: ClassVar[float] = 0.005

    _kept: ClassVar[dict[type, tuple[tuple[Sample, ...], Play]]] = {}

    def recording(self) -> Sequence[Sample]:
        """Samples by arrival, of all inputs, a few seconds: each kind absent at first, present at least once."""
        raise NotImplementedError(f"{type(self).__name__} must give a recording()")

    def pytest_generate_tests(self, metafunc: Any) -> None:
        """One test per input and per way of losing it."""
        if "lost_input" in metafunc.fixturenames:
            named = [i for i in self._rig.inputs.values() if i.channel != "*"]
            cases = [(i.name, loss) for i in named for loss in LOSSES if loss != "frozen" or i.max_standstill_s]
            metafunc.parametrize(("lost_input", "loss"), cases)

    def test_declares_itself(self) -> None:
        """Id, kinds, inputs, settings and build are as the port demands."""
        checks = spec_checks(self.spec, self.precursors, self.config)
        broken = [f"{c.name}: {c.problem}" for c in checks if not c.ok]
        assert not broken, "\n".join(broken)

    def test_recording_is_usable(self) -> None:
        """The recording is ordered, finite, short, and has every input of the declared type."""
        samples, rig = self._samples, self._rig
        arrivals = [arrival_ns(s) for s in samples]
        assert all(a <= b for a, b in pairwise(arrivals)), "recording(): samples are not sorted by arrival"
        assert arrivals[-1] - arrivals[0] <= ns(LONGEST_S), f"recording(): longer than {LONGEST_S:g} s"
        for name, need in rig.inputs.items():
            if need.channel == "*":
                continue
            found = [s for s in samples if s.channel == rig.channel(name)]
            assert found, f"recording(): nothing on {rig.channel(name)}, the channel of input {name!r}"
            wrong = next((s for s in found if not isinstance(s.value, need.type) or not is_finite(s.value)), None)
            assert wrong is None, f"recording(): {wrong} is not a finite {need.type.__name__}"

    def test_every_kind_is_present_and_absent(self) -> None:
        """The recording makes each declared kind present, and the detector can also say that it is absent."""
        said = [i for d in self._play.decisions for i in d.indications]
        problem = self._first_problem(self._play)
        hint = f"; {problem}" if problem else ""
        never = [k for k in sorted(self._kinds) if k not in {i.kind for i in said if i.present}]
        assert not never, f"never present in the recording: {', '.join(never)}{hint}"
        stuck = [k for k in sorted(self._kinds) if k not in {i.kind for i in said if not i.present}]
        assert not stuck, f"never absent in the recording: {', '.join(stuck)}"

    def test_every_update_is_valid(self) -> None:
        """No update raises, and each is accepted: declared kinds, finite numbers, severity 0..1, no future stamps."""
        problem = self._first_problem(self._play)
        assert not problem, problem
        given = {(s.channel, s.stamp_ns) for s in self._samples}
        for call in self._play.calls:
            for i in call.said or ():
                assert all(map(math.isfinite, i.measures.values())), (
                    f"measures of {i.kind} at {call.now_ns} ns: {i.measures}"
                )
                assert i.evidence or not i.present, f"{i.kind} is present at {call.now_ns} ns without any evidence"
                for ref in i.evidence:
                    known = (ref.channel, ref.stamp_ns) in given
                    assert known, f"{i.kind} at {call.now_ns} ns names a sample that does not exist: {ref}"

    def test_every_update_speaks_of_every_kind(self) -> None:
        """While it has its inputs and is warm, it reports each declared kind, or omits() says why not."""
        unknown = [k for k in self.omits if k not in self._kinds]
        assert not unknown, f"omits names {unknown}, which the detector does not declare"
        ids, warm_ns = self._ids, self._began_ns + ns(self.spec.warm_up_s)
        for call in self._play.calls:
            said = {ids.get(i.kind, i.kind) for i in call.said or ()}
            silent = sorted(self._kinds - said - self.omits.keys()) if call.now_ns >= warm_ns else ()
            assert not silent, f"at {call.now_ns} ns it says nothing of {', '.join(silent)}, nor does `omits`"

    def test_same_input_same_output(self) -> None:
        """Two detectors with the same samples say the same."""
        again = self._rig.play(self._samples)
        _assert_same(self._play.decisions, again.decisions)

    def test_reset_equals_new(self) -> None:
        """After reset() a detector behaves like a new one."""
        rig = self._rig
        with rig.supervisor() as (supervisor, _):
            rig.run(supervisor, self._samples)
            again = rig.run(supervisor, self._samples)
        _assert_same(self._play.decisions, again)

    def test_reads_no_clock_no_global_randomness_no_files(self) -> None:
        """Clocks, random and numpy.random module functions, files and sockets refuse while it works."""
        purity = Purity()
        built = build_detector(self.spec, self._rig.settings, f"detector {self.spec.id}")
        code = frozenset(m.partition(".")[0] for m in (type(built).__module__, self.spec.build.__module__))
        with purity.watching(code):
            pure = self._rig.play(self._samples, armed=purity.armed)
        assert purity.asked == [], f"called while the detector worked: {', '.join(sorted(set(purity.asked)))}"
        _assert_same(self._play.decisions, pure.decisions)

    def test_changes_neither_inputs_nor_past_answers(self) -> None:
        """What it is given and what it has said stays as it was."""
        play = self._rig.play(self._samples, careful=True)
        changed = next((c for c in play.calls if c.changed), None)
        assert changed is None, f"the update at {changed and changed.now_ns} ns changed {changed and changed.changed}"

    def test_lost_input_is_never_absence(self, lost_input: str, loss: str) -> None:
        """Evidence that is missing or not a number is never taken for absence, from the worst instant on.

        The loss begins while something is present. A required input leaves all kinds unobserved once it is stale (at
        once if it is malformed), and P does not fall from then on. Without an optional one kinds may be left out, or
        judged from the rest; but what was present at the loss, and with that input still would be, is not cleared. Of
        values that stand still all this holds from the end of the declared standstill on.
        """
        rig, need = self._rig, self._rig.inputs[lost_input]
        at_ns = self._worst_ns
        channel = rig.channel(lost_input)
        samples = LOSSES[loss](self._samples, channel, at_ns)
        noticed_ns = self._frozen_ns(need, at_ns) if loss == "frozen" else at_ns
        play = rig.play(samples, until_ns=arrival_ns(self._samples[-1]))
        problem = self._first_problem(play, unobserved_is_fine=True)
        assert not problem, f"without {lost_input} ({loss}): {problem}"
        full = {d.now_ns: {(i.kind, i.subject): i.present for i in d.indications} for d in self._play.decisions}
        held = {key for key, present in full[at_ns].items() if present}
        for d in play.decisions:
            if d.now_ns <= at_ns:
                continue
            held -= {key for key, present in full.get(d.now_ns, {}).items() if not present}
            if d.now_ns < noticed_ns:
                continue
            wrong = sorted(held & {(i.kind, i.subject) for i in d.indications if not i.present})
            assert not wrong, f"without {lost_input} ({loss}) it clears {wrong} at {d.now_ns} ns, present with it"
        if need.required:
            self._assert_unobserved(play.decisions, need, noticed_ns, loss)

    def _frozen_ns(self, need: Input, at_ns: int) -> int:
        """Arrival of the first sample by which an input that is frozen from at_ns on has stood still too long."""
        mine = [s for s in self._samples if s.channel == f"{self.robot}/{need.channel}"]
        moved_ns = max((s.stamp_ns for s in mine if arrival_ns(s) <= at_ns), default=at_ns)
        later = [arrival_ns(s) for s in mine if s.stamp_ns > moved_ns + ns(need.max_standstill_s)]
        assert later, f"recording(): ends less than {need.max_standstill_s:g} s after something is present"
        return later[0]

    def _assert_unobserved(self, decisions: Sequence[Decision], need: Input, at_ns: int, loss: str) -> None:
        last = [s for s in self._samples if s.channel == f"{self.robot}/{need.channel}" and arrival_ns(s) <= at_ns]
        from_ns = (last[-1].stamp_ns + ns(need.max_age_s)) if loss == "silent" and last else at_ns + ns(need.max_age_s)
        if loss == "frozen":
            from_ns = at_ns - 1
        after = [d for d in decisions if d.now_ns > from_ns]
        assert after, f"recording(): ends less than {need.max_age_s:g} s after something is present"
        held = 0.0
        for d in after:
            seen = self._kinds - set(d.trust.unobserved)
            assert not seen, f"without {need.name} ({loss}) it still judges {', '.join(sorted(seen))} at {d.now_ns} ns"
            assert d.indications == (), f"without {need.name} ({loss}) it still speaks at {d.now_ns} ns"
            assert d.risk.probability >= held, f"P falls at {d.now_ns} ns though {need.name} is lost ({loss})"
            held = d.risk.probability

    def test_survives_duplicates_and_disorder(self) -> None:
        """A transport that repeats and reorders samples neither breaks it nor hides a kind."""
        for fault in (duplicated, disordered):
            play = self._rig.play(fault(self._samples))
            problem = self._first_problem(play)
            assert not problem, f"{fault.__name__} samples: {problem}"
            hidden = sorted(self._kinds - play.present)
            assert not hidden, f"{', '.join(hidden)} is not found in {fault.__name__} samples"

    def test_cpu_time_is_within_the_deadline(self) -> None:
        """The median CPU time of an update is below spec.deadline_s."""
        median_s = statistics.median(c.cpu_ns for c in self._play.calls) / 1e9
        assert median_s <= self.spec.deadline_s, f"{median_s:.6f} s of CPU an update, {self.spec.deadline_s:g} declared"

    def test_says_the_same_in_a_child_process(self) -> None:
        """With isolation = "process" the answers are the same."""
        child = self._rig.play(self._samples, isolation="process")
        _assert_same(self._play.decisions, child.decisions)

    @property
    def _rig(self) -> Rig:
        return Rig(self.spec, self.config, self.precursors, self.robot, self.tick_s)

    @property
    def _ids(self) -> Mapping[str, str]:
        """Declared name of a kind -> its id."""
        taxonomy = builtin_taxonomy().extended(self.precursors)
        return {name: taxonomy.kind(name).id for name in kinds_of(self.spec, self._rig.settings, self.spec.id)}

    @property
    def _kinds(self) -> frozenset[str]:
        return frozenset(self._ids.values())

    def _once(self) -> tuple[tuple[Sample, ...], Play]:
        """The recording and its undisturbed play, made once for all tests of a class."""
        mine = type(self)
        if mine not in self._kept:
            samples = tuple(self.recording())
            assert samples, "recording() gave no samples"
            assert all(isinstance(s, Sample) for s in samples), "recording() must give Sample objects"
            span_ns = arrival_ns(samples[-1]) - arrival_ns(samples[0])
            assert 0 <= span_ns <= ns(LONGEST_S), f"recording(): {span_ns / 1e9:g} s, 0 to {LONGEST_S:g} s is expected"
            self._kept[mine] = (samples, self._rig.play(samples))
        return self._kept[mine]

    @property
    def _samples(self) -> tuple[Sample, ...]:
        return self._once()[0]

    @property
    def _play(self) -> Play:
        return self._once()[1]

    @property
    def _worst_ns(self) -> int:
        """The tick at which the most kinds are present, the first of them."""
        counts = [(sum(i.present for i in d.indications), d.now_ns) for d in self._play.decisions]
        most = max(n for n, _ in counts)
        assert most > 0, "nothing is ever present in the recording"
        return next(t for n, t in counts if n == most)

    @property
    def _began_ns(self) -> int:
        return self._play.decisions[0].now_ns - ns(self.tick_s)

    def _first_problem(self, play: Play, unobserved_is_fine: bool = False) -> str:
        """The first update that raised or was refused, or the first warm tick without an input; empty if none."""
        raised: Call | None = next((c for c in play.calls if c.error), None)
        if raised is not None:
            return f"the update at {raised.now_ns} ns raised {raised.error}"
        warm_ns = self._began_ns + max(ns(self.spec.warm_up_s), ns(1.0))
        state, reason = "ok", ""
        for d in play.decisions:
            for h in d.health:
                if h.source == self.spec.id:
                    state, reason = h.state, h.reason
            lost = state == "unobserved" and not unobserved_is_fine and d.now_ns >= warm_ns
            if state == "failed" or lost:
                return f"at {d.now_ns} ns it is {state}: {reason}"
        return ""


def _assert_same(a: Sequence[Decision], b: Sequence[Decision]) -> None:
    for one, other in zip(a, b, strict=True):
        told, again = one.indications, other.indications
        assert told == again, f"at {one.now_ns} ns: {told} against {again}"
        lost, also = one.trust.unobserved, other.trust.unobserved
        reasons = "; ".join(h.reason for h in (*one.health, *other.health))
        assert lost == also, f"at {one.now_ns} ns unobserved: {lost} against {also}; {reasons}"
