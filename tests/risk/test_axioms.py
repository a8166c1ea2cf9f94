"""The axioms of the correlated model, each on 1000 random cases, against a brute force that shares no code with it.

One long file, so that all axioms are read in one place; the brute force and what is drawn stand beside it.

Tolerances: mu's maximum v has |v|^2 <= v'Rv = 1'v <= n since R >= 0, so that errors of 1e-11 in R's entries, rounding
and all, move mu by less than 1e-9 for the sets here; P by a few times that, since dP/dm <= a/4 and dP/dq <= c.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from itertools import combinations, pairwise

import msgspec
import numpy as np
import pytest
from brute_force import (
    KINDS,
    bounds,
    capacities,
    correlations,
    effective,
    exact_mu,
    independent,
    lift,
    lifts,
    matrix,
    mu,
    pair,
    parameters_of,
)
from brute_force import (
    choquet as by_level_sets,
)
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize
from stories import MATRICES, MS, TAXONOMY, any_matrices, gram_matrices, letters, named, parameters, precursors

from foreshock.records import Precursor, RiskEstimate
from foreshock.risk import (
    Capacity,
    CorrelatedRisk,
    Link,
    LogisticExponential,
    Pair,
    RiskParameters,
    cascade_lift,
    choquet,
)
from foreshock.risk._cascade import Element

THOUSAND = settings(max_examples=1000, deadline=None)
CLOSE = 1e-9


def model(p: RiskParameters) -> CorrelatedRisk:
    return CorrelatedRisk(p, TAXONOMY)


def of_mode(found: Sequence[Precursor], code: str) -> list[Precursor]:
    return [p for p in found if code in TAXONOMY.modes_of(p.kind)]


def of_class(found: Sequence[Precursor], class_: str) -> list[Precursor]:
    return [p for p in found if TAXONOMY.class_of(p.kind) == class_]


def never_lower(after: RiskEstimate, before: RiskEstimate, tolerance: float = CLOSE) -> None:
    for name in ("probability", "lower", "upper", "m", "q"):
        assert getattr(after, name) >= getattr(before, name) - tolerance, name
    for name in ("by_mode", "upper_by_mode", "by_class", "upper_by_class"):
        mine, old = getattr(after, name), getattr(before, name)
        assert set(old) <= set(mine)
        for key, p in old.items():
            assert mine[key] >= p - tolerance, (name, key)


# ---- the effective number of kinds


@settings(max_examples=100, deadline=None)
@given(gram_matrices())
def test_the_brute_force_itself_agrees_with_a_solver_where_the_problem_is_convex(r: np.ndarray) -> None:
    n = len(r)
    found = minimize(
        lambda v: float(v @ r @ v - 2.0 * v.sum()),
        np.full(n, 0.5),
        jac=lambda v: 2.0 * (r @ v - 1.0),
        bounds=[(0.0, None)] * n,
        method="L-BFGS-B",
        options={"ftol": 1e-14, "gtol": 1e-10},
    )
    assert mu(r) == pytest.approx(-found.fun, abs=1e-6)  # the solver's own accuracy


@THOUSAND
@given(MATRICES)
def test_mu_is_the_maximum_over_all_supports(r: np.ndarray) -> None:
    kinds = letters(len(r))
    found = Capacity(named(r, kinds)).of(kinds)
    assert found == pytest.approx(mu(r), abs=CLOSE)
    assert 1.0 - CLOSE <= found <= len(r) + CLOSE


HARD = st.sampled_from(
    [Fraction(k, 10) for k in (0, 3, 5, 7, 9)] + [Fraction(1), 1 - Fraction(1, 10**6), 1 - Fraction(1, 10**12)]
)


@THOUSAND
@given(st.integers(1, 4), st.lists(HARD, min_size=6, max_size=6))
def test_mu_is_exact_for_singular_near_singular_and_indefinite_matrices(n: int, entries: list[Fraction]) -> None:
    exact = [[Fraction(int(i == j)) for j in range(n)] for i in range(n)]
    for (i, j), x in zip(combinations(range(n), 2), entries, strict=False):
        exact[i][j] = exact[j][i] = x
    kinds = letters(n)
    r = np.array([[float(x) for x in row] for row in exact])
    assert Capacity(named(r, kinds)).of(kinds) == pytest.approx(float(exact_mu(exact)), abs=CLOSE)


@THOUSAND
@given(st.integers(1, 6), st.lists(st.integers(0, 99), min_size=15, max_size=15))
def test_mu_is_the_sum_of_the_inverse_where_that_solution_is_not_negative(n: int, entries: list[int]) -> None:
    kinds, r = letters(n), np.eye(n)
    for (i, j), x in zip(combinations(range(n), 2), entries, strict=False):
        # rows that sum to less than 2 are diagonally dominant: the solution lies within 0..1
        r[i, j] = r[j, i] = x / 100 / max(1, n - 1)
    v = np.linalg.inv(r) @ np.ones(n)
    assert v.min() >= 0.0
    assert Capacity(named(r, kinds)).of(kinds) == pytest.approx(float(v.sum()), abs=CLOSE)


@THOUSAND
@given(st.integers(1, 8), st.floats(0.0, 1.0))
def test_mu_of_equal_correlations_is_the_design_effect(n: int, r: float) -> None:
    """The closed form n / (1 + (n - 1) r): Kish's effective sample size of a cluster."""
    kinds = letters(n)
    equal = dict.fromkeys(combinations(kinds, 2), r)
    assert Capacity(equal).of(kinds) == pytest.approx(n / (1.0 + (n - 1) * r), abs=CLOSE)


@THOUSAND
@given(MATRICES, st.permutations(range(6)))
def test_mu_grows_with_the_set_and_does_not_depend_on_order(r: np.ndarray, ranks: list[int]) -> None:
    kinds = letters(len(r))
    capacity = Capacity(named(r, kinds))
    order = [kinds[k] for k in ranks if k < len(kinds)]
    growth = capacity.growth(order)
    assert len(growth) == len(order) + 1
    assert growth[0] == 0.0
    for k in range(len(order) + 1):
        assert growth[k] == pytest.approx(capacity.of(order[:k]), abs=CLOSE)
        assert growth[k] == pytest.approx(capacity.of(sorted(order[:k])), abs=CLOSE)
    for before, after in pairwise(growth):
        assert before - CLOSE <= after <= before + 1.0 + CLOSE


@THOUSAND
@given(any_matrices(), st.lists(st.sampled_from([0.0, 0.1, 0.5, 1.0]), min_size=15, max_size=15))
def test_mu_falls_as_any_correlation_grows(r: np.ndarray, shares: list[float]) -> None:
    kinds = letters(len(r))
    more = r.copy()
    for (i, j), share in zip(combinations(range(len(r)), 2), shares, strict=False):
        more[i, j] = more[j, i] = r[i, j] + share * (1.0 - r[i, j])
    assert Capacity(named(more, kinds)).of(kinds) <= Capacity(named(r, kinds)).of(kinds) + CLOSE


@THOUSAND
@given(gram_matrices(3), st.lists(st.integers(0, 2), min_size=1, max_size=6))
def test_subjects_of_a_kind_do_not_correlate(r: np.ndarray, picked: list[int]) -> None:
    kinds = letters(len(r))
    elements = [kinds[i % len(kinds)] for i in picked]
    capacity = Capacity(named(r, kinds))
    assert capacity.of(elements) == pytest.approx(mu(matrix(elements, named(r, kinds))), abs=CLOSE)
    for kind in kinds:
        assert capacity.of([kind, kind, kind]) == pytest.approx(3.0, abs=CLOSE)


@THOUSAND
@given(st.floats(0.0, 1.0))
def test_two_feet_that_each_correlate_with_the_torso(r: float) -> None:
    """Indefinite from r^2 > 1/2 on. v = (1 - 2r, 1 - r, 1 - r) / (1 - 2 r^2) while r <= 1/2, else the feet alone."""
    expected = (3.0 - 4.0 * r) / (1.0 - 2.0 * r * r) if r <= 0.5 else 2.0
    capacity = Capacity({("foot", "torso"): r})
    assert capacity.of(["torso", "foot", "foot"]) == pytest.approx(expected, abs=CLOSE)
    assert capacity.of(["foot", "torso", "foot"]) == pytest.approx(expected, abs=CLOSE)


# ---- the Choquet integral

VALUES = st.lists(st.integers(0, 80).map(lambda k: k / 8), min_size=6, max_size=6)


@THOUSAND
@given(MATRICES, VALUES)
def test_choquet_is_the_integral_over_level_sets(r: np.ndarray, values: list[float]) -> None:
    kinds, x = letters(len(r)), values[: len(r)]
    found = choquet(x, kinds, Capacity(named(r, kinds)))
    assert found == pytest.approx(by_level_sets(x, capacities(r)), abs=10 * CLOSE)  # values up to 10
    assert max(x) - 10 * CLOSE <= found <= sum(x) + 10 * CLOSE


@THOUSAND
@given(MATRICES, VALUES, VALUES)
def test_choquet_never_falls_with_a_value(r: np.ndarray, values: list[float], added: list[float]) -> None:
    kinds, x = letters(len(r)), values[: len(r)]
    capacity = Capacity(named(r, kinds))
    more = [a + b for a, b in zip(x, added, strict=False)]
    assert choquet(more, kinds, capacity) >= choquet(x, kinds, capacity) - 20 * CLOSE
    assert choquet(x[:-1], kinds[:-1], capacity) <= choquet(x, kinds, capacity) + 20 * CLOSE


@pytest.mark.parametrize(("r", "expected"), [(0.0, sum), (1.0, max)])
def test_choquet_is_the_sum_without_correlation_and_the_largest_of_duplicates(r: float, expected: object) -> None:
    kinds, values = letters(5), [0.3, 2.0, 0.0, 1.0, 1.0]
    capacity = Capacity(dict.fromkeys(combinations(kinds, 2), r))
    assert choquet(values, kinds, capacity) == pytest.approx(expected(values), abs=CLOSE)  # type: ignore[operator]


# ---- the cascade lift


def onsets_of(code: int) -> tuple[int, ...]:
    """The bits of a number, at most three."""
    return tuple(k for k in range(9) if code >> k & 1)[:3]


def elements(most: int, kinds: str = "abcdef") -> st.SearchStrategy[list[Element]]:
    one = st.tuples(st.sampled_from(kinds), st.integers(0, 10), st.integers(1, 511))
    return st.lists(one.map(lambda x: Element(x[0], x[1] / 10, onsets_of(x[2]))), max_size=most)


def linked(kinds: str = "abcdef", most: int = 15) -> st.SearchStrategy[dict[tuple[str, str], float]]:
    pairs = [(a, b) for a in kinds for b in kinds if a != b]
    return st.dictionaries(st.sampled_from(pairs), st.sampled_from([0.25, 1.0, 1.5]), max_size=most)


def nested(links: dict[tuple[str, str], float]) -> dict[str, dict[str, float]]:
    found: dict[str, dict[str, float]] = {}
    for (a, b), x in links.items():
        found.setdefault(a, {})[b] = x
    return found


@THOUSAND
@given(elements(6), linked())
def test_lift_is_the_best_of_all_chains(found: list[Element], links: dict[tuple[str, str], float]) -> None:
    expected = lift(found, lambda a, b: links.get((a, b), 0.0))
    assert cascade_lift(found, nested(links)) == pytest.approx(expected, abs=1e-12)  # sums of at most 5 terms


TWELVE = "abcdefghijkl"


@THOUSAND
@given(
    elements(6, TWELVE), elements(8, TWELVE), linked(TWELVE, 20), st.lists(st.integers(0, 29), min_size=6, max_size=6)
)
def test_lift_never_falls_with_an_element_an_onset_strength_or_a_link(
    found: list[Element], extra: list[Element], links: dict[tuple[str, str], float], change: list[int]
) -> None:
    """Up to twelve kinds, so that it also holds where the exact search gives way to the upper bound."""
    more_links = {**links, **{k: links[k] + 0.5 for k in list(links)[::2]}}
    more = [
        Element(e.kind, min(1.0, e.strength + c // 10 / 5), tuple(sorted({*e.onsets, *([c % 10] if c % 10 else [])})))
        for e, c in zip(found, change, strict=False)
    ] + extra
    assert cascade_lift(more, nested(more_links)) >= cascade_lift(found, nested(links)) - 1e-12


def best_by_time(found: Sequence[Element], links: dict[tuple[str, str], float]) -> float:
    """The best chain by dynamic programming over (last onset, kinds used): exact for many kinds too."""
    kinds = sorted({e.kind for e in found})
    ends: list[tuple[int, Element, dict[int, float]]] = []
    for at, e in sorted(((t, x) for x in found for t in x.onsets), key=lambda x: x[0]):
        mine = {1 << kinds.index(e.kind): 0.0}
        for before, last, table in ends:
            if before < at:
                gain = links.get((last.kind, e.kind), 0.0) * min(last.strength, e.strength)
                for used, total in table.items():
                    if not used >> kinds.index(e.kind) & 1:
                        key = used | 1 << kinds.index(e.kind)
                        mine[key] = max(mine.get(key, 0.0), total + gain)
        ends.append((at, e, mine))
    return max((x for _, _, table in ends for x in table.values()), default=0.0)


@pytest.mark.parametrize("seed", range(12))
def test_lift_of_many_kinds_is_exact_with_single_onsets_and_never_too_low_with_several(seed: int) -> None:
    rng = np.random.default_rng(seed)
    kinds = "abcdefghij"
    links = {(a, b): float(rng.uniform(0.0, 1.5)) for a in kinds for b in kinds if a != b and rng.random() < 0.5}
    single = [Element(k, float(rng.uniform()), (int(rng.integers(0, 12)),)) for k in kinds]
    assert cascade_lift(single, nested(links)) == pytest.approx(best_by_time(single, links), abs=1e-12)
    several = [e._replace(onsets=tuple(sorted({*e.onsets, int(rng.integers(0, 12))}))) for e in single]
    assert cascade_lift(several, nested(links)) >= best_by_time(several, links) - 1e-12


def test_lift_of_many_kinds_with_single_onsets_stays_exact_where_one_finds_no_partner() -> None:
    """a, then b .. i at once: one link can be in a chain. z is linked to y only, which is not there."""
    links = {("a", k): 1.0 for k in "bcdefghi"} | {("y", "z"): 1.0}
    found = [Element("a", 1.0, (0,)), *(Element(k, 1.0, (1,)) for k in "bcdefghi"), Element("z", 1.0, (1,))]
    assert cascade_lift(found[:-1], nested(links)) == 1.0
    assert cascade_lift(found, nested(links)) == 1.0


def test_lift_does_not_fall_when_many_kinds_find_their_last_partner() -> None:
    links = {("a", k): 1.0 for k in "bcdefghi"} | {("y", "z"): 1.0}
    found = [Element("a", 1.0, (0,)), *(Element(k, 1.0, (1,)) for k in "bcdefghi"), Element("z", 1.0, (1,))]
    more = [*found, Element("y", 1.0, (0,))]
    assert cascade_lift(more, nested(links)) >= cascade_lift(found, nested(links))


def test_lift_of_a_chain_goes_on_over_a_step_without_a_link() -> None:
    """a -> b, then c -> d: the chain a b c d has a link of 0 in its middle, as good as one of 1e-12."""
    links = {("a", "b"): 1.0, ("c", "d"): 1.0}
    found = [Element(k, 1.0, (t,)) for t, k in enumerate("abcd")]
    assert cascade_lift(found, nested(links)) == pytest.approx(2.0, abs=1e-9)
    assert cascade_lift(found, nested({**links, ("b", "c"): 1e-12})) == pytest.approx(2.0, abs=1e-9)


# ---- the estimate


@THOUSAND
@given(
    precursors(6, full=True),
    st.sampled_from([LogisticExponential(), LogisticExponential(0.5, 1.0, 3.0), LogisticExponential(4.0, 3.5, 0.1)]),
    st.floats(0.0, 1.0),
    st.booleans(),
)
def test_eq_1_exactly_without_correlation_and_cascades(
    found: list[Precursor], eq_1: LogisticExponential, presence: float, named_pairs: bool
) -> None:
    pairs = [Pair(kinds=(a, b), r=0.0, low=0.0, high=0.0) for a, b in combinations(KINDS, 2)] if named_pairs else []
    links = [Link(a, b, 1.0, 0.0, 2.0) for a, b in pairwise(KINDS)]
    fields = {"a": eq_1.a, "b": eq_1.b, "c": eq_1.c, "kappa": 0.0, "presence": presence}
    risk = model(parameters_of(pairs, links, **fields).check(TAXONOMY, "a test")).estimate(found)

    def counted(members: Sequence[Precursor]) -> float:
        return eq_1.of_counts(float(len(members)), sum(p.occurrences for p in members)) if members else 0.0

    assert (risk.m, risk.q) == pytest.approx((len(found), sum(p.occurrences for p in found)), abs=1e-12)
    for p in (risk.probability, risk.lower, risk.upper):
        assert p == pytest.approx(counted(found), abs=1e-12)
    for code in TAXONOMY.codes:
        assert risk.by_mode[code] == pytest.approx(counted(of_mode(found, code)), abs=1e-12)
        assert risk.upper_by_mode[code] == pytest.approx(counted(of_mode(found, code)), abs=1e-12)


@THOUSAND
@given(precursors(5), parameters())
def test_estimate_is_the_model_overall_by_mode_and_by_class(found: list[Precursor], p: RiskParameters) -> None:
    risk = model(p).estimate(found)
    m, q, _ = effective(found, p, correlations(p), lifts(p))
    assert (risk.m, risk.q) == pytest.approx((m, q), abs=10 * CLOSE)
    expected = bounds(found, p) if found else (0.0, 0.0, 0.0)
    assert (risk.lower, risk.probability, risk.upper) == pytest.approx(expected, abs=10 * CLOSE)
    for code in TAXONOMY.codes:
        mine = of_mode(found, code)
        _, probability, upper = bounds(mine, p) if mine else (0.0, 0.0, 0.0)
        assert risk.by_mode[code] == pytest.approx(probability, abs=10 * CLOSE)
        assert risk.upper_by_mode[code] == pytest.approx(upper, abs=10 * CLOSE)
    for class_, probability in risk.by_class.items():
        mine = of_class(found, class_)
        _, wanted, upper = bounds(mine, p) if mine else (0.0, 0.0, 0.0)
        assert (probability, risk.upper_by_class[class_]) == pytest.approx((wanted, upper), abs=10 * CLOSE)


@THOUSAND
@given(precursors(6), parameters(), st.integers(0, 2**32 - 1))
def test_bounds_hold_for_every_matrix_inside_the_interval(found: list[Precursor], p: RiskParameters, seed: int) -> None:
    risk = model(p).estimate(found)
    assert risk.lower <= risk.probability <= risk.upper
    for code, probability in risk.by_mode.items():
        assert probability <= risk.upper_by_mode[code]
    assert risk.upper >= independent(found, p) - 1e-12
    rng = np.random.default_rng(seed)

    def inside(x: Pair | Link) -> float:
        return x.low + float(rng.choice([0.0, 1.0, rng.random()])) * (x.high - x.low)

    drawn = {pair(*x.kinds): inside(x) for x in p.correlation}
    j = {(x.first, x.then): inside(x) for x in p.cascade}
    for r in (drawn, {}):
        assert risk.upper >= effective(found, p, r, j)[2] - CLOSE
    assert risk.lower <= effective(found, p, drawn, j)[2] + CLOSE


DUPLICATE = "sway-amplitude-increase"
"""Of the class of KINDS[0], so that both count for the same modes; not among KINDS."""


@THOUSAND
@given(precursors(4, 1), parameters(), st.integers(0, 7))
def test_a_duplicate_adds_nothing(found: list[Precursor], p: RiskParameters, weaker: int) -> None:
    """r = 1 with one kind and its r with all others; no worse than the original, and in no cascade of its own."""
    original, rest = found[0], [x for x in found[1:] if x.kind != found[0].kind]
    rows = [
        Pair((DUPLICATE, other), x.r, x.low, x.high)
        for x in p.correlation
        if original.kind in x.kinds
        for other in x.kinds
        if other != original.kind
    ]
    same = Pair((DUPLICATE, original.kind), 1.0, 1.0, 1.0)
    grown = msgspec.structs.replace(p, correlation=(*p.correlation, *rows, same)).check(TAXONOMY, "a test")
    copy = msgspec.structs.replace(
        original,
        kind=DUPLICATE,
        severity=original.severity * (0.5 if weaker & 1 else 1.0),
        weight=original.weight * (0.5 if weaker & 2 else 1.0),
        occurrences=original.occurrences * (0.5 if weaker & 4 else 1.0),
    )
    alone = model(grown).estimate([original, *rest])
    both = model(grown).estimate([original, *rest, copy])
    for name in ("m", "q", "probability", "lower"):
        assert getattr(both, name) == pytest.approx(getattr(alone, name), abs=1e-6), name


CHANGES = st.lists(st.integers(0, 49), min_size=4, max_size=4)


@THOUSAND
@given(precursors(4, 1), precursors(2), parameters(), CHANGES, st.integers(0, 5))
def test_more_evidence_never_lowers_p_nor_its_bounds(
    found: list[Precursor], extra: list[Precursor], p: RiskParameters, changes: list[int], turn: int
) -> None:
    have = {(x.kind, x.subject) for x in found}
    grown = [x for x in extra if (x.kind, x.subject) not in have]
    for x, change in zip(found, changes, strict=False):
        what, much = change % 5, change // 5
        changed = x
        if what == 1:
            changed = msgspec.structs.replace(x, severity=min(1.0, x.severity + much / 9))
        elif what == 2:
            changed = msgspec.structs.replace(x, occurrences=x.occurrences + much / 9)
        elif what == 3:
            changed = msgspec.structs.replace(x, weight=1.0)
        elif what == 4:
            onsets = tuple(sorted({*(x.onsets_ns or (x.onset_ns,)), much * 100 * MS}))
            changed = msgspec.structs.replace(x, onsets_ns=onsets, onset_ns=onsets[0])
        grown.append(changed)
    risk = model(p)
    turned = grown[turn % len(grown) :] + grown[: turn % len(grown)]
    never_lower(risk.estimate(turned), risk.estimate(found))


@THOUSAND
@given(precursors(5, 2), parameters())
def test_an_ordered_cascade_weighs_at_least_as_much_as_the_unordered(found: list[Precursor], p: RiskParameters) -> None:
    at_once = [msgspec.structs.replace(x, onset_ns=0, onsets_ns=()) for x in found]
    ordered = [msgspec.structs.replace(x, onset_ns=k * MS, onsets_ns=(k * MS,)) for k, x in enumerate(found)]
    risk = model(p)
    unordered = risk.estimate(at_once)
    never_lower(risk.estimate(found), unordered, 1e-12)
    never_lower(risk.estimate(ordered), unordered, 1e-12)
    flat = effective(at_once, msgspec.structs.replace(p, kappa=0.0), correlations(p), {})
    assert unordered.m == pytest.approx(flat[0], abs=10 * CLOSE)


def test_the_cascade_of_a1_weighs_more_in_its_order() -> None:
    a1 = TAXONOMY.mode("A1").cascade
    p = parameters_of(cascade=[Link(a, b, 1.0, 0.0, 1.0) for a, b in pairwise(a1)])

    def at(*onsets: int) -> RiskEstimate:
        return model(p.check(TAXONOMY, "a test")).estimate(
            [Precursor(k, "", "ongoing", 1.0, 1.0, 1.0, t * MS, "d") for k, t in zip(a1, onsets, strict=True)]
        )

    # both links, one, none: m* = 5, 4, 3 at q = 3
    for onsets, m in (((0, 1, 2), 5.0), ((0, 1, 1), 4.0), ((1, 0, 2), 4.0), ((0, 0, 0), 3.0), ((2, 1, 0), 3.0)):
        assert at(*onsets).m == pytest.approx(m, abs=1e-12)
        assert at(*onsets).probability == pytest.approx(LogisticExponential().of_counts(m, 3.0), abs=1e-12)
        assert at(*onsets).lower == pytest.approx(LogisticExponential().of_counts(3.0, 3.0), abs=1e-12)


# ---- many elements: beyond the exhaustive search inside mu

MANY = [(k, s) for s in ("", "left", "right") for k in KINDS]


@pytest.mark.parametrize("count", [10, 11, 12, 14])
@pytest.mark.parametrize("r", [0.3, 0.6, 1.0])
def test_mu_of_many_indefinite_elements_is_never_too_low(count: int, r: float) -> None:
    elements_ = [k for k, _ in MANY[:count]]
    one = {("foot-micro-slip", "torso-angular-spike"): r, ("grip-micro-slip", "handover-occlusion"): r}
    found = Capacity(one).of(elements_)
    exact = mu(matrix(elements_, one))
    assert exact - CLOSE <= found <= count + CLOSE


@settings(THOUSAND, max_examples=250)  # each takes 60 ms
@given(st.lists(st.sampled_from(MANY), min_size=11, max_size=14, unique=True), parameters())
def test_the_order_of_the_bounds_holds_for_many_elements(places: list[tuple[str, str]], p: RiskParameters) -> None:
    found = [Precursor(k, s, "ongoing", 1.0, 1.0, 1.0, i * MS, "d") for i, (k, s) in enumerate(places)]
    risk = model(p).estimate(found)
    assert risk.lower <= risk.probability <= risk.upper
    assert risk.upper >= independent(found, p) - 1e-12
    never_lower(risk, model(p).estimate(found[:-1]))
    never_lower(model(p).estimate(found[:-1]), model(p).estimate(found[:10]))


@pytest.mark.parametrize("r", [0.5, 0.45])
@pytest.mark.parametrize("between", [0.0, 0.001])
def test_lower_is_below_p_where_one_wide_interval_makes_many_elements_indefinite(r: float, between: float) -> None:
    """Three pairs of kinds with two subjects each; R is positive semidefinite or nearly so, its upper end is not."""
    strong = {(KINDS[0], KINDS[1]): (r, 1.0), (KINDS[2], KINDS[3]): (r, r), (KINDS[4], KINDS[5]): (r, r)}
    pairs = [Pair(ab, x, x, high) for ab in combinations(KINDS, 2) for x, high in [strong.get(ab, (between, between))]]
    p = parameters_of(pairs, b=6.0).check(TAXONOMY, "a test")
    found = [Precursor(k, s, "ongoing", 1.0, 1.0, 1.0, 0, "d") for k in KINDS for s in ("", "left")]
    risk = model(p).estimate(found)
    assert risk.lower <= risk.probability <= risk.upper
    for p_, end in ((risk.probability, "r"), (risk.lower, "high")):
        # beyond the exhaustive search R is scaled down, which counts more, never less
        assert p_ >= effective(found, p, correlations(p, end), {})[2] - CLOSE


def test_many_subjects_of_one_kind_are_not_another_kind() -> None:
    """A crowd of humans' track ids; every set is worked out once, and none is taken for another."""
    capacity = Capacity({("a", "b"): 0.5, ("b", "c"): 0.5})
    for count in (1, 15, 16, 17, 256):
        assert capacity.of(["a"] * count) == pytest.approx(count, abs=1e-6)
    for kind in "abc":
        assert capacity.of([kind]) == 1.0
    assert capacity.of(["a", "b"]) == pytest.approx(2.0 / 1.5, abs=CLOSE)


# ---- why


def modes_and_overall() -> st.SearchStrategy[str]:
    return st.sampled_from(["", "", "A1", "A2", "A4", "A11"])


def acted_on(risk: RiskEstimate, mode: str) -> float:
    return risk.upper_by_mode[mode] if mode else risk.upper


@THOUSAND
@given(precursors(5), parameters(), modes_and_overall())
def test_attribution_is_leave_one_out(found: list[Precursor], p: RiskParameters, mode: str) -> None:
    why = model(p).explain(found, 0.3, mode)
    everything = acted_on(model(p).estimate(found), mode)
    assert (why.mode, why.gate) == (mode, 0.3)
    assert why.probability == pytest.approx(everything, abs=1e-12)
    shares = {(a.kind, a.subject): a.share for a in why.attribution}
    assert len(shares) == len(why.attribution)
    assert [a.share for a in why.attribution] == sorted(shares.values(), reverse=True)
    mine = of_mode(found, mode) if mode else found
    assert {(x.kind, x.subject) for x in mine} <= set(shares)
    for k, x in enumerate(found):
        without = acted_on(model(p).estimate(found[:k] + found[k + 1 :]), mode)
        assert shares.get((x.kind, x.subject), 0.0) == pytest.approx(everything - without, abs=CLOSE)


@THOUSAND
@given(precursors(6), parameters(), st.sampled_from([0.05, 0.3, 0.6, 0.9, 1.0]), modes_and_overall())
def test_the_smallest_set_keeps_trust_below_the_gate_and_no_smaller_one_does(
    found: list[Precursor], p: RiskParameters, gate: float, mode: str
) -> None:
    risk = model(p)
    smallest = risk.explain(found, gate, mode).smallest
    assert len(set(smallest)) == len(smallest)
    by_name = {(x.kind, x.subject): x for x in found}
    assert set(smallest) <= set(by_name)

    def trust(members: Sequence[Precursor]) -> float:
        return 1.0 - acted_on(risk.estimate(members), mode)

    if smallest:
        assert trust([by_name[s] for s in smallest]) < gate + 1e-12
    else:
        assert trust(found) >= gate - 1e-12
    for size in range(1, min(4, len(smallest) if smallest else 4)):
        for members in combinations(found, size):
            assert trust(members) >= gate - 1e-12
