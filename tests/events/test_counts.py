"""Frequencies, associations, pairs, overlap and order against small tables that were counted by hand."""

from __future__ import annotations

from math import sqrt

import pytest
from scipy.stats import norm

from foreshock.errors import BadInputError
from foreshock.events.analyse import analyse
from foreshock.events.association import class_association, kind_association
from foreshock.events.cascades import cascade_orders, common_sequences
from foreshock.events.codings import coder_pairs, one_coding
from foreshock.events.frequencies import class_shares, mode_frequencies
from foreshock.events.overlap import overlap
from foreshock.events.pairs import cooccurrence, lift, order, seen_kinds
from foreshock.events.synthetic import synthetic_events
from foreshock.taxonomy import builtin_taxonomy
from tests.events.build import event

TAXONOMY = builtin_taxonomy()
SLIP, SPIKE, COM = "foot-micro-slip", "torso-angular-spike", "com-lateral-deviation"
GRIP, GAZE = "grip-micro-slip", "gaze-diversion"


def wilson(k: int, n: int) -> tuple[float, float]:
    """Wilson (1927), in closed form."""
    z = norm.ppf(0.975)
    middle = (k + z**2 / 2) / (n + z**2)
    half = z / (n + z**2) * sqrt(k * (n - k) / n + z**2 / 4)
    return middle - half, middle + half


def test_mode_frequencies_beside_table_1() -> None:
    events = [event("a", "A1"), event("b", "A1"), event("c", "A5"), event("d"), event("e", "A12")]
    found = {f.code: f for f in mode_frequencies(events, TAXONOMY)}
    assert [(f.rate.k, f.rate.n) for f in (found["A1"], found["A2"], found["A5"])] == [(2, 4), (0, 4), (1, 4)]
    assert (found["A1"].rate.low, found["A1"].rate.high) == pytest.approx(wilson(2, 4), abs=1e-12)
    assert (found["A1"].paper_n, found["A12"].paper_percent) == (18, 4.8)


def test_class_shares_count_precursors_of_accidents() -> None:
    events = [
        event("a", "A1", (SLIP, 0), (SLIP, 1), (GRIP, 2)),
        event("b", "none", (GAZE, 1)),
        event("c", "A5", (GRIP, 1)),
    ]
    found = {c.id: c for c in class_shares(events, TAXONOMY)}
    assert [(found[c].rate.k, found[c].rate.n) for c in ("motion-balance", "manipulation", "human-behavioral")] == [
        (2, 4),
        (2, 4),
        (0, 4),
    ]
    assert found["human-behavioral"].rate.high == pytest.approx(wilson(0, 4)[1], abs=1e-12)
    assert found["perceptual"].paper_share == 0.18


def tea() -> list:
    """Fisher's tea tasting: of four and four cups, three and one."""
    cells = [("A1", SLIP, 3), ("A1", GRIP, 1), ("none", SLIP, 1), ("none", GRIP, 3)]
    return [event(f"{outcome}-{kind}-{k}", outcome, (kind, 1.0)) for outcome, kind, n in cells for k in range(n)]


def test_association_of_classes() -> None:
    found = class_association(tea(), TAXONOMY)
    ties = {(t.outcome, t.name): t for t in found.ties}
    tie = ties["A1", "motion-balance"]
    assert (tie.given_outcome.k, tie.given_outcome.n) == (3, 4)
    assert (tie.given_name.k, tie.given_name.n) == (3, 4)
    assert (tie.given_name.low, tie.given_name.high) == pytest.approx(wilson(3, 4), abs=1e-12)
    assert tie.lift == pytest.approx(1.5)  # (3/4) / (4/8)
    assert tie.p_value == pytest.approx(34 / 70)  # Fisher: 2 (16 + 1) / 70
    assert tie.tied
    assert not ties["A1", "manipulation"].tied
    assert ties["A2", "motion-balance"].lift is None
    assert found.outcomes == (*TAXONOMY.codes, "none")
    assert found.chi_square is not None
    assert found.chi_square.statistic == pytest.approx(2.0)  # four cells of 1² / 2
    assert (found.chi_square.dof, found.chi_square.least_expected) == (1, 2.0)
    assert found.chi_square.v == pytest.approx(0.5)  # sqrt(2 / 8)
    assert found.chi_square.p_value == pytest.approx(2 * norm.sf(sqrt(2.0)))


def test_association_of_kinds_is_adjusted_for_the_number_of_ties() -> None:
    found = kind_association(
        [e for e in tea() if e.outcome == "A1"] + [event(f"x{k}", "A5", (GRIP, 1)) for k in range(9)], TAXONOMY
    )
    ties = {(t.outcome, t.name): t for t in found.ties}
    assert found.names == (SLIP, GRIP)
    assert len(found.ties) == 24
    # A1 and slip: 3 of 4 against 0 of 9; p = C(4,3) C(9,0) / C(13,3) = 4 / 286, and the same for the four cells
    assert ties["A1", SLIP].p_value == pytest.approx(4 / 286)
    assert ties["A1", SLIP].q_value == pytest.approx(4 / 286 * 24 / 4)
    assert ties["A1", SLIP].tied
    assert not ties["A1", GRIP].tied
    assert ties["A2", SLIP].q_value == 1


def test_one_outcome_cannot_be_associated() -> None:
    assert class_association([event("a", "A1", (SLIP, 1))], TAXONOMY).chi_square is None
    assert class_association([], TAXONOMY).chi_square is None


PAIRS = [
    event("a", "A1", (SLIP, 0.0), (SPIKE, 0.5)),
    event("b", "A1", (SPIKE, 0.0), (SLIP, 0.5), (SPIKE, 1.0)),
    event("c", "A1", (SLIP, 1.0), (GRIP, 1.0)),
    event("d", "A1", (GRIP, 0.0)),
]


def test_pairs_of_kinds() -> None:
    kinds = seen_kinds(PAIRS, TAXONOMY)
    assert kinds == (SLIP, SPIKE, GRIP)
    assert cooccurrence(PAIRS, kinds).values == ((3, 2, 1), (2, 2, 0), (1, 0, 2))
    values = lift(PAIRS, (*kinds, GAZE)).values
    assert values[0][1] == pytest.approx(4 * 2 / (3 * 2))
    assert values[0][2] == pytest.approx(4 * 1 / (3 * 2))
    assert values[1][2] == 0
    assert values[3] == (None, None, None, None)
    # slip before spike in a and b, spike before slip in b; slip and grip of c begin together; spike has two onsets in b
    assert order(PAIRS, kinds).values == ((0, 2, 0), (1, 1, 0), (0, 0, 0))


def test_no_events_give_empty_matrices() -> None:
    assert cooccurrence([], ()).values == lift([], ()).values == order([], ()).values == ()


def test_overlap_over_the_window() -> None:
    events = [
        event("onsets 0.7 apart", "A1", (SLIP, 1.0), (SPIKE, 1.7)),
        event("onsets 2 apart, presences 0.5", "A1", (SLIP, 1.0, 2.5), (SPIKE, 3.0)),
        event("present together", "A1", (SLIP, 1.0), (SPIKE, 4.0)),
        event("one kind twice", "A1", (SLIP, 1.0), (SLIP, 1.1)),
        event("two feet", "A1", (SLIP, 1.0, 1.0, 1.0, "left"), (SLIP, 2.4, 2.4, 1.0, "right")),
        event("alone", "A1", (SLIP, 1.0)),
        event("no accident", "none", (SLIP, 1.0), (SPIKE, 1.0)),
    ]
    points = overlap(events, (0.5, 0.7, 1.4))
    assert [(p.begun.k, p.begun.n) for p in points] == [(0, 6), (1, 6), (2, 6)]
    assert [p.present.k for p in points] == [3, 3, 4]
    assert (points[2].begun.low, points[2].begun.high) == pytest.approx(wilson(2, 6), abs=1e-12)
    assert [p.window_s for p in overlap(events)] == pytest.approx([0.5 + k / 10 for k in range(11)])


def test_order_of_cascades() -> None:
    events = [
        event("whole, in order", "A1", (SLIP, 0.0), (SPIKE, 0.48), (COM, 1.12)),
        event("two, in order", "A1", (COM, 2.0), (SPIKE, 1.0), (GAZE, 0.0)),
        event("two, reversed", "A1", (SPIKE, 1.0), (SLIP, 2.0), (SPIKE, 3.0)),
        event("tie", "A1", (SPIKE, 1.0), (SLIP, 1.0)),
        event("one", "A1", (SLIP, 1.0)),
        event("of another mode", "A5", (SPIKE, 1.0), (SLIP, 2.0)),
    ]
    a1 = cascade_orders(events, TAXONOMY)[0]
    assert (a1.code, a1.cascade) == ("A1", (SLIP, SPIKE, COM))
    assert (a1.complete, a1.in_order.k, a1.in_order.n) == (1, 2, 4)
    assert a1.by_chance == pytest.approx((1 / 6 + 3 / 2) / 4)
    assert cascade_orders(events, TAXONOMY)[1].by_chance is None
    common = common_sequences(events)
    assert (common[0].kinds, common[0].n) == ((SPIKE, SLIP), 2)
    assert (GAZE, SPIKE, COM) in {c.kinds for c in common}


def test_an_event_counts_once_however_often_it_was_coded() -> None:
    events = [event("x", "A1", coder="ben"), event("x", "A2"), event("y", "A1"), event("z", "A5", coder="cleo")]
    assert [(e.id, e.coder) for e in one_coding(events)] == [("x", "anna"), ("y", "anna"), ("z", "cleo")]
    assert [(e.id, e.coder) for e in one_coding(events, "ben")] == [("x", "ben"), ("y", "anna"), ("z", "cleo")]
    assert [(pair, len(shared)) for pair, shared in coder_pairs(events).items()] == [(("ben", "anna"), 1)]
    found = analyse(events, TAXONOMY)
    assert (found.rows, found.events, found.accidents) == (4, 3, 3)
    assert found.coders == {"anna": 2, "cleo": 1}
    assert [f.rate.k for f in found.modes[:5]] == [1, 1, 0, 0, 1]
    with pytest.raises(BadInputError, match="did you mean 'anna'"):
        analyse(events, TAXONOMY, coder="ana")


def test_the_analysis_of_nothing_is_empty() -> None:
    found = analyse([], TAXONOMY)
    assert (found.rows, found.events, found.synthetic, found.agreement) == (0, 0, 0, ())
    assert all(p.begun.n == 0 for p in found.overlap)


def test_the_analysis_gives_back_what_was_drawn() -> None:
    found = analyse(synthetic_events(0), TAXONOMY)
    assert (found.rows, found.events, found.precursors, found.synthetic) == (252, 126, 241, 126)
    assert [m.rate.k for m in found.modes] == [m.paper_n for m in found.modes]
    assert all(abs(c.rate.k / c.rate.n - c.paper_share) < 1 / 241 for c in found.classes)
    assert found.overlap[-1].begun.k / 126 == pytest.approx(0.73, abs=0.5 / 126)
