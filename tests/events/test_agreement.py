"""Cohen's kappa against a textbook table and scikit-learn; its interval against the asymptotic one of statsmodels."""

from __future__ import annotations

import pytest
from sklearn.metrics import cohen_kappa_score
from statsmodels.stats.inter_rater import cohens_kappa as asymptotic

from foreshock.events import Event
from foreshock.events.agreement import agreement, cohens_kappa
from foreshock.events.synthetic import synthetic_events
from foreshock.taxonomy import builtin_taxonomy
from tests.events.build import event

TAXONOMY = builtin_taxonomy()
EVENTS = synthetic_events(11)
SLIP, SPIKE, GRIP = "foot-micro-slip", "torso-angular-spike", "grip-micro-slip"


def sides(events: list[Event]) -> tuple[list[Event], list[Event]]:
    first, second = ([e for e in events if e.coder == coder] for coder in ("coder-1", "coder-2"))
    assert [e.id for e in first] == [e.id for e in second]
    return first, second


def test_a_table_with_a_known_kappa() -> None:
    # 20 and 15 agree, 5 and 10 do not: p_o = 0.7, p_e = 0.6 0.5 + 0.4 0.5 = 0.5, kappa = 0.4
    said = [("yes", "yes")] * 20 + [("yes", "no")] * 5 + [("no", "yes")] * 10 + [("no", "no")] * 15
    found = cohens_kappa("grants", [([a], [b]) for a, b in said])
    assert found.kappa == pytest.approx(0.4)
    assert (found.decisions, found.agreed) == (50, 0.7)
    reference = asymptotic([[20, 5], [10, 15]])
    assert found.low == pytest.approx(reference.kappa_low, abs=0.03)  # two approximations of one interval
    assert found.high == pytest.approx(reference.kappa_upp, abs=0.03)


def test_full_agreement_and_nothing_to_agree_on() -> None:
    assert cohens_kappa("x", [(["a"], ["a"]), (["b"], ["b"])] * 5).kappa == 1
    assert cohens_kappa("x", [(["a"], ["a"])] * 5).kappa is None
    assert cohens_kappa("x", [([], [])]).kappa is None


def test_every_field_agrees_with_scikit_learn() -> None:
    (found,) = agreement(EVENTS, TAXONOMY)
    kappas = {k.field: k for k in found.kappas}
    first, second = sides(EVENTS)
    kinds = sorted({p.kind for e in EVENTS for p in e.precursors})
    classes = [c.id for c in TAXONOMY.classes]

    def reference(said) -> float:
        a, b = ([x for e in side for x in said(e)] for side in (first, second))
        return cohen_kappa_score(a, b)

    for field, said in {
        "precursor kinds": lambda e: [k in {p.kind for p in e.precursors} for k in kinds],
        "precursor classes": lambda e: [c in {TAXONOMY.class_of(p.kind) for p in e.precursors} for c in classes],
        "outcome": lambda e: [e.outcome],
        "deviation": lambda e: [d in e.deviation for d in ("kinematic", "perceptual", "human-behavioural")],
    }.items():
        assert kappas[field].kappa == pytest.approx(reference(said), abs=1e-12)
        assert kappas[field].low < kappas[field].kappa < kappas[field].high
    assert kappas["task"].kappa == 1  # the second coder differs in other fields only


def test_the_bootstrap_agrees_with_the_asymptotic_interval_where_decisions_are_independent() -> None:
    (found,) = agreement(EVENTS, TAXONOMY)
    outcome = next(k for k in found.kappas if k.field == "outcome")
    first, second = sides(EVENTS)
    codes = sorted({e.outcome for e in EVENTS})
    table = [
        [sum((a.outcome, b.outcome) == (r, c) for a, b in zip(first, second, strict=True)) for c in codes]
        for r in codes
    ]
    reference = asymptotic(table)
    assert outcome.low == pytest.approx(reference.kappa_low, abs=0.015)
    assert outcome.high == pytest.approx(reference.kappa_upp, abs=0.015)


def test_two_coders_by_hand() -> None:
    events = [
        event("a", "A1", (SLIP, 1.0), (SPIKE, 2.0)),
        event("b", "A5", (GRIP, 1.0)),
        event("only anna", "A1", (GRIP, 1.0)),
        event("a", "A1", (SLIP, 1.25), coder="ben"),
        event("b", "A5", (GRIP, 1.0), (GRIP, 3.0), coder="ben"),
    ]
    (found,) = agreement(events, TAXONOMY)
    assert (found.coders, found.events) == (("anna", "ben"), 2)
    kinds = next(k for k in found.kappas if k.field == "precursor kinds")
    # of 2 events and 3 kinds, both see 2, only anna sees 1, neither sees 3: p_o = 5/6, p_e = (3 2 + 3 4) / 36 = 1/2
    assert (kinds.decisions, kinds.kappa) == (6, pytest.approx(2 / 3))
    assert found.onset_s == pytest.approx(0.125)  # median of 0.25 and 0


def test_one_coder_has_nobody_to_agree_with() -> None:
    assert agreement([event("a"), event("b")], TAXONOMY) == ()
