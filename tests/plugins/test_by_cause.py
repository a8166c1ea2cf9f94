"""The policy by-cause: the first sign decides, time left decides how much, and it stays within what it documents."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from foreshock.config import PolicyEntry
from foreshock.errors import ConfigError
from foreshock.policy import ACTIONS, Situation
from foreshock.records import Precursor, ProtectionLevel
from foreshock.session.ladder import check_ladder
from foreshock.taxonomy import builtin_taxonomy
from foreshock_detectors.protocols import CAUSES, MODE_ACTIONS, ByCause, ByCauseConfig

NORMAL, CAUTION, PROTECTIVE = ProtectionLevel.NORMAL, ProtectionLevel.CAUTION, ProtectionLevel.PROTECTIVE


def seen(*kinds: str) -> tuple[Precursor, ...]:
    """Precursors whose onsets follow each other in this order."""
    return tuple(Precursor(k, "", "ongoing", 0.5, 1.0, 1.0, 1_000_000 * n, "balance") for n, k in enumerate(kinds))


def asked(
    mode: str, level: ProtectionLevel, precursors: tuple[Precursor, ...] = (), left_s: float | None = None
) -> list[str]:
    times = None if left_s is None else {mode: left_s}
    situation = Situation(0, {mode: level}, {mode: 0.5}, 0.5, level, precursors, left_s, times)
    return [p.action for p in ByCause(ByCauseConfig(mode)).propose(situation)]


def test_nothing_is_done_without_reason() -> None:
    for mode in CAUSES:
        assert asked(mode, NORMAL) == []


def test_who_slips_first_is_not_stiffened_whatever_follows() -> None:
    stiff = {"balance-lock", "compliance-tuning"}
    later = ("foot-micro-slip", "torso-angular-spike", "com-lateral-deviation")
    for level in (CAUTION, PROTECTIVE):
        assert "step-suppression" in asked("A1", level, seen(*later))
        assert stiff.isdisjoint(asked("A1", level, seen(*later)))
        # the same kinds in another order have another cause
        assert not stiff.isdisjoint(asked("A1", level, seen(*reversed(later))))


def test_a_predicted_fall_is_acted_on_before_any_precursor() -> None:
    assert "balance-lock" in asked("A1", NORMAL, left_s=1.2)
    assert "impact-mitigation" in asked("A1", NORMAL, left_s=1.2), "the arbiter takes it when nothing else is in time"
    assert "impact-mitigation" not in asked("A1", PROTECTIVE, seen("foot-micro-slip"))


def test_a_robot_whose_evidence_has_gone_stands_as_long_as_the_level_does() -> None:
    assert asked("A1", CAUTION) == ["step-suppression"]


@pytest.mark.parametrize(("mode", "kind"), [("A2", "excessive-arm-velocity"), ("A3", "swing-leg-drift")])
def test_the_milder_action_needs_time_and_no_prediction_is_no_time(mode: str, kind: str) -> None:
    mild, full = asked(mode, CAUTION, seen(kind), 2.0), asked(mode, CAUTION, seen(kind), 0.4)
    assert set(mild) != set(full)
    assert asked(mode, CAUTION, seen(kind)) == full
    cause = next(c for c in CAUSES[mode].causes if kind in c.kinds)
    assert (tuple(mild), tuple(full)) == (cause.early, cause.actions)


def test_always_replaces_the_choice_and_nothing_else() -> None:
    policy = ByCause(ByCauseConfig("A1", always=("compliance-tuning",)))
    calm = Situation(0, {"A1": NORMAL}, {"A1": 1.0}, 1.0, NORMAL, (), None)
    slips = Situation(0, {"A1": CAUTION}, {"A1": 0.5}, 0.5, CAUTION, seen("foot-micro-slip"), None)
    assert list(policy.propose(calm)) == []
    assert [p.action for p in policy.propose(slips)] == ["compliance-tuning"]


@given(
    st.sampled_from(sorted(CAUSES)),
    st.sampled_from([NORMAL, CAUTION, PROTECTIVE, ProtectionLevel.MINIMAL_RISK]),
    st.permutations([k.id for k in builtin_taxonomy().kinds][:12]),
    st.one_of(st.none(), st.floats(0.0, 5.0)),
)
def test_it_is_a_pure_function_with_known_actions_that_never_acts_below_the_level(
    mode: str, level: ProtectionLevel, kinds: list[str], left_s: float | None
) -> None:
    times = None if left_s is None else {mode: left_s}
    situation = Situation(0, {mode: level}, {mode: 0.5}, 0.5, level, seen(*kinds), left_s, times)
    policy = ByCause(ByCauseConfig(mode))
    first = list(policy.propose(situation))
    assert first == list(policy.propose(situation)) == list(ByCause(ByCauseConfig(mode)).propose(situation))
    known = {*ACTIONS, *(a.id for a in MODE_ACTIONS)}
    assert all(p.action in known and p.level >= max(level, CAUTION) and p.mode == mode for p in first)
    assert bool(first) == (level >= CAUTION or (left_s is not None and bool(CAUSES[mode].predicted)))


def test_every_cause_is_a_precursor_of_its_mode() -> None:
    taxonomy = builtin_taxonomy()
    for mode, causes in CAUSES.items():
        kinds = [kind for cause in causes.causes for kind in cause.kinds]
        assert len(kinds) == len(set(kinds))
        assert set(kinds) <= taxonomy.kinds_of(mode)
        assert {taxonomy.kind(k).id for k in taxonomy.mode(mode).cascade} <= set(kinds)


def test_worse_evidence_never_lowers_the_level_under_it() -> None:
    _, broken = check_ladder("A1", [PolicyEntry("by-cause", {"mode": "A1"})])
    assert broken == []


@pytest.mark.parametrize(
    ("settings", "says"),
    [({"mode": "A7"}, "by-cause knows no causes of A7"), ({"always": ("step-supression",)}, "did you mean 'step-sup")],
)
def test_what_it_does_not_know_is_refused(settings: dict[str, object], says: str) -> None:
    with pytest.raises(ConfigError, match=says):
        ByCauseConfig(**settings)  # type: ignore[arg-type]  # wrong on purpose
