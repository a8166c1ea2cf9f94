"""What the study answers, against Table 4, hand calculations and the whole taxonomy; and the paper's claims."""

from __future__ import annotations

import math
from pathlib import Path

import msgspec
import pytest

from foreshock.evidence import Window
from foreshock.risk import CorrelatedRisk, Link, Pair, RiskParameters, load_parameters
from foreshock.sensitivity import Perturbed, Study, one_at_a_time, trajectory
from foreshock.taxonomy import builtin_taxonomy

TAXONOMY = builtin_taxonomy()
TABLE_3 = load_parameters("table-3", Path(), TAXONOMY)
A1 = TAXONOMY.mode("A1").cascade


def study(model: str, parameters: RiskParameters = TABLE_3, mode: str = "A1") -> Study:
    kinds = [TAXONOMY.kind(k).id for k in TAXONOMY.mode(mode).cascade]
    return Study(parameters, model, kinds, TAXONOMY)  # type: ignore[arg-type]


INDEPENDENT, CORRELATED = study("independent"), study("correlated")


def le(m: float, q: float) -> float:
    return (1.0 - math.exp(-1.2 * q)) / (1.0 + math.exp(-1.6 * (m - 2.0)))


def test_at_the_paper_s_values_the_cascade_is_table_4() -> None:
    found = INDEPENDENT.answers({})
    assert [found[n] for n in ("p-first", "p-second", "p-third")] == pytest.approx([0.1174, 0.4546, 0.8093], abs=1e-4)
    # the third precursor opens the gate; it closes as the slip, gone at 0.5 s, leaves the window of 1.5 s: the CoM is
    # back since 1.62 s
    assert (found["gate"], found["opens"]) == (1.12, 1.0)
    assert found["recovery"] == pytest.approx(0.5 + 1.5 - 1.62, abs=1e-9)


def test_every_mode_gives_the_same_by_eq_1() -> None:
    expected = INDEPENDENT.answers({})
    for code in TAXONOMY.codes:
        assert study("independent", mode=code).answers({}) == expected


def test_with_the_lift_two_precursors_open_the_gate() -> None:
    found = CORRELATED.answers({})
    # J = kappa = 1: the second precursor of the chain counts for two, the third as well
    assert found["p-second"] == pytest.approx(le(3.0, 2.0), abs=1e-12)
    assert found["p-third"] == pytest.approx(le(5.0, 3.0), abs=1e-12)
    assert found["gate"] == 0.48
    assert CORRELATED.answers({"kappa": 0.0})["gate"] == 1.12


def test_correlation_lowers_p_and_not_the_bound() -> None:
    found = CORRELATED.answers({"r": 0.5, "kappa": 0.0})
    # equal correlation r of n kinds: mu = n / (1 + (n - 1) r), for m and for q
    assert found["p-second"] == pytest.approx(le(2.0 / 1.5, 2.0 / 1.5), abs=1e-9)
    assert found["p-third"] == pytest.approx(le(3.0 / 2.0, 3.0 / 2.0), abs=1e-9)
    assert found["gate"] == 1.12  # the bound is Eq. 1 on the plain counts
    assert found["gate-on-p"] == pytest.approx(1.62)  # censored: three that count for 1.5 do not open it


def test_presence_and_severity_matter_together() -> None:
    weak = CORRELATED.answers({"presence": 0.6, "severity": 0.5, "kappa": 0.0})
    assert weak["p-third"] == pytest.approx(le(3.0 * 0.8, 3.0), abs=1e-12)
    assert CORRELATED.answers({"severity": 0.1}) == CORRELATED.answers({})  # presence is 1


def test_a_short_window_forgets_the_first_precursor() -> None:
    found = INDEPENDENT.answers({"window": 0.5})
    assert found["p-third"] == pytest.approx(le(2.0, 2.0), abs=1e-12)
    # never below the gate: censored at the end of the last condition
    assert (found["opens"], found["gate"], found["recovery"]) == (0.0, pytest.approx(1.62), 0.0)


def test_recurrence_counts_one_more_per_period() -> None:
    found = INDEPENDENT.answers({"recurrence": 0.5})
    # 3 s present, counted each 0.75 s, of which the window of 1.5 s holds two
    assert found["p-isolated"] == pytest.approx(le(1.0, 2.0), abs=1e-12)
    assert INDEPENDENT.answers({})["p-isolated"] == pytest.approx(le(1.0, 1.0), abs=1e-12)


def test_nominal_values_are_the_parameter_set_itself_over_the_whole_taxonomy() -> None:
    slip, torso, com = A1
    fitted = msgspec.structs.replace(
        TABLE_3,
        a=1.1,
        b=2.5,
        c=0.9,
        kappa=0.7,
        presence=0.4,
        window_s=1.2,
        correlation=(Pair((torso, com), 0.6, 0.4, 0.8), Pair(("grip-oscillation", com), 0.3, 0.1, 0.4)),
        cascade=(Link(slip, com, 0.8, 0.2, 1.5), *TABLE_3.cascade),
    )
    mine, whole = study("correlated", fitted), CorrelatedRisk(fitted, TAXONOMY)
    narrowed = mine.risk(mine.nominal)
    for timeline in mine.timelines:
        for moment in trajectory(timeline, Window(1.2)):
            a, b = narrowed.estimate(moment.precursors), whole.estimate(moment.precursors)
            assert (a.lower, a.probability, a.upper) == pytest.approx((b.lower, b.probability, b.upper), abs=1e-12)


# Eq. 1 at m = q = 1, 2, 3 to four places, worked out by awk: a table that tests/supervisor/test_risk.py has too.
PERTURBED = {
    ("", 0.0): (0.1174, 0.4546, 0.8093),
    ("a", 1.28): (0.1520, 0.4546, 0.7611),
    ("a", 1.92): (0.0894, 0.4546, 0.8483),
    ("b", 1.0): (0.3494, 0.7565, 0.9346),
    ("b", 3.0): (0.0274, 0.1527, 0.4863),
    ("c", 0.96): (0.1037, 0.4267, 0.7853),
    ("c", 1.44): (0.1282, 0.4719, 0.8210),
}


def by_step(found: list[Perturbed]) -> dict[tuple[str, float], Perturbed]:
    return {(p.factor, p.value): p for p in found}


def test_the_paper_s_perturbation_one_at_a_time() -> None:
    found = by_step(one_at_a_time(INDEPENDENT))
    for step, wanted in PERTURBED.items():
        answers = found[step].answers
        assert [answers[n] for n in ("p-first", "p-second", "p-third")] == pytest.approx(wanted, abs=5e-5)
    assert len(found) == 1 + 2 * 6
    assert {s for s, p in found.items() if not p.claims.low} == {("b", 1.0)}  # 0.35 by Eq. 1
    assert all(p.claims.sharp for p in found.values())
    assert {s for s, p in found.items() if not p.claims.opens} == {("b", 3.0)}  # 0.49 by Eq. 1
    assert all(p.claims.recovers for p in found.values())


def test_claims_can_fail() -> None:
    """b = -1: one precursor alone is certain; b = 8: nothing ever escalates enough."""
    lost = study("independent", msgspec.structs.replace(TABLE_3, b=-1.0))
    base = one_at_a_time(lost)[0].claims
    assert (base.low, base.sharp) == (False, False)
    flat = study("independent", msgspec.structs.replace(TABLE_3, b=8.0))
    assert not one_at_a_time(flat)[0].claims.opens


def test_one_at_a_time_covers_every_parameter_of_the_correlated_model() -> None:
    found = by_step(one_at_a_time(CORRELATED))
    assert {f for f, _ in found} - {""} == set(CORRELATED.nominal)
    # nothing goes down from r = 0, nothing up from presence = 1
    assert [v for f, v in found if f == "r"] == [0.2]
    assert [v for f, v in found if f == "presence"] == [0.8]
    assert {s for s, p in found.items() if not p.claims.low} == {("b", 1.0)}
