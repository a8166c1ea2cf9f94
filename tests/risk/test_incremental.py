"""What a model was asked before never shows in what it answers: figures are kept from tick to tick, and none leaks."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from stories import MS, TAXONOMY, parameters, precursors

from foreshock.records import Precursor, RiskEstimate
from foreshock.risk import (
    CorrelatedRisk,
    IndependentRisk,
    Link,
    LogisticExponential,
    Provenance,
    RiskModel,
    RiskParameters,
)

CASCADE = TAXONOMY.mode("A1").cascade
A1 = RiskParameters(
    name="a1",
    provenance=Provenance(source="a test"),
    presence=0.5,
    cascade=tuple(Link(first=a, then=b, lift=1.0, low=0.0, high=1.0) for a, b in itertools.pairwise(CASCADE)),
)


def histories() -> st.SearchStrategy[list[list[Precursor]]]:
    """Lists of precursors, each unrelated to the last or a small change of it, as a supervisor's ticks are."""

    def told(drawn: tuple[list[list[Precursor]], list[int]]) -> list[list[Precursor]]:
        lists, changes = drawn
        history = []
        for now, change in zip(lists, changes, strict=False):
            last = history[-1] if history else []
            what, which = change % 8, change // 8
            k = which % len(last) if last else 0
            if what == 0 or not last:
                history.append(now)
            elif what == 1:
                history.append(list(last))
            elif what == 2:
                history.append(last[::-1])
            elif what == 3:
                history.append(last[:k] + last[k + 1 :])
            else:
                x = last[k]
                later = x.onset_ns + (1 + which) * 50 * MS
                fields = [
                    {"severity": which / 9},
                    {"onset_ns": later, "onsets_ns": (later,) if x.onsets_ns else ()},
                    {"occurrences": x.occurrences + 1.0, "onsets_ns": (x.onset_ns, later)},
                    {"subject": "right"},
                ][what - 4]
                history.append([*last[:k], msgspec.structs.replace(x, **fields), *last[k + 1 :]])
        return history

    lists = st.lists(precursors(4), min_size=2, max_size=6)
    return st.tuples(lists, st.lists(st.integers(0, 79), min_size=6, max_size=6)).map(told)


def written(estimate: RiskEstimate) -> bytes:
    return msgspec.json.encode(estimate)


def spoil(estimate: RiskEstimate) -> None:
    for figures in (estimate.by_mode, estimate.by_class, estimate.upper_by_mode, estimate.upper_by_class):
        for key in figures:
            figures[key] = 0.25
        figures["A99"] = 1.0
    estimate.counts.clear()


def follow(fresh: Callable[[], RiskModel], history: list[list[Precursor]]) -> None:
    model = fresh()
    for found in history:
        first, again, expected = model.estimate(found), model.estimate(found), fresh().estimate(found)
        assert written(first) == written(again) == written(expected)
        # whoever writes into an estimate moves neither that of the same tick nor that of the next
        spoil(first)
        assert written(again) == written(expected)


@settings(max_examples=500, deadline=None)
@given(histories(), parameters())
def test_the_correlated_model_remembers_nothing(history: list[list[Precursor]], p: RiskParameters) -> None:
    follow(lambda: CorrelatedRisk(p, TAXONOMY), history)


@settings(max_examples=200, deadline=None)
@given(histories())
def test_the_independent_model_remembers_nothing(history: list[list[Precursor]]) -> None:
    follow(lambda: IndependentRisk(LogisticExponential(), TAXONOMY), history)


@settings(max_examples=150, deadline=None)
@given(histories(), parameters(), st.sampled_from([0.3, 0.6, 0.95]), st.sampled_from(["", "A1", "A4"]))
def test_an_explanation_between_two_ticks_changes_nothing(
    history: list[list[Precursor]], p: RiskParameters, gate: float, mode: str
) -> None:
    model = CorrelatedRisk(p, TAXONOMY)
    for k, found in enumerate(history):
        asked = history[k - 1]  # of another decision, as a report asks for
        assert model.explain(asked, gate, mode) == CorrelatedRisk(p, TAXONOMY).explain(asked, gate, mode)
        assert model.explain(found, gate, mode) == CorrelatedRisk(p, TAXONOMY).explain(found, gate, mode)
        assert written(model.estimate(found)) == written(CorrelatedRisk(p, TAXONOMY).estimate(found))


@pytest.mark.parametrize("listed", [True, False])
def test_an_onset_that_moves_is_seen_whether_it_is_listed_or_stands_alone(listed: bool) -> None:
    """onsets_ns empty means onset_ns alone: slip and spike at once, in order, in the wrong order, in order again."""
    model = CorrelatedRisk(A1, TAXONOMY)

    def m(*onsets: int) -> float:
        found = [
            Precursor(k, "", "ongoing", 1.0, 1.0, 1.0, t, "d", onsets_ns=(t,) if listed else ())
            for k, t in zip(CASCADE, onsets, strict=False)
        ]
        return model.estimate(found).m

    # two kinds, and one link more where the first comes first
    assert [m(0, 0), m(0, MS), m(MS, 0), m(0, MS)] == pytest.approx([2.0, 3.0, 2.0, 3.0], abs=1e-12)


CHANGED = {
    "kind": "sway-amplitude-increase",
    "subject": "left",
    "severity": 0.5,
    "occurrences": 2.0,
    "weight": 0.5,
    "onsets_ns": (2 * MS, 9 * MS),
}


@pytest.mark.parametrize("field", CHANGED)
def test_a_change_in_any_field_that_risk_depends_on_is_seen(field: str) -> None:
    """Slip, then spike, with presence 0.5; the slip changes in one field. subject alone changes no figure."""
    slip = Precursor(CASCADE[0], "", "ongoing", 1.0, 1.0, 1.0, 0, "d", onsets_ns=(0,))
    spike = Precursor(CASCADE[1], "", "ongoing", 1.0, 1.0, 1.0, MS, "d", onsets_ns=(MS,))
    other = msgspec.structs.replace(slip, **{field: CHANGED[field]})
    model = CorrelatedRisk(A1, TAXONOMY)
    before, after = model.estimate([slip, spike]), model.estimate([other, spike])
    assert written(after) == written(CorrelatedRisk(A1, TAXONOMY).estimate([other, spike]))
    assert (written(after) == written(before)) is (field == "subject")
    assert written(model.estimate([slip, spike])) == written(before)


def test_two_models_share_nothing() -> None:
    found = [Precursor(k, "", "ongoing", 1.0, 1.0, 1.0, t * MS, "d") for t, k in enumerate(CASCADE)]
    weak = msgspec.structs.replace(A1, kappa=0.0)
    one, other = CorrelatedRisk(A1, TAXONOMY), CorrelatedRisk(weak, TAXONOMY)
    assert [one.estimate(found).m, other.estimate(found).m] == pytest.approx([5.0, 3.0], abs=1e-12)
    assert [one.estimate(found).m, other.estimate(found).m] == pytest.approx([5.0, 3.0], abs=1e-12)


def test_records_are_frozen() -> None:
    estimate = CorrelatedRisk(A1, TAXONOMY).estimate([])
    with pytest.raises(AttributeError):
        estimate.probability = 0.5  # type: ignore[misc]
    assert (estimate.probability, estimate.lower, estimate.upper, estimate.m, estimate.q) == (0.0, 0.0, 0.0, 0.0, 0.0)
    assert set(estimate.by_mode.values()) == set(estimate.upper_by_mode.values()) == {0.0}
    assert set(estimate.by_mode) == set(TAXONOMY.codes)
    assert set(estimate.by_class) == set(estimate.upper_by_class) == {c.id for c in TAXONOMY.classes}
