"""Trust as a vector: gates of every dimension, caps by class, coverage by mode, and the reset of one dimension."""

from __future__ import annotations

from typing import Any

import pytest
from foreshock_stage import COM, SLIP, TORSO, detector, play, said, stage

from foreshock.errors import BadInputError, ConfigError
from foreshock.records import ProtectionLevel, RiskEstimate
from foreshock.taxonomy import builtin_taxonomy
from foreshock.trust import GateChange, Gates, TrustModel, TrustSettings, TrustState

TAXONOMY = builtin_taxonomy()
TICK = 10_000_000


def test_gates_of_a_dimension_differ_where_it_says_so_and_nowhere_else() -> None:
    gates = Gates(modes={"A1": GateChange(protective=0.4)}, classes={"manipulation": GateChange(latch="protective")})
    modes, classes = gates.of_modes(TAXONOMY), gates.of_classes(TAXONOMY)
    assert (modes["A1"].protective, modes["A1"].caution, modes["A2"].protective) == (0.4, 0.6, 0.3)
    assert (classes["manipulation"].latch, classes["navigation"].latch) == ("protective", "minimal-risk")
    assert gates.of_overall().protective == 0.3


@pytest.mark.parametrize(
    ("make", "said_"),
    [
        (lambda: Gates(modes={"A1": GateChange(protective=0.7)}), r"gates\.modes\.A1: protective 0\.7 <= caution 0\.6"),
        (lambda: Gates(overall=GateChange(latch="never")), r"gates\.overall\.latch: 'never' is not one of"),
        (lambda: Gates(modes={"A13": GateChange()}).of_modes(TAXONOMY), r"gates\.modes\.A13: no such dimension"),
        (
            lambda: Gates(classes={"manipulatio": GateChange()}).of_classes(TAXONOMY),
            r"gates\.classes\.manipulatio: .*did you mean 'manipulation'",
        ),
    ],
)
def test_wrong_gates_are_one_error_with_their_place(make: Any, said_: str) -> None:
    with pytest.raises(ConfigError, match=said_):
        make()


def test_what_is_not_observed_caps_its_class_and_lowers_the_coverage_of_its_modes() -> None:
    model = TrustModel(TrustSettings(unobserved_cap=0.8), TAXONOMY, [SLIP, TORSO, "grip-micro-slip"])
    calm = RiskEstimate(
        0.0, 0.0, 0.0, 0.0, 0.0,
        upper_by_mode=dict.fromkeys(TAXONOMY.codes, 0.0),
        upper_by_class={c.id: 0.0 for c in TAXONOMY.classes},
    )  # fmt: skip
    _, trust, _ = model.step(TrustState(), calm, [SLIP], 0)
    assert {c for c, t in trust.control_by_class.items() if t < 1.0} == {"motion-balance"}
    assert trust.control_by_class["motion-balance"] == 0.8
    assert trust.by_class["motion-balance"] == 1.0  # conceptual trust is not touched by the loss
    # A1 is watched by slip and torso, A5 by the grip alone, A9 by nobody
    assert (trust.coverage_by_mode["A1"], trust.coverage_by_mode["A5"], trust.coverage_by_mode["A9"]) == (0.5, 1.0, 0.0)


def test_trust_acts_on_the_bound_that_is_configured() -> None:
    risk = RiskEstimate(0.2, 0.1, 0.7, 1.0, 1.0, {"A1": 0.2}, upper_by_mode={"A1": 0.7})
    for acts_on, expected in (("upper", 0.3), ("probability", 0.8)):
        _, trust, _ = TrustModel(TrustSettings(acts_on=acts_on), TAXONOMY, [SLIP]).step(TrustState(), risk, (), 0)
        assert (trust.trust, trust.by_mode["A1"]) == (pytest.approx(expected), pytest.approx(expected))


def latched() -> Any:
    """A cascade that was there for a moment, with a latch at the protective level of A1 only."""
    script = {kind: (lambda now, kind=kind: [said(kind, now <= 3 * TICK, now)]) for kind in (SLIP, TORSO, COM)}
    gates = Gates(dwell_s=0.0, modes={"A1": GateChange(latch="protective")})
    return stage(*(detector(f"d{k}", [kind], s) for k, (kind, s) in enumerate(script.items())), gates=gates)


def test_a_latch_holds_until_an_operator_resets_that_dimension() -> None:
    supervisor = latched()
    last = play(supervisor, 400, TICK)[-1]
    assert not last.precursors
    assert last.levels["A1"] is ProtectionLevel.PROTECTIVE
    assert last.levels["A2"] is ProtectionLevel.NORMAL
    record = supervisor.operator_reset("R. Ruiz", "floor dried", last.now_ns, "A2")
    assert (record.who, record.why, record.dimension) == ("R. Ruiz", "floor dried", "A2")
    later = supervisor.step([], last.now_ns + TICK)
    assert later.levels["A1"] is ProtectionLevel.PROTECTIVE  # it was another dimension
    supervisor.operator_reset("R. Ruiz", "floor dried, robot stands", later.now_ns, "A1")
    assert supervisor.step([], later.now_ns + TICK).levels["A1"] is ProtectionLevel.NORMAL
    assert [r.dimension for r in supervisor.resets] == ["A2", "A1"]


@pytest.mark.parametrize(
    ("who", "why", "dimension", "said_"),
    [("", "x", "", r"\.who: empty"), ("x", " ", "", r"\.why: empty"), ("x", "y", "A13", "no dimension of trust 'A13'")],
)
def test_a_reset_says_who_why_and_of_what(who: str, why: str, dimension: str, said_: str) -> None:
    with pytest.raises(BadInputError, match=said_):
        latched().operator_reset(who, why, 0, dimension)
