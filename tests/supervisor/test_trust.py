"""Rule 2 on trust and levels: falls at once, recovers slowly, never a lower level for a lower trust."""

from __future__ import annotations

import itertools
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from foreshock.errors import ConfigError
from foreshock.records import ProtectionLevel, RiskEstimate
from foreshock.taxonomy import builtin_taxonomy
from foreshock.trust import Gates, LevelState, TrustModel, TrustSettings, TrustState, level_step

MS = 1_000_000
NORMAL, CAUTION, PROTECTIVE, MINIMAL = ProtectionLevel


def risk(p: float, upper: float | None = None, by_mode: dict[str, float] | None = None) -> RiskEstimate:
    modes = {"A1": p} if by_mode is None else by_mode
    return RiskEstimate(p, p, p if upper is None else upper, 1.0, 1.0, modes, upper_by_mode=modes)


def model(settings: TrustSettings | None = None) -> TrustModel:
    return TrustModel(settings or TrustSettings(), builtin_taxonomy(), ["foot-micro-slip", "torque-saturation"])


def test_trust_is_one_minus_the_upper_risk_and_falls_at_once() -> None:
    _, t, _ = model().step(TrustState(), risk(0.4546, 0.6), (), 0)
    assert t.trust == pytest.approx(0.4)  # Eq. 2 on the upper bound
    assert t.control_trust == t.trust
    assert t.by_mode == {"A1": pytest.approx(0.5454)}


def test_control_trust_recovers_with_its_time_constant() -> None:
    m = model(TrustSettings(recovery_s=0.5))
    state, _, _ = m.step(TrustState(), risk(0.8), (), 0)
    trust = 0.2
    for k in range(1, 51):
        state, t, _ = m.step(state, risk(0.0), (), k * 10 * MS)
        assert trust < t.control_trust < 1.0
        trust = t.control_trust
        # first-order lag from 0.2 to 1: whatever the tick period, it is on the exponential
        assert trust == pytest.approx(1.0 - 0.8 * math.exp(-0.01 * k / 0.5), abs=1e-12)
        assert t.trust == 1.0


@given(
    st.lists(
        st.tuples(
            st.integers(1, 500), st.one_of(st.floats(0.0, 1.0), st.just(math.nan)), st.floats(0.0, 1.0), st.booleans()
        ),
        min_size=1,
        max_size=30,
    )
)
def test_control_trust_is_never_above_trust_and_falls_with_p(history: list[tuple[int, float, float, bool]]) -> None:
    """Pointwise higher P, or less observed, never gives a higher control-level trust."""
    m, low, high, now = model(), TrustState(), TrustState(), 0
    for gap, p, more, lost in history:
        now += gap * MS
        worse = p if math.isnan(p) else min(1.0, p + more)
        low, t_low, _ = m.step(low, risk(p if not math.isnan(p) else 1.0), (), now)
        high, t_high, _ = m.step(high, risk(worse), ("foot-micro-slip",) if lost else (), now)
        assert t_low.control_trust <= t_low.trust
        assert t_high.control_trust <= t_low.control_trust
        assert t_high.control_by_mode["A1"] <= t_low.control_by_mode["A1"]


@pytest.mark.parametrize("p", [math.nan, -0.1, 1.1, math.inf])
def test_no_trust_in_what_is_not_a_probability(p: float) -> None:
    _, t, _ = model().step(TrustState(), risk(p), (), 0)
    assert (t.trust, t.control_trust, t.control_by_mode["A1"]) == (0.0, 0.0, 0.0)


def test_the_cap_holds_for_the_modes_of_the_unobserved_kind_and_overall() -> None:
    taxonomy = builtin_taxonomy()
    by_mode = dict.fromkeys(taxonomy.codes, 0.0)
    _, t, _ = model(TrustSettings(unobserved_cap=0.8)).step(
        TrustState(), risk(0.0, by_mode=by_mode), ("foot-micro-slip",), 0
    )
    assert t.control_trust == 0.8
    for code in taxonomy.codes:
        # Table 2: the class Motion/Balance dominates A1, A2 and A11
        assert t.control_by_mode[code] == (0.8 if code in ("A1", "A2", "A11") else 1.0)
    assert (t.coverage, t.unobserved) == (0.5, ("foot-micro-slip",))


def test_overdue_comes_after_the_grace_time_and_starts_anew_when_observed() -> None:
    m, state = model(TrustSettings(grace_s=0.3)), TrustState()
    seen = []
    for k in range(60):
        lost = ("foot-micro-slip",) if k != 20 else ()
        state, _, overdue = m.step(state, risk(0.0), lost, k * 20 * MS)
        seen.append(overdue)
    assert seen.index(True) == 16  # 0.32 s
    assert seen[20:22] == [False, False]
    assert seen.index(True, 21) == 21 + 16


@pytest.mark.parametrize(
    ("fields", "place"),
    [
        ({"grace_s": math.nan}, "trust.grace_s"),
        ({"grace_s": math.inf}, "trust.grace_s"),
        ({"grace_s": -1.0}, "trust.grace_s"),
        ({"unobserved_cap": math.nan}, "trust.unobserved_cap"),
        ({"unobserved_cap": 1.5}, "trust.unobserved_cap"),
        ({"recovery_s": 0.0}, "trust.recovery_s"),
        ({"recovery_s": -0.5}, "trust.recovery_s"),
        ({"recovery_s": math.nan}, "trust.recovery_s"),
    ],
)
def test_settings_that_would_switch_fail_closed_off_are_refused(fields: dict[str, float], place: str) -> None:
    with pytest.raises(ConfigError, match=place):
        TrustSettings(**fields)


@pytest.mark.parametrize(
    ("fields", "place"),
    [
        ({"protective": 0.7}, "gates: protective"),
        ({"caution": math.nan}, "gates: protective"),
        ({"protective": -0.1}, "gates: protective"),
        ({"hysteresis": -0.1}, "gates.hysteresis"),
        ({"hysteresis": math.nan}, "gates.hysteresis"),
        ({"dwell_s": math.nan}, "gates.dwell_s"),
        ({"dwell_s": -1.0}, "gates.dwell_s"),
        ({"latch": "minimal-rsk"}, "gates.latch: 'minimal-rsk' .* did you mean 'minimal-risk'"),
    ],
)
def test_gates_that_cannot_close_are_refused(fields: dict[str, object], place: str) -> None:
    with pytest.raises(ConfigError, match=place):
        Gates(**fields)


# ---- levels

TRUSTS = st.one_of(st.floats(0.0, 1.0), st.sampled_from([0.3, 0.4, 0.6, 0.7, math.nan]))
OPEN_LOOP = st.lists(
    st.tuples(st.integers(0, 800), TRUSTS, st.floats(0.0, 1.0), st.booleans(), st.booleans()), min_size=1, max_size=40
)
GATES = st.builds(
    Gates,
    caution=st.sampled_from([0.6, 0.9]),
    protective=st.sampled_from([0.3, 0.6]),
    hysteresis=st.sampled_from([0.0, 0.1, 0.5]),
    dwell_s=st.sampled_from([0.0, 0.25, 1.0]),
    latch=st.sampled_from(["none", "protective", "minimal-risk"]),
)


def lower(trust: float, by: float) -> float:
    """A trust that is no higher; NaN is the lowest of all, since it closes every gate."""
    return trust if math.isnan(trust) else math.nan if by > 0.9 else max(0.0, trust - by)


@given(OPEN_LOOP, GATES)
def test_pointwise_lower_trust_never_gives_a_lower_level(
    history: list[tuple[int, float, float, bool, bool]], gates: Gates
) -> None:
    more, less, now = LevelState(), LevelState(), 0
    for gap, trust, by, overdue, also_overdue in history:
        now += gap * MS
        more = level_step(more, gates, trust, overdue and also_overdue, now)
        less = level_step(less, gates, lower(trust, by), overdue, now)
        assert less.level >= more.level


def reference_levels(history: list[tuple[int, float, bool]], gates: Gates) -> list[ProtectionLevel]:
    """From the specification: each level on its own, in at once, out after hysteresis and dwell unless latched."""
    latched_from = {"none": 4, "protective": 2, "minimal-risk": 3}[gates.latch]
    now, level, out = 0, 0, []
    last: dict[int, int | None] = {1: None, 2: None, 3: None}
    for gap, trust, overdue in history:
        now += gap
        following = 0
        for candidate, gate in ((1, gates.caution), (2, gates.protective), (3, None)):
            held = level >= candidate
            if gate is None:
                demanded = overdue
            else:
                edge = min(1.0, gate + gates.hysteresis) if held else gate
                demanded = math.isnan(trust) or trust < edge
            if demanded:
                last[candidate] = now
            since = last[candidate]
            dwelling = held and since is not None and (now - since) < gates.dwell_s * 1e9
            if demanded or dwelling or (held and candidate >= latched_from):
                following = candidate
        level = following
        out.append(ProtectionLevel(level))
    return out


@given(OPEN_LOOP, GATES)
def test_levels_follow_the_specification(history: list[tuple[int, float, float, bool, bool]], gates: Gates) -> None:
    plain = [(gap * MS, trust, overdue) for gap, trust, _, overdue, _ in history]
    state, now, seen = LevelState(), 0, []
    for gap, trust, overdue in plain:
        now += gap
        state = level_step(state, gates, trust, overdue, now)
        seen.append(state.level)
    assert seen == reference_levels(plain, gates)


def levels(trusts: list[float], gates: Gates, period_ms: int = 100) -> list[ProtectionLevel]:
    state, out = LevelState(), []
    for k, t in enumerate(trusts):
        state = level_step(state, gates, t, False, k * period_ms * MS)
        out.append(state.level)
    return out


def test_escalation_is_immediate_over_several_levels() -> None:
    assert levels([1.0, 0.0], Gates()) == [NORMAL, PROTECTIVE]


def test_the_gate_itself_is_open_and_nan_closes_it() -> None:
    gates = Gates()
    assert levels([0.6], gates) == [NORMAL]
    assert levels([math.nextafter(0.6, 0.0)], gates) == [CAUTION]
    assert levels([math.nan], gates) == [PROTECTIVE]


def test_release_waits_for_hysteresis() -> None:
    gates = Gates(hysteresis=0.1, dwell_s=0.0)
    assert levels([0.2, 0.35, 0.39, 0.4, 0.65, 0.7], gates) == [
        PROTECTIVE,
        PROTECTIVE,
        PROTECTIVE,
        CAUTION,
        CAUTION,
        NORMAL,
    ]


def test_dwell_runs_from_the_last_tick_that_demanded_the_level() -> None:
    gates = Gates(dwell_s=0.5)
    seen = levels([0.2, 1.0, 1.0, 0.2, *[1.0] * 7], gates)
    # last demanded at 0.3 s: held through 0.7 s, given up at 0.8 s
    assert seen == [PROTECTIVE] * 8 + [NORMAL] * 3


@pytest.mark.parametrize(("latch", "held"), [("none", NORMAL), ("minimal-risk", NORMAL), ("protective", PROTECTIVE)])
def test_a_latched_level_holds(latch: str, held: ProtectionLevel) -> None:
    assert levels([0.1, *[1.0] * 100], Gates(latch=latch))[-1] is held


def test_minimal_risk_is_latched_by_default() -> None:
    state = level_step(LevelState(), Gates(), 1.0, True, 0)
    for k in range(1, 100):
        state = level_step(state, Gates(), 1.0, False, k * 1000 * MS)
        assert state.level is MINIMAL


def test_levels_are_totally_ordered() -> None:
    assert all(a < b for a, b in itertools.pairwise(ProtectionLevel))
