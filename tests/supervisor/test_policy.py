"""Rule 6: the arbiter starts only what finishes before the predicted accident, one action per resource."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from foreshock.policy import ACTIONS, ActionSpec, Arbiter, ArbiterState, Proposal, Situation
from foreshock.records import Intervention, Precursor, ProtectionLevel
from foreshock_detectors.policies import Ladder, LadderConfig

MS = 1_000_000
CAUTION, PROTECTIVE = ProtectionLevel.CAUTION, ProtectionLevel.PROTECTIVE
PROTOCOLS = ("step-suppression", "arm-reconfiguration", "compliance-tuning", "balance-lock")


def situation(now_ns: int, tte: float | None = None, precursors: Sequence[Precursor] = ()) -> Situation:
    return Situation(now_ns, {}, {}, 1.0, ProtectionLevel.NORMAL, precursors, tte)


def want(*actions: str, strength: float = 1.0, level: ProtectionLevel = PROTECTIVE) -> list[Proposal]:
    return [Proposal(a, strength, level, "A1", "rule") for a in actions]


class Bench:
    """An arbiter and its state over ticks of 10 ms."""

    def __init__(self, release_s: float = 0.1, actions: dict[str, ActionSpec] | None = None) -> None:
        self.arbiter, self.state, self.now = Arbiter(actions or ACTIONS, release_s), ArbiterState(), 0
        self.changes: list[Intervention] = []

    def tick(self, proposals: Sequence[Proposal], tte: float | None = None) -> dict[str, float]:
        self.now += 10 * MS
        self.state, held, changes = self.arbiter.step(self.state, situation(self.now, tte), proposals)
        self.changes = list(changes)
        return {i.action: i.strength for i in held}


@pytest.mark.parametrize("action", PROTOCOLS)
def test_an_action_that_takes_longer_than_the_predicted_time_is_not_started(action: str) -> None:
    duration = ACTIONS[action].duration_s
    assert action not in Bench().tick(want(action), duration - 1e-6)
    assert action in Bench().tick(want(action), duration)
    assert action in Bench().tick(want(action), None)


def test_an_engaged_action_is_kept_when_the_time_runs_out() -> None:
    bench = Bench()
    bench.tick(want("arm-reconfiguration"), 0.5)
    for _ in range(30):  # longer than a release ramp would take
        assert bench.tick(want("arm-reconfiguration"), 0.01) == {"arm-reconfiguration": 1.0}
        assert bench.changes == []


def test_speed_and_the_minimal_risk_condition_need_no_time() -> None:
    assert set(Bench().tick(want("speed-scale", "minimal-risk"), 0.0)) == {"speed-scale", "minimal-risk"}


def test_impact_mitigation_only_at_the_end() -> None:
    everything = want(*PROTOCOLS, "impact-mitigation")
    assert "impact-mitigation" not in Bench().tick(everything, None)
    assert "impact-mitigation" not in Bench().tick(everything, 1.0)
    # 0.1 s: the balance lock of 50 ms can still prevent the fall
    assert "impact-mitigation" not in Bench().tick(everything, 0.1)
    # 10 ms: nothing new helps any more
    assert set(Bench().tick(everything, 0.01)) == {"impact-mitigation"}


def test_mitigation_takes_the_arms_from_what_held_them() -> None:
    bench = Bench()
    assert "arm-reconfiguration" in bench.tick(want("arm-reconfiguration"), 0.5)
    for _ in range(31):  # engaged for its whole duration: no hope is left in it
        bench.tick(want("arm-reconfiguration"), 0.5)
    held = bench.tick(want("arm-reconfiguration", "impact-mitigation"), 0.01)
    assert set(held) == {"impact-mitigation"}
    gone = [i for i in bench.changes if i.action == "arm-reconfiguration"]
    assert [i.strength for i in gone] == [0.0]


def test_two_proposals_of_one_action_are_one_at_the_strongest() -> None:
    proposals = [
        Proposal("speed-scale", 0.9, CAUTION, "", "a"),
        Proposal("speed-scale", 0.3, PROTECTIVE, "", "b"),
        Proposal("speed-scale", 0.5, CAUTION, "", "c"),
    ]
    for order in itertools.permutations(proposals):
        bench = Bench()
        assert bench.tick(order) == {"speed-scale": 0.9}
        assert len(bench.changes) == 1


def test_of_two_actions_on_one_resource_the_higher_level_wins() -> None:
    actions = {a: ActionSpec(a, a, ("legs",), 0.1) for a in ("squat", "stretch")}
    proposals = [*want("squat", level=CAUTION), *want("stretch", level=PROTECTIVE)]
    assert set(Bench(actions=actions).tick(proposals)) == {"stretch"}


def test_what_may_worsen_a_present_precursor_gives_way_at_the_same_level() -> None:
    actions = {
        "stiffen": ActionSpec("stiffen", "", ("joints",), 0.1, may_worsen=("foot-micro-slip",)),
        "yield": ActionSpec("yield", "", ("joints",), 0.1),
    }
    arbiter = Arbiter(actions, 0.1)
    slip = Precursor("foot-micro-slip", "", "ongoing", 1.0, 1.0, 1.0, 0, "d")
    proposals = [*want("stiffen"), *want("yield", strength=0.5)]
    _, held, _ = arbiter.step(ArbiterState(), situation(0, None, [slip]), proposals)
    assert [i.action for i in held] == ["yield"]
    _, held, _ = arbiter.step(ArbiterState(), situation(0), proposals)
    assert [i.action for i in held] == ["stiffen"]


def test_a_released_action_ramps_down_and_every_step_is_announced() -> None:
    bench = Bench(release_s=0.1)
    assert bench.tick(want("step-suppression")) == {"step-suppression": 1.0}
    assert [(i.action, i.strength) for i in bench.changes] == [("step-suppression", 1.0)]
    announced, held = [], []
    for _ in range(13):
        held.append(bench.tick([]).get("step-suppression", 0.0))
        announced += [i.strength for i in bench.changes if i.action == "step-suppression"]
    # linear over 0.1 s in ticks of 10 ms, from the tick that no longer proposed it
    assert held == pytest.approx([*(1.0 - k / 10 for k in range(10)), 0.0, 0.0, 0.0])
    assert announced == pytest.approx([*(1.0 - k / 10 for k in range(1, 10)), 0.0])


def test_an_action_that_is_wanted_again_during_its_release_is_announced_at_full_strength() -> None:
    bench = Bench(release_s=0.1)
    bench.tick(want("step-suppression"))
    for _ in range(5):
        bench.tick([])
    assert bench.tick(want("step-suppression"))["step-suppression"] == 1.0
    assert ("step-suppression", 1.0) in [(i.action, i.strength) for i in bench.changes]


def test_a_stop_that_would_topple_the_robot_gives_way_to_what_is_faster_than_the_fall() -> None:
    actions = {
        **ACTIONS,
        "freeze": ActionSpec("freeze", "", ("motion",), 0.1, may_worsen=("foot-micro-slip",), stops=True),
    }
    arbiter = Arbiter(actions, 0.1)
    slip = Precursor("foot-micro-slip", "", "ongoing", 1.0, 1.0, 1.0, 0, "d")

    def chosen(*wanted: str, tte: float | None = None, slipping: bool = True) -> set[str]:
        seen = [slip] if slipping else []
        _, held, _ = arbiter.step(ArbiterState(), situation(0, tte, seen), want(*wanted))
        return {i.action for i in held}

    assert chosen("freeze", "step-suppression", slipping=False) == {"freeze", "step-suppression"}
    assert chosen("freeze", "step-suppression") == {"step-suppression"}
    assert chosen("freeze", "step-suppression", tte=0.5) == {"step-suppression"}
    # the step would come down too late: better to stop than to do nothing
    assert chosen("freeze", "step-suppression", tte=0.12) == {"freeze"}
    # neither a warning nor a slower speed keeps anybody upright
    assert chosen("freeze", "announce", "speed-scale") == {"freeze", "announce", "speed-scale"}


def test_people_are_warned_while_motion_resumes() -> None:
    bench = Bench(release_s=0.1)
    bench.tick(want("minimal-risk", "balance-lock"))
    warned = [bench.tick([]).get("announce", 0.0) for _ in range(10)]
    assert warned == [1.0] * 10
    first = bench.state.active["announce"]
    assert first.reasons[0] == "motion resumes: minimal-risk is released"
    for _ in range(12):
        held = bench.tick([])
    assert held == {}
    # no warning where nothing moves again: a lock is only given up, or another action takes its resource
    bench.tick(want("balance-lock"))
    assert "announce" not in bench.tick([])
    actions = {**ACTIONS, "stand-still": ActionSpec("stand-still", "", ("motion",), 0.0)}
    bench = Bench(actions=actions)
    bench.tick(want("minimal-risk"))
    assert set(bench.tick(want("stand-still"))) == {"stand-still"}


def test_a_proposal_of_strength_zero_is_none() -> None:
    bench = Bench()
    assert bench.tick(want("step-suppression", strength=0.0)) == {}
    assert bench.changes == []


PROPOSALS = st.lists(
    st.builds(
        Proposal,
        st.sampled_from(sorted(ACTIONS)),
        st.floats(0.0, 1.0),
        st.sampled_from([CAUTION, PROTECTIVE]),
        st.sampled_from(["A1", "A2"]),
        st.just("rule"),
    ),
    max_size=6,
)


@given(st.lists(st.tuples(PROPOSALS, st.one_of(st.none(), st.floats(0.0, 1.0))), max_size=30), st.randoms())
def test_properties_of_every_history(history: list[tuple[list[Proposal], float | None]], random: object) -> None:
    bench, known = Bench(), {}
    for proposals, tte in history:
        start, before = bench.state, dict(bench.state.engaged_ns)
        held = bench.tick(proposals, tte)
        # the order of the policies, and of what each proposes, does not decide
        shuffled = list(proposals)
        random.shuffle(shuffled)  # type: ignore[attr-defined]  # hypothesis gives a random.Random
        again, _, changes = bench.arbiter.step(start, situation(bench.now, tte), shuffled)
        assert (again, list(changes)) == (bench.state, bench.changes)
        # one action per resource, whether it is wanted or on its way out
        resources = [r for a in held for r in ACTIONS[a].resources]
        assert len(resources) == len(set(resources))
        assert all(0.0 < s <= 1.0 for s in held.values())
        for action in held:
            if action not in before and tte is not None and not ACTIONS[action].mitigates:
                assert ACTIONS[action].duration_s <= tte or action in ("speed-scale", "minimal-risk")
        # the robot knows what holds from the changes alone
        for change in bench.changes:
            known[change.action] = change.strength
        assert {a: s for a, s in known.items() if s > 0.0} == held
        # what holds is never weaker than what was asked
        for action in set(held) - set(bench.state.releasing):
            asked = [p.strength for p in proposals if p.action == action and p.strength > 0.0]
            if action == "announce" and not asked:
                assert any(ACTIONS[a].resumes for a in bench.state.releasing) or bench.changes
                continue
            # a mitigation stands for those modes only in which nothing prevents the accident any more
            assert held[action] >= (min(asked) if ACTIONS[action].mitigates else max(asked))


@given(st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_the_speed_scale_never_rises_when_trust_falls(a: float, b: float) -> None:
    ladder = Ladder(LadderConfig())
    low, high = min(a, b), max(a, b)
    assert ladder.speed(low) <= ladder.speed(high)


def test_no_speed_is_granted_on_nan() -> None:
    assert Ladder(LadderConfig()).speed(float("nan")) == LadderConfig().slowest


@given(st.lists(st.floats(0.0, 1.0), min_size=2, max_size=30))
def test_within_a_run_the_commanded_speed_never_rises_while_trust_falls(trusts: list[float]) -> None:
    bench, ladder, last = Bench(), Ladder(LadderConfig()), (1.0, 0.0)
    for trust in trusts:
        scale = ladder.speed(trust)
        proposals = want("speed-scale", strength=1.0 - scale) if scale < 1.0 else []
        strength = bench.tick(proposals).get("speed-scale", 0.0)
        if trust <= last[0] and scale < 1.0:
            assert strength >= min(last[1], 1.0 - scale)
        assert 1.0 - strength <= scale + 1e-12
        last = (trust, strength)
