"""Rules 3 and 4: decisions are a function of what came in, and each says why."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import msgspec
import numpy as np
import pytest
from foreshock_stage import COM, MS, SLIP, TORSO, Scripted, detector, fresh, module, play, said, stage
from hypothesis import given, settings
from hypothesis import strategies as st

from foreshock.config import Config, DetectorEntry, PolicyEntry
from foreshock.detector import DetectorSpec, Input, Inputs
from foreshock.errors import ForeshockError
from foreshock.evidence import Window
from foreshock.journal import DigestJournal, MemoryJournal
from foreshock.messages import Scalar
from foreshock.policy import ActionSpec, Proposal, Situation
from foreshock.records import Decision, Indication, ProtectionLevel, Sample, SampleRef
from foreshock.registry import Registry
from foreshock.supervisor import Supervisor
from foreshock.testing import ThresholdConfig, ThresholdDetector
from foreshock.trust import Gates

TICK = 10 * MS
CHANNELS = {"slip": SLIP, "torso": TORSO, "com": COM}


class Threshold:
    """The shipped threshold detector, seeded: its threshold is drawn at reset, as a real one may draw its noise."""

    def __init__(self, kind: str) -> None:
        self._kind = kind
        self.reset(0)

    def reset(self, seed: int) -> None:
        noise = float(np.random.default_rng(seed).uniform(0.0, 0.1))
        self._inner = ThresholdDetector(self._kind, ThresholdConfig(threshold=1.0 + noise))

    def update(self, now_ns: int, inputs: Inputs) -> Sequence[Indication]:
        return self._inner.update(now_ns, inputs)


def specs() -> dict[str, DetectorSpec]:
    out = {}
    for name, kind in CHANNELS.items():
        inputs = (Input("value", f"body/{name}", Scalar, max_age_s=0.025),)
        out[name] = DetectorSpec(name, (kind,), inputs, lambda _, k=kind: Threshold(k))
    return out


def built(order: Sequence[str], registered: Sequence[str]) -> Supervisor:
    plugins = {name: module([specs()[name]]) for name in registered}
    config = Config(
        tuple(DetectorEntry(n) for n in order), window=Window(0.3), policies=(PolicyEntry("ladder"),), gates=Gates()
    )
    return Supervisor(config, registry=Registry(modules=plugins))


def stream(seed: int, ticks: int = 120) -> list[list[Sample]]:
    """Noisy bursts on three channels, with gaps, garbage and disorder."""
    rng = np.random.default_rng(seed)
    out = []
    for k in range(1, ticks + 1):
        now, arrived = k * TICK, []
        for j, name in enumerate(CHANNELS):
            value = float(rng.normal(0.0, 0.3) + (1.5 if (k + 30 * j) % 90 < 12 else 0.0))
            if rng.random() < 0.03:
                value = float("nan")
            if rng.random() < 0.9:
                arrived.append(fresh(now, f"body/{name}", value, stamp_ns=now - int(rng.integers(0, 8)) * MS))
        out.append(arrived)
    return out


def digest(supervisor: Supervisor, samples: list[list[Sample]]) -> str:
    journal = DigestJournal()
    for k, arrived in enumerate(samples, start=1):
        journal.tick(arrived, supervisor.step(arrived, k * TICK))
    return journal.digest


ORDER = ["slip", "torso", "com"]


@settings(max_examples=15)
@given(st.permutations(ORDER), st.permutations(ORDER), st.integers(0, 2**31))
def test_same_samples_same_digest_whatever_the_order_of_plugins(order: list[str], found: list[str], seed: int) -> None:
    samples = stream(seed, 60)
    assert digest(built(order, found), samples) == digest(built(ORDER, ORDER), samples)


def test_reset_equals_new_even_after_failures_and_latches() -> None:
    used = built(ORDER, ORDER)
    digest(used, stream(1))
    for k in range(200, 400):
        last = used.step([], k * TICK)
    assert last.level is ProtectionLevel.MINIMAL_RISK
    used.operator_reset("a", "b", 400 * TICK)
    used.reset(7)
    new = built(ORDER, ORDER)
    new.reset(7)
    assert used.resets == []
    assert digest(used, stream(2)) == digest(new, stream(2))


def test_the_seed_reaches_the_detectors() -> None:
    one, other = built(ORDER, ORDER), built(ORDER, ORDER)
    one.reset(1)
    other.reset(2)
    assert digest(one, stream(3)) != digest(other, stream(3))


def test_verdicts_are_inputs() -> None:
    samples = stream(4, 40)

    def of(verdicts: Mapping[int, Mapping[str, str]]) -> str:
        supervisor, journal = built(ORDER, ORDER), DigestJournal()
        for k, arrived in enumerate(samples, start=1):
            journal.tick(arrived, supervisor.step(arrived, k * TICK, verdicts.get(k)))
        return journal.digest

    late = {9: {"slip": "late", "com": "late"}}
    swapped = {9: {"com": "late", "slip": "late"}}
    assert of(late) == of(late) == of(swapped)
    assert of(late) != of({})


def test_the_digest_does_not_depend_on_the_order_of_a_dict() -> None:
    (d,) = play(built(ORDER, ORDER), 1, TICK)
    risk = msgspec.structs.replace(d.risk, by_mode=dict(reversed(d.risk.by_mode.items())))
    one, other = DigestJournal(), DigestJournal()
    one.tick((), d)
    other.tick((), msgspec.structs.replace(d, risk=risk))
    assert one.digest == other.digest


def test_time_going_backwards_is_refused() -> None:
    supervisor = built(ORDER, ORDER)
    supervisor.step([], 5 * TICK)
    supervisor.step([], 5 * TICK)
    with pytest.raises(ForeshockError, match="backwards"):
        supervisor.step([], 5 * TICK - 1)


def test_a_detector_that_reuses_its_dict_does_not_rewrite_history() -> None:
    measures = {"margin_m": 0.0}

    def script(now: int) -> list[Indication]:
        measures["margin_m"] = now / 1e9
        return [msgspec.structs.replace(said(SLIP, False, now), measures=measures)]

    journal = MemoryJournal()
    for k, d in enumerate(play(stage(detector("d", [SLIP], script)), 3, TICK), start=1):
        journal.tick((), d)
        assert d.indications[0].measures == {"margin_m": k / 100}
    assert [d.indications[0].measures["margin_m"] for _, d in journal.ticks] == [0.01, 0.02, 0.03]


def test_a_policy_cannot_write_into_what_the_next_tick_starts_from() -> None:
    def script(situation: Situation) -> Sequence[Proposal]:
        situation.trust["A1"] = 1.0  # type: ignore[index]  # a rogue
        return ()

    decisions = play(stage(detector("d", [SLIP], lambda now: [said(SLIP, True, now)]), policy=script), 3, TICK)
    clean = play(stage(detector("d", [SLIP], lambda now: [said(SLIP, True, now)])), 3, TICK)
    assert [d.trust for d in decisions] == [d.trust for d in clean]


# ---- rule 4


def test_a_decision_names_precursors_samples_and_rule() -> None:
    def policy(situation: Situation) -> Sequence[Proposal]:
        level = situation.levels["A1"]
        return [Proposal("step-suppression", 1.0, level, "A1", "A1 below the protective gate")] if level >= 2 else ()

    script = {
        "a": lambda now: [said(SLIP, now >= TICK, now, subject="left")],
        "b": lambda now: [said(TORSO, now >= 2 * TICK, now)],
        "c": lambda now: [said(COM, now >= 3 * TICK, now)],
    }
    kinds = {"a": SLIP, "b": TORSO, "c": COM}
    supervisor = stage(*(detector(n, [kinds[n]], s) for n, s in script.items()), policy=policy)
    decisions = play(supervisor, 3, TICK)
    assert [round(d.risk.by_mode["A1"], 4) for d in decisions] == [0.1174, 0.4546, 0.8093]  # Table 4
    d = decisions[-1]
    assert [(p.kind, p.subject, p.detector, p.phase) for p in d.precursors] == [
        (COM, "", "c", "onset"),
        (SLIP, "left", "a", "ongoing"),
        (TORSO, "", "b", "ongoing"),
    ]
    assert all(p.evidence == (SampleRef("talos/x", 3 * TICK),) for p in d.precursors)
    (action,) = d.interventions
    assert action.reasons[0] == "A1 below the protective gate"
    assert set(action.reasons[1:]) == {f"{SLIP}@left", TORSO, COM}
    assert action in d.changes
    (why,) = [e for e in d.explanations if e.mode == "A1"]
    assert (why.gate, len(why.attribution), len(why.smallest)) == (0.3, 3, 3)
    for a in why.attribution:
        # leave one out of three: Eq. 1 at 3 less Eq. 1 at 2
        assert a.share == pytest.approx(0.8093 - 0.4546, abs=1e-4)


def test_minimal_risk_names_its_reason_while_lost_and_while_latched() -> None:
    def script(now: int) -> Any:
        return ValueError("x") if 5 * TICK < now <= 7 * TICK else [said(SLIP, False, now)]

    supervisor = stage(
        detector("d", [SLIP], lambda now: [said(SLIP, False, now)], max_age_s=0.02), gates=Gates(dwell_s=0.0)
    )
    lost = play(supervisor, 60, TICK, samples=lambda k, now: [fresh(now)] if k < 5 or k > 50 else [])
    (at_loss,) = [i for d in lost for i in d.changes if i.action == "minimal-risk"]
    assert SLIP in at_loss.reasons[0]
    assert lost[-1].trust.unobserved == ()
    assert lost[-1].level is ProtectionLevel.MINIMAL_RISK
    assert not lost[-1].motion_permitted
    record = supervisor.operator_reset("operator 7", "looked at the robot", 60 * TICK)
    assert supervisor.resets == [record]
    after = supervisor.step([fresh(61 * TICK)], 61 * TICK)
    assert after.level is ProtectionLevel.NORMAL
    assert after.motion_permitted


def test_an_operator_s_reset_does_not_release_what_still_demands_protection() -> None:
    supervisor = stage(detector("d", [SLIP], lambda now: [said(SLIP, False, now)]))
    play(supervisor, 100, TICK, samples=lambda k, now: [fresh(now)] if k < 5 else [])
    supervisor.operator_reset("operator 7", "too early", 100 * TICK)
    d = supervisor.step([], 101 * TICK)
    assert d.level is ProtectionLevel.MINIMAL_RISK
    assert not d.motion_permitted


# ---- a policy that fails


BAD_POLICIES: dict[str, Any] = {
    "raises": ValueError("boom"),
    "exits": SystemExit(1),
    "None": None,
    "foreign type": [("step-suppression", 1.0)],
    "undeclared action": [Proposal("step-supression", 1.0, ProtectionLevel.CAUTION)],
    "NaN strength": [Proposal("balance-lock", float("nan"), ProtectionLevel.CAUTION)],
    "strength above 1": [Proposal("balance-lock", 1.1, ProtectionLevel.CAUTION)],
    "level of no type": [Proposal("balance-lock", 1.0, "high")],
    "unknown level": [Proposal("balance-lock", 1.0, 7)],
    "rule of no type": [Proposal("balance-lock", 1.0, ProtectionLevel.CAUTION, "A1", object())],
}


@pytest.mark.parametrize("name", BAD_POLICIES)
def test_a_policy_that_fails_brings_the_minimal_risk_condition(name: str) -> None:
    answer = BAD_POLICIES[name]

    def policy(situation: Situation) -> Any:
        if situation.now_ns < 3 * TICK:
            return ()
        if isinstance(answer, BaseException):
            raise answer
        return answer

    decisions = play(stage(detector("d", [SLIP], lambda now: [said(SLIP, False, now)]), policy=policy), 5, TICK)
    assert decisions[1].motion_permitted
    for d in decisions[2:]:
        assert d.level is ProtectionLevel.MINIMAL_RISK
        assert not d.motion_permitted
        assert "minimal-risk" in {i.action for i in d.interventions}
    journal = DigestJournal()
    for d in decisions:
        journal.tick((), d)
    assert [(h.source, h.state) for h in decisions[2].health] == [("policy", "failed")]
    if name == "undeclared action":
        assert "did you mean 'step-suppression'" in decisions[2].health[0].reason


def test_a_policy_may_bring_its_own_action() -> None:
    own = ActionSpec("kneel", "kneel down", ("posture",), 0.5)
    supervisor = stage(
        detector("d", [SLIP], lambda now: [said(SLIP, False, now)]),
        policy=lambda _: [Proposal("kneel", np.float64(0.5), ProtectionLevel.CAUTION, "", "always")],
        actions=(own,),
    )
    (d,) = play(supervisor, 1, TICK)
    assert [(i.action, i.strength) for i in d.interventions] == [("kneel", 0.5)]
    DigestJournal().tick((), d)


def test_inputs_hold_what_is_new_since_the_last_update() -> None:
    scripted = Scripted(lambda now: [said(SLIP, False, now)])
    supervisor = stage(detector("d", [SLIP], scripted, period_s=0.02, max_age_s=0.1))
    decisions: list[Decision] = play(supervisor, 5, TICK)
    assert len(decisions) == 5
    stamps = [[s.stamp_ns // TICK for s in i.new["value"]] for i in scripted.inputs]
    assert stamps == [[1], [2, 3], [4, 5]]
    assert [i.latest["value"].stamp_ns // TICK for i in scripted.inputs] == [1, 3, 5]


def test_a_recorded_run_with_verdicts_and_resets_replays_to_the_same_digest() -> None:
    """What a MemoryJournal holds is all that decides; without the resets or the verdicts it is another run."""
    live, kept, digests = built(ORDER, ORDER), MemoryJournal(), DigestJournal()
    for k, arrived in enumerate(stream(5, 150), start=1):
        lost = [] if 40 <= k < 90 else arrived
        late = {"slip": "late: 12 ms of 5 ms"} if k in (7, 8) else None  # the same words twice in a row
        d = live.step(lost, k * TICK, late)
        for journal in (kept, digests):
            journal.tick(lost, d, live.verdicts_of(d))
            if k in (80, 110):
                journal.operator_reset(live.operator_reset("operator 7", "looked", k * TICK))
    assert kept.verdicts[6:8] == [{"slip": "late: 12 ms of 5 ms"}] * 2

    def replayed(verdicts: bool = True, resets: bool = True) -> str:
        again, journal = built(ORDER, ORDER), DigestJournal()
        for k, ((samples, old), said_of) in enumerate(zip(kept.ticks, kept.verdicts, strict=True), start=1):
            d = again.step(samples, old.now_ns, said_of if verdicts else None)
            journal.tick(samples, d, again.verdicts_of(d))
            for at, record in kept.resets:
                if at == k and resets:
                    journal.operator_reset(again.operator_reset(record.who, record.why, record.stamp_ns))
        return journal.digest

    assert replayed() == digests.digest
    assert len({replayed(), replayed(verdicts=False), replayed(resets=False)}) == 3


def test_a_policy_s_or_channel_s_failure_and_what_a_detector_raises_are_no_verdicts() -> None:
    for answer in (ValueError("verdict: late"), ValueError("; the last: verdict: late")):
        supervisor = stage(detector("d", [SLIP], lambda now, a=answer: a))
        assert [supervisor.verdicts_of(d) for d in play(supervisor, 4, TICK)] == [{}] * 4


def test_the_verdict_that_ends_a_detector_is_a_verdict_once() -> None:
    supervisor = stage(detector("d", [SLIP], lambda now: [said(SLIP, False, now)]))
    ticks = [supervisor.step([fresh(k * TICK)], k * TICK, {"d": "late"}) for k in range(1, 7)]
    told = [supervisor.verdicts_of(d) for d in ticks]
    assert told == [{"d": "late"}] * 3 + [{}] * 3
