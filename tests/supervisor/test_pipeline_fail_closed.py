"""Rule 1, through Supervisor.step: whatever goes wrong makes kinds unobserved, never absent, and is named."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import msgspec
import numpy as np
import pytest
from foreshock_stage import (
    COM,
    MS,
    SLIP,
    TORSO,
    Nothing,
    Scripted,
    ScriptedPolicy,
    detector,
    fresh,
    health_of,
    module,
    play,
    said,
    stage,
)
from hypothesis import given, settings
from hypothesis import strategies as st

from foreshock.detector import DetectorSpec, Input
from foreshock.errors import BadInputError, ConfigError, ForeshockError
from foreshock.evidence import Window
from foreshock.guard import MotionGuard
from foreshock.journal import DigestJournal
from foreshock.messages import Detections, Heartbeat, Message, Scalar
from foreshock.policy import PolicySpec
from foreshock.records import Decision, Indication, ProtectionLevel, Sample
from foreshock.registry import Registry
from foreshock.supervisor import Supervisor
from foreshock.trust import TrustSettings

TICK = 20 * MS


class Panic(BaseException):
    """As native bindings raise it: outside Exception."""


class MuteError(Exception):
    """Its own message raises."""

    def __str__(self) -> str:
        raise RuntimeError("no words")


def slip(now: int, **fields: Any) -> Indication:
    """A good absent indication with some fields replaced."""
    return msgspec.structs.replace(said(SLIP, False, now), **fields)


ROGUES: dict[str, tuple[Callable[[int], Any], str]] = {
    "raises": (lambda now: ValueError("boom"), "ValueError: boom"),
    "raises outside Exception": (lambda now: Panic("native panic"), "Panic: native panic"),
    "exits": (lambda now: SystemExit(3), "SystemExit"),
    "raises without words": (lambda now: MuteError(), "MuteError"),
    "raises what cannot be written": (lambda now: ValueError("half a letter \ud800"), "half a letter"),
    "recurses": (lambda now: RecursionError("deep"), "RecursionError"),
    "exhausts memory": (lambda now: MemoryError(), "MemoryError"),
    "None": (lambda now: None, "NoneType"),
    "str": (lambda now: SLIP, "str"),
    "bytes": (lambda now: b"x", "bytes"),
    "generator": (lambda now: (i for i in [slip(now)]), "generator"),
    "dict": (lambda now: {SLIP: False}, "dict"),
    "one indication": (lambda now: slip(now), "Indication"),
    "foreign type": (lambda now: [(SLIP, False)], "tuple"),
    "undeclared kind": (lambda now: [slip(now), said(TORSO, False, now)], TORSO),
    "unknown kind": (lambda now: [slip(now, kind="foot-micro-slop")], "foot-micro-slop"),
    "kind of no type": (lambda now: [slip(now, kind=["x"])], "list"),
    "duplicate subject": (lambda now: [slip(now), slip(now)], "two indications"),
    "NaN statistic": (lambda now: [slip(now, statistic=math.nan)], "nan"),
    "inf statistic": (lambda now: [slip(now, statistic=math.inf)], "inf"),
    "NaN threshold": (lambda now: [slip(now, threshold=math.nan)], "nan"),
    "NaN severity": (lambda now: [slip(now, severity=math.nan)], "nan"),
    "severity above 1": (lambda now: [slip(now, severity=1.5)], "1.5"),
    "severity below 0": (lambda now: [slip(now, severity=-0.1)], "-0.1"),
    "NaN time to event": (lambda now: [slip(now, time_to_event_s=math.nan)], "time_to_event_s"),
    "inf time to event": (lambda now: [slip(now, time_to_event_s=math.inf)], "time_to_event_s"),
    "past time to event": (lambda now: [slip(now, time_to_event_s=-1.0)], "time_to_event_s"),
    "statistic of no type": (lambda now: [slip(now, statistic="high")], "TypeError"),
    "present of no type": (lambda now: [slip(now, present=0)], "present"),
    "present of numpy": (lambda now: [slip(now, present=np.bool_(False))], "present"),
    "subject of no type": (lambda now: [slip(now, subject=None)], "subject"),
    "stamp in the future": (lambda now: [slip(now, stamp_ns=now + 50 * MS)], "after the tick"),
    "NaN stamp": (lambda now: [slip(now, stamp_ns=math.nan)], "stamp"),
    "evidence of no type": (lambda now: [slip(now, evidence=("talos/x",))], "evidence"),
    "measures of no type": (lambda now: [slip(now, measures={"x": object()})], "TypeError"),
}


@pytest.mark.parametrize("name", ROGUES)
def test_a_rogue_makes_its_kinds_unobserved_and_is_named(name: str) -> None:
    answer, named = ROGUES[name]
    supervisor = stage(
        detector("rogue", [SLIP], lambda now: [slip(now)] if now <= 5 * TICK else answer(now)),
        detector("good", [TORSO], lambda now: [said(TORSO, False, now)]),
    )
    decisions = play(supervisor, 40, TICK)
    journal = DigestJournal()
    for d in decisions:
        journal.tick((), d)  # whatever came through can be written
    before, after = decisions[4], decisions[5:]
    assert before.trust.unobserved == ()
    assert before.motion_permitted
    for d in after:
        assert SLIP in d.trust.unobserved
        assert TORSO not in d.trust.unobserved
        assert d.trust.control_trust <= TrustSettings().unobserved_cap
        assert d.risk.probability == before.risk.probability
    state, reason = health_of(after, "rogue")[0]
    assert state == "failed"
    assert named in reason
    # at 6 * 20 ms lost; more than 0.3 s later the minimal risk condition, and no lease
    overdue = [d.now_ns - 6 * TICK > 300 * MS for d in after]
    assert [d.level is ProtectionLevel.MINIMAL_RISK for d in after] == overdue
    assert [d.motion_permitted for d in after] == [not o for o in overdue]
    assert supervisor.lease(1, 0, after[-1].now_ns) is None


def test_the_operator_s_interrupt_is_not_contained() -> None:
    with pytest.raises(KeyboardInterrupt):
        play(stage(detector("d", [SLIP], lambda now: KeyboardInterrupt())), 1)


@pytest.mark.parametrize("answer", [ValueError("no reset"), Panic("no reset"), SystemExit(1)])
def test_a_reset_that_raises_is_contained(answer: BaseException) -> None:
    class Stubborn:
        def reset(self, seed: int) -> None:
            raise answer

        def update(self, now_ns: int, inputs: object) -> Sequence[Indication]:
            return [slip(now_ns)]

    decisions = play(stage(detector("d", [SLIP], Stubborn())), 3)
    assert decisions[-1].trust.unobserved == (SLIP,)
    assert health_of(decisions, "d")[0][0] == "failed"
    assert "reset raised" in health_of(decisions, "d")[0][1]


def test_numbers_of_numpy_are_numbers_and_can_be_journalled() -> None:
    def script(now: int) -> list[Indication]:
        x = np.float64(0.75)
        return [
            slip(now, present=True, statistic=x, threshold=x, severity=x, time_to_event_s=x, measures={"x": x}),
        ]

    journal = DigestJournal()
    (d,) = play(stage(detector("d", [SLIP], script)), 1)
    journal.tick((), d)
    assert d.precursors[0].severity == 0.75
    assert d.trust.unobserved == ()


def test_a_detector_may_name_its_kind_by_id_or_alias() -> None:
    spec = detector("d", ["micro-slip"], lambda now: [said(SLIP, True, now)])
    assert [p.kind for p in play(stage(spec), 1)[0].precursors] == [SLIP]
    spec = detector("d", [SLIP], lambda now: [said("micro-slip", True, now)])
    assert [p.kind for p in play(stage(spec), 1)[0].precursors] == [SLIP]


def test_a_stamp_within_the_skew_of_clocks_is_no_failure() -> None:
    """A sample may be stamped 10 ms ahead; an indication that cites its stamp must then be good as well."""
    supervisor = stage(detector("d", [SLIP], lambda now: [said(SLIP, False, now + 8 * MS)]))
    decisions = play(supervisor, 20, TICK, samples=lambda k, now: [fresh(now, stamp_ns=now + 8 * MS)])
    assert all(d.trust.unobserved == () for d in decisions)


# ---- channels


def faulty(value: Any) -> Callable[[int, int], Sequence[Sample]]:
    return lambda k, now: [fresh(now)] if k <= 5 else [Sample(now, "talos/x", value)]


CHANNELS: dict[str, tuple[Callable[[int, int], Sequence[Sample]], str]] = {
    "silent": (lambda k, now: [fresh(now)] if k <= 5 else [], "old"),
    "NaN": (faulty(Scalar(math.nan)), "not finite"),
    "inf": (faulty(Scalar(-math.inf)), "not finite"),
    "wrong message": (faulty(Heartbeat(1)), "Heartbeat"),
    "no message": (faulty(None), "NoneType"),
    "far ahead": (lambda k, now: [fresh(now, stamp_ns=now + (k > 5) * 50 * MS)], "ahead"),
    "NaN stamp": (lambda k, now: [fresh(now, stamp_ns=math.nan if k > 5 else now)], "stamp"),
    "old stamps": (lambda k, now: [fresh(now, stamp_ns=min(now, 5 * TICK))], "old"),
    "NaN, then good": (lambda k, now: [*([fresh(now, value=math.nan)] if k > 5 else []), fresh(now)], "not finite"),
}


@pytest.mark.parametrize("name", CHANNELS)
def test_a_channel_that_fails_makes_the_kinds_of_its_readers_unobserved(name: str) -> None:
    samples, named = CHANNELS[name]
    supervisor = stage(detector("d", [SLIP], lambda now: [slip(now)]))
    decisions = play(supervisor, 40, TICK, samples=samples)
    assert decisions[4].trust.unobserved == ()
    # an age of at most 50 ms is allowed: two ticks without a sample are not yet stale
    lost = decisions[7:]
    assert all(d.trust.unobserved == (SLIP,) for d in lost)
    assert any(s != "ok" and named in r for s, r in health_of(decisions, "d"))
    assert decisions[-1].level is ProtectionLevel.MINIMAL_RISK
    assert not decisions[-1].motion_permitted


def test_nothing_ever_observed_is_no_permission() -> None:
    """Without warm-up and before the grace time has passed: silence from the start is not safety."""
    supervisor = stage(detector("a", [SLIP], lambda now: [slip(now)]), detector("b", [TORSO], lambda now: []))
    assert not any(d.motion_permitted for d in play(supervisor, 30))


def test_a_required_input_that_comes_back_restores_observation() -> None:
    def samples(k: int, now: int) -> Sequence[Sample]:
        return [] if 10 <= k < 20 else [fresh(now)]

    decisions = play(stage(detector("d", [SLIP], lambda now: [slip(now)])), 40, TICK, samples=samples)
    states = [s for s, _ in health_of(decisions, "d")]
    assert states == ["ok", "unobserved", "ok"]
    assert decisions[-1].trust.unobserved == ()


# ---- silence about a kind or a subject


def test_silence_about_a_declared_kind_is_not_absence() -> None:
    def script(now: int) -> list[Indication]:
        both = [said(SLIP, True, now), said(TORSO, False, now)]
        return both if now <= 5 * TICK else both[1:]

    decisions = play(stage(detector("d", [SLIP, TORSO], script)), 200, TICK)
    assert all(d.risk.probability == decisions[4].risk.probability for d in decisions[5:])
    assert decisions[5].trust.unobserved == (SLIP,)
    assert any(SLIP in r and s != "ok" for s, r in health_of(decisions, "d"))
    assert decisions[-1].level is ProtectionLevel.MINIMAL_RISK


def test_silence_about_a_subject_that_was_present_is_not_absence() -> None:
    def script(now: int) -> list[Indication]:
        feet = [said(SLIP, True, now, subject="left"), said(SLIP, False, now, subject="right")]
        return feet if now <= 5 * TICK else feet[1:]

    decisions = play(stage(detector("d", [SLIP], script)), 200, TICK)
    assert all(d.risk.probability == decisions[4].risk.probability for d in decisions[5:])
    assert decisions[5].trust.unobserved == (SLIP,)
    assert any(f"{SLIP}@left" in r and s != "ok" for s, r in health_of(decisions, "d"))
    assert decisions[-1].level is ProtectionLevel.MINIMAL_RISK


def test_one_foot_s_detector_does_not_stand_in_for_the_other_foot_s() -> None:
    def foot(side: str, until: int) -> Callable[[int], Any]:
        return lambda now: [said(SLIP, False, now, subject=side)] if now <= until else ValueError("dead")

    decisions = play(
        stage(detector("left", [SLIP], foot("left", 5 * TICK)), detector("right", [SLIP], foot("right", 10**12))),
        40,
        TICK,
    )
    assert decisions[5].trust.unobserved == (SLIP,)
    assert decisions[-1].level is ProtectionLevel.MINIMAL_RISK


def test_a_second_detector_of_the_same_subject_does_stand_in() -> None:
    decisions = play(
        stage(
            detector("a", [SLIP], lambda now: [slip(now)] if now <= 5 * TICK else ValueError("dead")),
            detector("b", [SLIP], lambda now: [slip(now)]),
        ),
        40,
        TICK,
    )
    assert decisions[-1].trust.unobserved == ()
    assert decisions[-1].motion_permitted
    assert health_of(decisions, "a")[-1][0] == "failed"


# ---- loss against absence


@st.composite
def worlds(draw: st.DrawFn) -> dict[str, Any]:
    """Detectors with overlapping kinds, their verdicts over time, and which is lost from when, and how."""
    detectors = {}
    for name in ["a", "b", "c"][: draw(st.integers(1, 3))]:
        pairs = draw(
            st.lists(
                st.tuples(st.sampled_from([SLIP, TORSO, COM]), st.sampled_from(["", "left"])),
                min_size=1,
                max_size=3,
                unique=True,
            )
        )
        detectors[name] = {p: draw(st.lists(st.booleans(), min_size=12, max_size=12)) for p in pairs}
    return {
        "detectors": detectors,
        "lost": draw(st.sets(st.sampled_from(sorted(detectors)), min_size=1)),
        "at": draw(st.integers(1, 11)),
        "how": draw(st.sampled_from(["raise", "nan", "none", "channel", "verdict", "silent"])),
        "kernel": draw(st.sampled_from(["boxcar", "exponential"])),
        "recurrence": draw(st.sampled_from([0.0, 0.1])),
    }


def run(world: dict[str, Any], lossy: bool) -> list[Decision]:
    """40 ticks of 50 ms; verdicts of the last 28 repeat the history, so that windows of 0.4 s open and close."""

    def spec(name: str, verdicts: dict[tuple[str, str], list[bool]]) -> DetectorSpec:
        def script(now: int) -> Any:
            k = now // (50 * MS)
            gone = name in world["lost"] and k >= world["at"]
            if gone and lossy:
                if world["how"] == "raise":
                    return ValueError("lost")
                if world["how"] == "nan":
                    return [said(kind, False, now, subject=s, severity=math.nan) for kind, s in verdicts]
                if world["how"] == "none":
                    return None
                if world["how"] == "silent":
                    return []
            return [said(kind, v[k % 12] and not gone, now, subject=s) for (kind, s), v in verdicts.items()]

        return detector(name, sorted({kind for kind, _ in verdicts}), script, channel=f"c/{name}")

    supervisor = stage(
        *(spec(n, v) for n, v in world["detectors"].items()),
        window=Window(0.4, world["recurrence"], world["kernel"]),
        trust=TrustSettings(recovery_s=0.2),
    )
    decisions = []
    for k in range(1, 41):
        now = k * 50 * MS
        gone = [n for n in world["lost"] if lossy and k >= world["at"]]
        muted = gone if world["how"] == "channel" else []
        samples = [
            # a channel is lost at once if it carries garbage, by age if it is silent
            fresh(now, f"c/{n}", value=math.nan if n in muted else 0.0)
            for n in world["detectors"]
        ]
        verdicts = dict.fromkeys(gone, "late: recorded") if world["how"] == "verdict" else None
        decisions.append(supervisor.step(samples, now, verdicts))
    return decisions


@settings(max_examples=120)
@given(worlds())
def test_a_lost_detector_is_never_better_than_one_that_reports_absence(world: dict[str, Any]) -> None:
    lost, absent = run(world, lossy=True), run(world, lossy=False)
    for k, (n, a) in enumerate(zip(lost, absent, strict=True), start=1):
        if k < world["at"]:
            assert n.risk == a.risk
            assert n.trust == a.trust
            continue
        # sums of floats in another order differ in the last places
        assert n.trust.control_trust <= a.trust.control_trust + 1e-12
        assert n.risk.probability >= a.risk.probability - 1e-12
        for mode, t in n.trust.control_by_mode.items():
            assert t <= a.trust.control_by_mode[mode] + 1e-12
        assert n.level >= a.level
        assert n.motion_permitted <= a.motion_permitted


@settings(max_examples=60)
@given(st.lists(st.booleans(), min_size=1, max_size=15), st.sampled_from(["boxcar", "exponential"]))
def test_p_is_not_changed_by_the_loss_itself(history: list[bool], kernel: Any) -> None:
    """At the tick of the loss P lies between absence and the last verdict going on; from then on it stands still."""
    lost_at = len(history) + 1

    def script(after: Any) -> Callable[[int], Any]:
        def answer(now: int) -> Any:
            k = now // TICK
            if k >= lost_at:
                return after if isinstance(after, BaseException) else [said(SLIP, after, now)]
            return [said(SLIP, history[k - 1], now)]

        return answer

    def p_of(after: Any) -> list[float]:
        supervisor = stage(detector("d", [SLIP], script(after)), window=Window(0.2, kernel=kernel))
        return [d.risk.probability for d in play(supervisor, lost_at + 40, TICK)]

    lost, absent, going_on = p_of(ValueError("lost")), p_of(False), p_of(history[-1])
    k = lost_at - 1
    assert absent[k] - 1e-12 <= lost[k] <= going_on[k] + 1e-12
    assert set(lost[k:]) == {lost[k]}


def test_evidence_runs_on_after_recovery() -> None:
    def script(now: int) -> Any:
        k = now // TICK
        return ValueError("gap") if k in (10, 11) else [said(SLIP, k <= 5, now)]

    spec = detector("d", [SLIP], script)
    decisions = play(stage(spec, window=Window(0.4)), 60, TICK)
    with_gap = [d.now_ns for d in decisions if d.risk.probability > 0.0][-1]
    # last present at 5 ticks, window 20 ticks; the clock stood still for 2, from the first lost tick to the next seen
    assert with_gap == (5 + 20 - 1 + 2) * TICK
    assert decisions[-1].trust.unobserved == ()
    assert decisions[-1].trust.control_trust > 0.9


def test_a_detector_that_fails_again_and_again_is_given_up_until_reset() -> None:
    supervisor = stage(detector("d", [SLIP], lambda now: ValueError("x") if now <= 3 * TICK else [slip(now)]))
    decisions = play(supervisor, 10, TICK)
    assert decisions[-1].trust.unobserved == (SLIP,)
    supervisor.reset(0, 10 * TICK)
    assert play(supervisor, 12, TICK, first=11)[-1].trust.unobserved == ()


# ---- warm-up, verdicts, periods


def test_no_lease_and_no_intervention_during_warm_up() -> None:
    supervisor = stage(detector("d", [SLIP], lambda now: [said(SLIP, True, now)], warm_up_s=0.2))
    for k in range(1, 10):
        d = supervisor.step([fresh(k * TICK)], k * TICK)
        assert not d.motion_permitted
        assert supervisor.lease(1, 0, k * TICK) is None
        assert d.interventions == ()
        assert d.trust.unobserved == (SLIP,)
    d = supervisor.step([fresh(10 * TICK)], 10 * TICK)
    assert d.motion_permitted
    lease = supervisor.lease(7, 123, 10 * TICK, 0.1)
    assert lease is not None
    assert (lease.nonce, lease.guard_ns, lease.ttl_ns) == (7, 123, 100 * MS)


def test_a_detector_that_was_reset_by_a_failure_warms_up_again_unobserved() -> None:
    def script(now: int) -> Any:
        return ValueError("once") if now == 20 * TICK else [slip(now)]

    decisions = play(stage(detector("d", [SLIP], script, warm_up_s=0.1)), 40, TICK)
    unobserved = [k for k, d in enumerate(decisions, start=1) if d.trust.unobserved]
    assert unobserved == [1, 2, 3, 4, 20, 21, 22, 23, 24]


def test_a_verdict_makes_the_detector_unobserved_in_its_tick() -> None:
    supervisor = stage(detector("d", [SLIP], lambda now: [slip(now)]))
    d = supervisor.step([fresh(TICK)], TICK, {"d": "late: 12 ms of 5 ms"})
    assert d.trust.unobserved == (SLIP,)
    assert health_of([d], "d") == [("failed", "verdict: late: 12 ms of 5 ms")]


def test_a_verdict_on_a_detector_that_does_not_run_is_refused() -> None:
    supervisor = stage(detector("balance", [SLIP], lambda now: [slip(now)]))
    with pytest.raises(BadInputError, match=r"'blance'.*did you mean 'balance'"):
        supervisor.step([], TICK, {"blance": "late"})


def test_a_slow_detector_s_verdict_stands_until_its_next_update() -> None:
    decisions = play(
        stage(detector("d", [SLIP], lambda now: [said(SLIP, now < 6 * TICK, now)], period_s=0.1), window=Window(0.2)),
        30,
        TICK,
    )
    # updated at ticks 1, 6, 11, ...: present until tick 5, inside the window of 10 ticks until tick 14
    assert [k for k, d in enumerate(decisions, start=1) if d.risk.probability > 0.0] == list(range(1, 15))


def test_a_prediction_runs_down_between_updates_and_is_not_withdrawn_by_a_loss() -> None:
    def script(now: int) -> Any:
        return ValueError("dead") if now > 5 * TICK else [said(SLIP, True, now, tte=0.3)]

    decisions = play(stage(detector("d", [SLIP], script, period_s=0.1)), 25, TICK)
    expected = [max(0.0, 0.3 - 0.02 * k) for k in range(25)]
    assert [d.time_to_event_s for d in decisions] == pytest.approx(expected, abs=1e-9)


def test_observed_absence_withdraws_a_prediction() -> None:
    script = lambda now: [said(SLIP, now <= TICK, now, tte=0.3 if now <= TICK else None)]  # noqa: E731 # a script
    decisions = play(stage(detector("d", [SLIP], script)), 2, TICK)
    assert [d.time_to_event_s for d in decisions] == [0.3, None]


@pytest.mark.parametrize("field", ["period_s", "warm_up_s", "max_age_s"])
@pytest.mark.parametrize("value", [math.nan, -1.0, math.inf])
def test_a_spec_whose_times_are_no_times_is_refused(field: str, value: float) -> None:
    with pytest.raises(BadInputError, match=field):
        stage(detector("d", [SLIP], lambda now: [slip(now)], **{field: value}))


@pytest.mark.parametrize("verdict", [None, 3, ["late"]])
def test_a_verdict_of_no_type_is_refused(verdict: Any) -> None:
    with pytest.raises(BadInputError, match=r"verdicts\.d"):
        stage(detector("d", [SLIP], lambda now: [slip(now)])).step([], TICK, {"d": verdict})


def test_a_verdict_without_words_is_a_verdict() -> None:
    supervisor = stage(detector("d", [SLIP], lambda now: [slip(now)]))
    assert supervisor.step([fresh(TICK)], TICK, {"d": ""}).trust.unobserved == (SLIP,)


# ---- failures count together within a minute


def failing_at(*seconds: int) -> list[Decision]:
    """Ticks of 1 s over five minutes; the detector raises at these."""
    s = 1_000_000_000
    script = lambda now: ValueError("x") if now // s in seconds else [slip(now)]  # noqa: E731 # a script
    return play(stage(detector("d", [SLIP], script)), 300, s)


def test_failures_far_apart_do_not_end_a_detector() -> None:
    """At any time at most two lie within a minute, up to the tick."""
    decisions = failing_at(10, 60, 70, 120, 130, 180, 240)
    assert [k for k, d in enumerate(decisions, start=1) if d.trust.unobserved] == [10, 60, 70, 120, 130, 180, 240]


def test_three_failures_within_a_minute_end_it_until_reset() -> None:
    decisions = failing_at(10, 40, 69)
    assert [k for k, d in enumerate(decisions, start=1) if d.trust.unobserved] == [10, 40, *range(69, 301)]
    assert "gave up after 3 failures" in health_of(decisions, "d")[-1][1]


# ---- readers of everything


class Broken(Message, frozen=True):
    """A message that is none of ours."""


MALFORMED: dict[str, tuple[Any, str, str]] = {
    "stamp str": (Sample("a", "talos/odd", Scalar(0.0)), "talos/odd", "stamp"),  # type: ignore[arg-type]
    "stamp NaN": (Sample(math.nan, "talos/odd", Scalar(0.0)), "talos/odd", "stamp"),  # type: ignore[arg-type]
    "stamp beyond 64 bits": (Sample(-(10**30), "talos/odd", Scalar(0.0)), "talos/odd", "stamp"),
    "seq str": (Sample(1, "talos/odd", Scalar(0.0), "a"), "talos/odd", "seq"),  # type: ignore[arg-type]
    "seq inf": (Sample(1, "talos/odd", Scalar(0.0), math.inf), "talos/odd", "seq"),  # type: ignore[arg-type]
    "received None": (Sample(1, "talos/odd", Scalar(0.0), 1, None), "talos/odd", "received"),  # type: ignore[arg-type]
    "NaN": (Sample(1, "talos/odd", Scalar(math.nan)), "talos/odd", "not finite"),
    "int beyond float": (Sample(1, "talos/odd", Scalar(10**400)), "talos/odd", "not finite"),
    "broken inside": (Sample(1, "talos/odd", Detections((None,))), "talos/odd", "Detections"),  # type: ignore[arg-type]
    "no message": (Sample(1, "talos/odd", None), "talos/odd", "NoneType"),  # type: ignore[arg-type]
    "foreign message": (Sample(1, "talos/odd", Broken()), "talos/odd", "Broken"),  # type: ignore[arg-type]
    "channel None": (Sample(1, None, Scalar(0.0)), "samples", "NoneType"),  # type: ignore[arg-type]
    "channel list": (Sample(1, ["x"], Scalar(0.0)), "samples", "list"),  # type: ignore[arg-type]
    "channel half a letter": (Sample(1, "talos/\ud800", Scalar(0.0)), "samples", "printed"),
    "channel named as the detector": (Sample(1, "all", Scalar(math.nan)), "samples", "not finite"),
    "no sample": (None, "samples", "NoneType"),
}


@pytest.mark.parametrize("name", MALFORMED)
@pytest.mark.parametrize("everything", [True, False])
def test_a_malformed_sample_on_an_unknown_channel_is_dropped_and_named(name: str, everything: bool) -> None:
    sample, source, named = MALFORMED[name]
    reader = Scripted(lambda now: [slip(now)])
    spec = detector("all", [SLIP], reader)
    if everything:
        spec = msgspec.structs.replace(spec, inputs=(Input("value", "*", Scalar),))
    supervisor = stage(spec)
    decisions = play(supervisor, 6, TICK, samples=lambda k, now: [*([sample] if k in (2, 3, 4) else []), fresh(now)])
    journal = DigestJournal()
    for d in decisions:
        journal.tick((), d)
    assert all(d.trust.unobserved == () for d in decisions)
    assert [s.stamp_ns for i in reader.inputs for s in i.new["value"]] == [k * TICK for k in range(1, 7)]
    (state, reason), back = health_of(decisions, source)
    assert (state, back[0]) == ("failed", "ok")
    assert named in reason
    assert [h.source for h in decisions[1].health] == [source]


@pytest.mark.parametrize("fields", [{"seq": "a"}, {"received_ns": math.nan}, {"stamp_ns": 10**400}])
def test_a_misnumbered_sample_on_a_known_channel_makes_its_readers_kinds_unobserved(fields: dict[str, Any]) -> None:
    supervisor = stage(detector("d", [SLIP], lambda now: [slip(now)]))
    d = supervisor.step([msgspec.structs.replace(fresh(TICK), **fields)], TICK)
    assert d.trust.unobserved == (SLIP,)
    assert next(iter(fields)).removesuffix("_ns") in health_of([d], "d")[0][1]
    DigestJournal().tick((), d)


# ---- the lease


PERIOD = 5 * MS
"""Of the default configuration."""


def moving() -> Supervisor:
    """After ten good ticks."""
    supervisor = stage(detector("d", [SLIP], lambda now: [slip(now)]))
    assert supervisor.period_ns == PERIOD
    assert play(supervisor, 10, PERIOD)[-1].motion_permitted
    return supervisor


@pytest.mark.parametrize(("after_ns", "granted"), [(0, True), (2 * PERIOD, True), (2 * PERIOD + 1, False), (-1, False)])
def test_a_supervisor_that_stopped_stepping_grants_nothing(after_ns: int, granted: bool) -> None:
    assert (moving().lease(1, 0, 10 * PERIOD + after_ns) is not None) is granted


def test_a_step_that_raised_takes_the_permission_back() -> None:
    supervisor = moving()
    with pytest.raises(ForeshockError, match="backwards"):
        supervisor.step([], PERIOD)
    assert supervisor.lease(1, 0, 10 * PERIOD) is None
    supervisor = moving()
    with pytest.raises(BadInputError, match="verdicts"):
        supervisor.step([], 11 * PERIOD, {"nobody": "late"})
    assert supervisor.lease(1, 0, 11 * PERIOD) is None
    supervisor.step([fresh(12 * PERIOD)], 12 * PERIOD)
    assert supervisor.lease(1, 0, 12 * PERIOD) is not None


def test_reset_takes_the_permission_back() -> None:
    supervisor = moving()
    supervisor.reset(0, 10 * PERIOD)
    assert supervisor.lease(1, 0, 10 * PERIOD) is None


@pytest.mark.parametrize("ttl_s", [0.0, -1.0, math.nan, math.inf, 1.0000001, 1e9])
def test_a_time_to_live_that_is_none_or_too_long_is_refused(ttl_s: float) -> None:
    supervisor = moving()
    with pytest.raises(ConfigError, match=r"lease\.ttl_s"):
        supervisor.lease(1, 0, 10 * PERIOD, ttl_s)
    lease = supervisor.lease(1, 0, 10 * PERIOD, 1.0)
    assert lease is not None
    assert lease.ttl_ns == 1000 * MS


def test_a_supervisor_of_a_later_epoch_fences_off_the_earlier() -> None:
    spec = detector("d", [SLIP], lambda now: [slip(now)])
    base = stage(spec)
    quiet = module(policies=[PolicySpec("stage", lambda _: ScriptedPolicy(lambda _: ()), Nothing)])
    registry = Registry(modules={"d": module([spec]), "stage": quiet})
    old = Supervisor(base.config, registry=registry, epoch=1_700_000_000_000_000_000)
    new = Supervisor(base.config, registry=registry, epoch=1_700_000_060_000_000_000)
    guard = MotionGuard()

    def asks(supervisor: Supervisor, k: int) -> bool:
        now = k * PERIOD
        supervisor.step([fresh(now)], now)
        lease = supervisor.lease(*guard.request(now), now)
        assert lease is not None
        return guard.receive(lease)

    assert asks(old, 1)
    assert asks(new, 2)
    assert not asks(old, 3)  # replaced, but still running and content
    assert guard.permitted(2 * PERIOD + 100 * MS - 1)
    assert not guard.permitted(2 * PERIOD + 100 * MS)
    assert asks(new, 4)


@pytest.mark.parametrize("epoch", [-1, 1.5, math.nan, True, "1"])
def test_an_epoch_that_is_none_is_refused(epoch: Any) -> None:
    with pytest.raises(ConfigError, match="epoch"):
        Supervisor(stage(detector("d", [SLIP], lambda now: [slip(now)])).config, epoch=epoch)
