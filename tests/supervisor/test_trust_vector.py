"""Trust as a vector: gates, caps, coverage and latches of each accident mode, each precursor class, and overall."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import pytest
from foreshock_stage import COM, MS, SLIP, TORSO, detector, fresh, play, said, stage
from hypothesis import given
from hypothesis import strategies as st

from foreshock.errors import BadInputError, ConfigError
from foreshock.policy import Situation
from foreshock.records import Decision, ProtectionLevel, RiskEstimate, Trust
from foreshock.supervisor import Supervisor
from foreshock.taxonomy import builtin_taxonomy
from foreshock.trust import GateChange, Gates, TrustModel, TrustSettings, TrustState

TAXONOMY = builtin_taxonomy()
CODES = TAXONOMY.codes
CLASSES = tuple(c.id for c in TAXONOMY.classes)
NORMAL, CAUTION, PROTECTIVE, MINIMAL = ProtectionLevel
TICK = 10 * MS
FALLS = ("A1", "A2", "A11")
"""Table 2: the modes that Motion/Balance, the class of all three kinds of the stage, dominates."""


def risk(modes: Mapping[str, float] | None = None, classes: Mapping[str, float] | None = None) -> RiskEstimate:
    by_mode = {**dict.fromkeys(CODES, 0.0), **(modes or {})}
    by_class = {**dict.fromkeys(CLASSES, 0.0), **(classes or {})}
    p = max([*by_mode.values(), *by_class.values()])
    return RiskEstimate(p, p, p, 1.0, 1.0, by_mode, by_class, upper_by_mode=by_mode, upper_by_class=by_class)


def trusted(
    kinds: Sequence[str], unobserved: Sequence[str] = (), estimate: RiskEstimate | None = None, cap: float = 0.8
) -> Trust:
    model = TrustModel(TrustSettings(unobserved_cap=cap), TAXONOMY, kinds)
    return model.step(TrustState(), estimate or risk(), unobserved, 0)[1]


# ---- gates per dimension


def test_a_change_holds_for_its_dimension_and_leaves_what_it_does_not_name() -> None:
    gates = Gates(
        caution=0.7,
        hysteresis=0.05,
        overall=GateChange(dwell_s=2.0),
        modes={"A1": GateChange(protective=0.5), "A4": GateChange(latch="protective")},
        classes={"perceptual": GateChange(caution=0.9, hysteresis=0.0)},
    )

    def figures(g: Gates) -> tuple[float, float, float, float, str]:
        return g.caution, g.protective, g.hysteresis, g.dwell_s, g.latch

    common = (0.7, 0.3, 0.05, 1.0, "minimal-risk")
    assert figures(gates.of_overall()) == (0.7, 0.3, 0.05, 2.0, "minimal-risk")
    modes = {code: figures(g) for code, g in gates.of_modes(TAXONOMY).items()}
    assert modes == {
        **dict.fromkeys(CODES, common),
        "A1": (0.7, 0.5, 0.05, 1.0, "minimal-risk"),
        "A4": (0.7, 0.3, 0.05, 1.0, "protective"),
    }
    classes = {class_: figures(g) for class_, g in gates.of_classes(TAXONOMY).items()}
    assert classes == {**dict.fromkeys(CLASSES, common), "perceptual": (0.9, 0.3, 0.0, 1.0, "minimal-risk")}


def test_without_changes_every_dimension_has_the_common_gates() -> None:
    gates = Gates()
    found = [gates.of_overall(), *gates.of_modes(TAXONOMY).values(), *gates.of_classes(TAXONOMY).values()]
    assert len(found) == 1 + 12 + 6
    assert {(g.caution, g.protective, g.hysteresis, g.dwell_s, g.latch) for g in found} == {
        (0.6, 0.3, 0.1, 1.0, "minimal-risk")
    }


@pytest.mark.parametrize(
    ("fields", "parts"),
    [
        ({"modes": {"A13": GateChange()}}, ["gates.modes", "A13", "did you mean", "A1"]),
        ({"modes": {"a1": GateChange(caution=0.9)}}, ["gates.modes", "a1"]),
        ({"classes": {"perceptal": GateChange()}}, ["gates.classes", "perceptal", "did you mean 'perceptual'"]),
        ({"classes": {"A1": GateChange()}}, ["gates.classes", "A1"]),
    ],
)
def test_a_change_for_what_does_not_exist_is_refused(fields: dict[str, Any], parts: list[str]) -> None:
    gates = Gates(**fields)
    dimension = gates.of_modes if gates.modes else gates.of_classes
    with pytest.raises(ConfigError) as refused:
        dimension(TAXONOMY)
    assert all(part in str(refused.value) for part in parts)
    # and by the supervisor before it runs
    with pytest.raises(ConfigError) as refused:
        stage(detector("d", [SLIP], lambda now: [said(SLIP, False, now)]), gates=gates)
    assert all(part in str(refused.value) for part in parts)


BAD_CHANGES = [
    GateChange(protective=0.7),  # above the common caution of 0.6
    GateChange(caution=0.2),  # below the common protective gate of 0.3
    GateChange(caution=math.nan),
    GateChange(protective=-0.1),
    GateChange(hysteresis=-0.1),
    GateChange(dwell_s=math.nan),
    GateChange(latch="protectiv"),
]


@pytest.mark.parametrize("change", BAD_CHANGES)
@pytest.mark.parametrize("dimension", ["gates.overall", "gates.modes.A4", "gates.classes.navigation"])
def test_a_change_that_gives_gates_that_cannot_close_is_refused_with_its_place(
    dimension: str, change: GateChange
) -> None:
    fields: dict[str, Any] = {
        "gates.overall": {"overall": change},
        "gates.modes.A4": {"modes": {"A4": change}},
        "gates.classes.navigation": {"classes": {"navigation": change}},
    }[dimension]
    with pytest.raises(ConfigError) as refused:
        stage(detector("d", [SLIP], lambda now: [said(SLIP, False, now)]), gates=Gates(**fields))
    assert all(part in str(refused.value) for part in dimension.split("."))


# ---- caps and coverage by dimension

GRIP, OCCLUSION, LATENCY = "grip-micro-slip", "visual-occlusion", "control-latency-spike"
CLASS_OF = {SLIP: "motion-balance", GRIP: "manipulation", OCCLUSION: "perceptual", LATENCY: "system-telemetry"}
"""Section 3.2.2: a kind of each of four classes."""
MODES_OF = {
    SLIP: ("A1", "A2", "A11"),
    GRIP: ("A4", "A5", "A10", "A11"),
    OCCLUSION: ("A6", "A8"),
    LATENCY: ("A9", "A12"),
}
"""Table 2 (and Table 3, which adds none to these)."""


@given(st.sets(st.sampled_from(sorted(CLASS_OF))), st.sampled_from([0.0, 0.5, 0.8]))
def test_the_cap_holds_for_the_classes_and_modes_of_unobserved_kinds_only(lost: set[str], cap: float) -> None:
    t = trusted(list(CLASS_OF), sorted(lost), cap=cap)
    classes, modes = {CLASS_OF[k] for k in lost}, {m for k in lost for m in MODES_OF[k]}
    assert t.control_by_class == {c: cap if c in classes else 1.0 for c in CLASSES}
    assert t.control_by_mode == {m: cap if m in modes else 1.0 for m in CODES}
    assert t.control_trust == (cap if lost else 1.0)
    assert set(t.by_class.values()) == set(t.by_mode.values()) == {1.0}


def test_the_cap_raises_no_trust() -> None:
    t = trusted([SLIP, GRIP], [SLIP], risk(classes={"motion-balance": 0.9, "manipulation": 0.5}))
    assert t.control_by_class["motion-balance"] == pytest.approx(0.1)
    assert t.control_by_class["manipulation"] == t.by_class["manipulation"] == pytest.approx(0.5)
    assert t.control_by_class["perceptual"] == 1.0


@pytest.mark.parametrize("p", [math.nan, -0.1, 1.1, math.inf])
def test_what_is_not_a_probability_closes_its_own_dimension_only(p: float) -> None:
    sound = risk()
    t = trusted(
        [SLIP, GRIP],
        (),
        RiskEstimate(
            0.0, 0.0, 0.0, 1.0, 1.0, sound.by_mode, sound.by_class,
            upper_by_mode={**sound.by_mode, "A1": p}, upper_by_class={**sound.by_class, "perceptual": p},
        ),
    )  # fmt: skip
    assert t.control_by_mode == {**dict.fromkeys(CODES, 1.0), "A1": 0.0}
    assert t.control_by_class == {**dict.fromkeys(CLASSES, 1.0), "perceptual": 0.0}


def test_control_trust_of_a_class_recovers_on_its_own() -> None:
    model, state = TrustModel(TrustSettings(recovery_s=0.5), TAXONOMY, [SLIP, GRIP]), TrustState()
    state, _, _ = model.step(state, risk(classes={"motion-balance": 0.8}), (), 0)
    for k in range(1, 20):
        state, t, _ = model.step(state, risk(), (), k * TICK)
        # first-order lag from 0.2 to 1, whatever the tick period
        assert t.control_by_class["motion-balance"] == pytest.approx(1.0 - 0.8 * math.exp(-0.01 * k / 0.5), abs=1e-12)
        assert t.by_class["motion-balance"] == t.control_by_class["manipulation"] == 1.0


@given(st.sets(st.sampled_from(sorted(CLASS_OF)), min_size=1), st.sets(st.sampled_from(sorted(CLASS_OF))))
def test_coverage_by_mode_is_the_observed_share_of_the_mode_s_configured_kinds(
    configured: set[str], gone: set[str]
) -> None:
    lost = configured & gone
    t = trusted(sorted(configured), sorted(lost))
    assert t.coverage == pytest.approx(1.0 - len(lost) / len(configured))
    assert set(t.coverage_by_mode) == set(CODES)
    for code in CODES:
        mine = {k for k in configured if code in MODES_OF[k]}
        # no configured detector watches the mode: nothing is covered, which is not the same as all is well
        expected = len(mine - lost) / len(mine) if mine else 0.0
        assert t.coverage_by_mode[code] == pytest.approx(expected)


# ---- levels per dimension, staged


def staged(gates: Gates, *, until: int = 20, policy: Callable[[Situation], Any] | None = None) -> Supervisor:
    """Slip, torso spike and CoM deviation are present until this tick: P = 0.8093 by Table 4, T < 0.3."""

    def script(now: int) -> Any:
        return [said(k, now <= until * TICK, now) for k in (SLIP, TORSO, COM)]

    recovery = TrustSettings(recovery_s=0.01)
    return stage(detector("d", [SLIP, TORSO, COM], script), policy=policy, gates=gates, trust=recovery, release_s=0.0)


def held(decision: Decision) -> dict[str, ProtectionLevel]:
    """Every dimension that is not normal."""
    found = {**decision.levels, **decision.class_levels}
    return {name: level for name, level in found.items() if level is not NORMAL}


def after(supervisor: Supervisor, decision: Decision, ticks: int = 1) -> Decision:
    first = decision.now_ns // TICK + 1
    return play(supervisor, first + ticks - 1, TICK, first=first)[-1]


def test_every_dimension_follows_its_own_gate() -> None:
    """T = 0.19 in A1, A2, A11 and Motion/Balance; a gate below that stays open, one above a full trust never is."""
    gates = Gates(
        modes={"A1": GateChange(protective=0.0), "A2": GateChange(caution=0.1, protective=0.1)},
        overall=GateChange(caution=0.15, protective=0.05),
        classes={"motion-balance": GateChange(protective=0.2), "navigation": GateChange(caution=1.0)},
    )
    d = play(staged(gates), 10, TICK)[-1]
    assert d.trust.by_mode["A1"] == pytest.approx(1.0 - 0.8093, abs=1e-4)
    assert held(d) == {"A1": CAUTION, "A11": PROTECTIVE, "motion-balance": PROTECTIVE}


LATCHED = Gates(dwell_s=0.1, modes={"A1": GateChange(latch="protective"), "A11": GateChange(latch="protective")})
END = 220
"""Ticks: 0.2 s of evidence, 1.5 s of window, and enough for the dwell."""


def test_a_latch_on_one_mode_holds_until_that_mode_is_reset() -> None:
    supervisor = staged(LATCHED)
    ticks = play(supervisor, END, TICK)
    everywhere = dict.fromkeys([*FALLS, "motion-balance"], PROTECTIVE)
    assert held(ticks[9]) == everywhere
    last = ticks[-1]
    assert last.precursors == ()
    assert last.trust.by_mode["A1"] == 1.0
    assert held(last) == {"A1": PROTECTIVE, "A11": PROTECTIVE}
    assert last.level is PROTECTIVE  # over all modes

    for dimension in ("A2", "overall", "motion-balance", "manipulation"):
        record = supervisor.operator_reset("operator 7", "another dimension", last.now_ns, dimension)
        assert record.dimension == dimension
        last = after(supervisor, last)
        assert held(last) == {"A1": PROTECTIVE, "A11": PROTECTIVE}

    record = supervisor.operator_reset("operator 7", "looked at the robot", last.now_ns, "A1")
    assert (record.stamp_ns, record.who, record.why, record.dimension) == (
        last.now_ns,
        "operator 7",
        "looked at the robot",
        "A1",
    )
    assert supervisor.resets[-1] == record
    assert [r.dimension for r in supervisor.resets] == ["A2", "overall", "motion-balance", "manipulation", "A1"]
    last = after(supervisor, last)
    assert held(last) == {"A11": PROTECTIVE}
    assert held(after(supervisor, last, 50)) == {"A11": PROTECTIVE}


def test_a_reset_of_all_releases_every_latch() -> None:
    supervisor = staged(LATCHED)
    last = play(supervisor, END, TICK)[-1]
    supervisor.operator_reset("operator 7", "looked at the robot", last.now_ns)
    last = after(supervisor, last)
    assert held(last) == {}
    assert last.level is NORMAL
    assert [r.dimension for r in supervisor.resets] == [""]


def test_a_latch_on_a_class_and_one_overall_are_released_by_their_own_names() -> None:
    gates = Gates(
        dwell_s=0.1, classes={"motion-balance": GateChange(latch="protective")}, overall=GateChange(latch="protective")
    )
    seen: list[Situation] = []
    supervisor = staged(gates, policy=lambda situation: seen.append(situation) or ())
    last = play(supervisor, END, TICK)[-1]
    steps: list[tuple[str, dict[str, ProtectionLevel], ProtectionLevel]] = [
        ("A1", {"motion-balance": PROTECTIVE}, PROTECTIVE),
        ("motion-balance", {}, PROTECTIVE),
        ("A1", {}, PROTECTIVE),
        ("overall", {}, NORMAL),
    ]
    assert (held(last), seen[-1].overall_level) == ({"motion-balance": PROTECTIVE}, PROTECTIVE)
    for dimension, levels, overall in steps:
        supervisor.operator_reset("operator 7", "looked", last.now_ns, dimension)
        last = after(supervisor, last)
        assert (held(last), seen[-1].overall_level) == (levels, overall)


def test_a_reset_does_not_release_what_still_demands_protection() -> None:
    supervisor = staged(LATCHED, until=END)
    last = play(supervisor, 30, TICK)[-1]
    before = held(last)
    supervisor.operator_reset("operator 7", "too early", last.now_ns, "A1")
    assert held(after(supervisor, last)) == before


@pytest.mark.parametrize(("who", "why"), [("", "looked"), ("operator 7", ""), ("", ""), (" ", "looked"), ("x", "\t\n")])
def test_a_reset_needs_someone_and_a_reason(who: str, why: str) -> None:
    supervisor = staged(LATCHED)
    last = play(supervisor, END, TICK)[-1]
    with pytest.raises(BadInputError):
        supervisor.operator_reset(who, why, last.now_ns, "A1")
    assert supervisor.resets == []
    assert held(after(supervisor, last)) == {"A1": PROTECTIVE, "A11": PROTECTIVE}


@pytest.mark.parametrize(
    ("dimension", "parts"),
    [
        ("A13", ["A13"]),
        ("a1", ["a1"]),
        ("motion-balanc", ["'motion-balance'"]),
        ("overal", ["'overall'"]),
        (SLIP, [SLIP]),
    ],
)
def test_a_reset_of_what_is_no_dimension_is_refused_with_the_nearest(dimension: str, parts: list[str]) -> None:
    supervisor = staged(LATCHED)
    last = play(supervisor, END, TICK)[-1]
    with pytest.raises(BadInputError) as refused:
        supervisor.operator_reset("operator 7", "looked", last.now_ns, dimension)
    assert all(part in str(refused.value) for part in [dimension, *parts])
    assert supervisor.resets == []
    assert held(after(supervisor, last)) == {"A1": PROTECTIVE, "A11": PROTECTIVE}


def test_minimal_risk_is_released_with_overall_trust() -> None:
    """A lost detector brings it; observed again, it stays latched until the operator's reset of overall."""
    supervisor = stage(detector("d", [SLIP], lambda now: [said(SLIP, False, now)]), gates=Gates(dwell_s=0.0))
    lost = play(supervisor, 60, TICK, samples=lambda k, now: [fresh(now)] if k < 5 else [])
    assert lost[-1].level is MINIMAL
    last = after(supervisor, lost[-1], 100)
    assert last.trust.unobserved == ()
    assert last.level is MINIMAL
    assert not last.motion_permitted
    supervisor.operator_reset("operator 7", "looked", last.now_ns, "A1")
    last = after(supervisor, last)
    assert last.level is MINIMAL
    supervisor.operator_reset("operator 7", "looked", last.now_ns, "overall")
    last = after(supervisor, last)
    assert last.level is NORMAL
    assert last.motion_permitted
