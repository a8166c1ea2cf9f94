"""The axioms of the correlated model, against a brute force that shares no code with it.

mu by the definition (every support, in rationals), Choquet by its level sets, chains by every permutation and onset.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from foreshock.errors import ConfigError
from foreshock.records import Precursor
from foreshock.risk import (
    CorrelatedRisk,
    Link,
    LogisticExponential,
    Pair,
    Provenance,
    RiskParameters,
    load_parameters,
    save_parameters,
)
from foreshock.taxonomy import builtin_taxonomy

TAXONOMY = builtin_taxonomy()
KINDS = ("foot-micro-slip", "torso-angular-spike", "com-lateral-deviation", "sway-amplitude-increase")
"""All of them tied to A1."""
MANY = settings(max_examples=1000, deadline=None)
R = st.sampled_from([0.0, 0.25, 0.5, 0.75, 0.9, 1.0])


# ---- the reference


def solved(a: list[list[Fraction]]) -> list[Fraction] | None:
    """x of a x = 1 by elimination in rationals; None where a is singular."""
    n = len(a)
    rows = [[*row, Fraction(1)] for row in a]
    for k in range(n):
        pivot = next((i for i in range(k, n) if rows[i][k] != 0), None)
        if pivot is None:
            return None
        rows[k], rows[pivot] = rows[pivot], rows[k]
        rows[k] = [x / rows[k][k] for x in rows[k]]
        for i in range(n):
            if i != k and rows[i][k] != 0:
                rows[i] = [x - rows[i][k] * y for x, y in zip(rows[i], rows[k], strict=True)]
    return [row[n] for row in rows]


def mu_by_definition(r: list[list[float]]) -> float:
    """max over v >= 0 of 2 1'v - v'Rv.

    At the maximum R_S v_S = 1 on its support S, where the value is 1'v. A singular R_S adds nothing: along its null
    space the value does not change until an entry of v becomes zero, which is a smaller support.
    """
    n = len(r)
    best = Fraction(0)
    for size in range(1, n + 1):
        for support in itertools.combinations(range(n), size):
            v = solved([[Fraction(r[i][j]) for j in support] for i in support])
            if v is not None and all(x >= 0 for x in v):
                best = max(best, sum(v, Fraction(0)))
    return float(best)


def choquet_by_level_sets(values: Sequence[float], r: list[list[float]]) -> float:
    """The integral over t of mu of {i: value_i >= t}."""
    total, below = 0.0, 0.0
    for level in sorted(set(values)):
        above = [i for i, v in enumerate(values) if v >= level]
        total += (level - below) * mu_by_definition([[r[i][j] for j in above] for i in above])
        below = level
    return total


def lift_by_enumeration(
    found: Sequence[Precursor], strengths: Sequence[float], link: dict[tuple[str, str], float]
) -> float:
    """Every sequence of precursors of distinct kinds, with every choice of onsets that is strictly ordered."""
    best = 0.0
    for size in range(2, len(found) + 1):
        for chain in itertools.permutations(range(len(found)), size):
            if len({found[k].kind for k in chain}) < size:
                continue
            value = sum(
                link.get((found[i].kind, found[j].kind), 0.0) * min(strengths[i], strengths[j])
                for i, j in itertools.pairwise(chain)
            )
            if value > best and any(
                all(a < b for a, b in itertools.pairwise(times))
                for times in itertools.product(*(found[k].onsets_ns for k in chain))
            ):
                best = value
    return best


def correlation(p: RiskParameters, field: str) -> dict[frozenset[str], float]:
    return {frozenset(pair.kinds): getattr(pair, field) for pair in p.correlation}


def reference(p: RiskParameters, found: Sequence[Precursor], field: str = "r", lift: str = "lift") -> float:
    """P* of the definition, with this end of every interval; field "none" is R = I."""
    r_of = {} if field == "none" else correlation(p, field)
    r = [
        [
            1.0 if i == j else 0.0 if a.kind == b.kind else r_of.get(frozenset((a.kind, b.kind)), 0.0)
            for j, b in enumerate(found)
        ]
        for i, a in enumerate(found)
    ]
    strengths = [f.weight * (p.presence + (1.0 - p.presence) * f.severity) for f in found]
    link = {
        (k.first, k.then): (1.0 - r_of.get(frozenset((k.first, k.then)), 0.0)) * getattr(k, lift) for k in p.cascade
    }
    m = choquet_by_level_sets(strengths, r) + p.kappa * lift_by_enumeration(found, strengths, link)
    return LogisticExponential(p.a, p.b, p.c).probability(m, choquet_by_level_sets([f.occurrences for f in found], r))


def independent(p: RiskParameters, found: Sequence[Precursor]) -> float:
    """Eq. 1 on the plain counts."""
    m, q = sum(f.weight for f in found), sum(f.occurrences for f in found)
    return LogisticExponential(p.a, p.b, p.c).probability(m, q)


# ---- what is drawn


@st.composite
def parameters(draw: st.DrawFn, kinds: Sequence[str] = KINDS) -> RiskParameters:
    pairs = []
    for a, b in itertools.combinations(kinds, 2):
        low, r, high = sorted(draw(st.tuples(R, R, R)))
        if high > 0.0:
            pairs.append(Pair((a, b), r, low, high))
    links = []
    for a, b in itertools.permutations(kinds, 2):
        low, lift, high = sorted(draw(st.tuples(*[st.sampled_from([0.0, 0.5, 1.0, 2.0])] * 3)))
        if draw(st.booleans()):
            links.append(Link(a, b, lift, low, high))
    return RiskParameters(
        name="drawn",
        provenance=Provenance("hypothesis"),
        kappa=draw(st.sampled_from([0.0, 0.5, 1.0])),
        presence=draw(st.sampled_from([0.0, 0.5, 1.0])),
        correlation=tuple(pairs),
        cascade=tuple(links),
    )


@st.composite
def precursors(draw: st.DrawFn, most: int = 4) -> list[Precursor]:
    keys = draw(st.lists(st.tuples(st.sampled_from(KINDS), st.sampled_from(["", "left"])), max_size=most, unique=True))
    return [
        precursor(
            kind,
            subject,
            draw(st.sampled_from([0.0, 0.3, 0.7, 1.0])),
            float(draw(st.integers(1, 3))),
            tuple(sorted(draw(st.sets(st.integers(0, 4), min_size=1, max_size=2)))),
            draw(st.sampled_from([0.5, 1.0])),
        )
        for kind, subject in keys
    ]


def precursor(
    kind: str, subject: str, severity: float, occurrences: float, onsets: tuple[int, ...], weight: float = 1.0
) -> Precursor:
    return Precursor(kind, subject, "ongoing", severity, occurrences, weight, onsets[0], "d", onsets_ns=onsets)


# ---- the axioms


@MANY
@given(parameters(), precursors())
def test_p_and_its_bounds_are_what_the_definition_gives(p: RiskParameters, found: list[Precursor]) -> None:
    risk = CorrelatedRisk(p, TAXONOMY).estimate(found)
    if not found:
        assert (risk.probability, risk.lower, risk.upper) == (0.0, 0.0, 0.0)
        return
    assert risk.probability == pytest.approx(reference(p, found), abs=1e-8)
    assert risk.by_mode["A1"] == pytest.approx(risk.probability, abs=1e-12)  # all kinds are tied to A1
    lower = min(reference(p, found, "high", "low"), reference(p, found))
    assert risk.lower == pytest.approx(lower, abs=1e-8)
    upper = max(independent(p, found), reference(p, found, "none", "high"))
    assert risk.upper == pytest.approx(max(upper, reference(p, found)), abs=1e-8)
    assert risk.lower <= risk.probability <= risk.upper


@MANY
@given(parameters(), precursors(), st.data())
def test_no_r_inside_its_interval_gives_more_than_upper_or_less_than_lower(
    p: RiskParameters, found: list[Precursor], data: st.DataObject
) -> None:
    inside = msgspec.structs.replace(
        p,
        correlation=tuple(
            msgspec.structs.replace(k, r=k.low + data.draw(st.sampled_from([0.0, 0.5, 1.0])) * (k.high - k.low))
            for k in p.correlation
        ),
    )
    risk = CorrelatedRisk(p, TAXONOMY).estimate(found)
    other = CorrelatedRisk(inside, TAXONOMY).estimate(found)
    assert risk.lower - 1e-8 <= other.probability <= risk.upper + 1e-8


@MANY
@given(precursors())
def test_no_correlation_and_no_lift_is_eq_1_exactly(found: list[Precursor]) -> None:
    p = RiskParameters(name="none", provenance=Provenance("test"), kappa=0.0)
    full = [msgspec.structs.replace(f, severity=1.0, weight=1.0) for f in found]
    risk = CorrelatedRisk(p, TAXONOMY).estimate(full)
    expected = LogisticExponential().probability(len(full), sum(f.occurrences for f in full)) if full else 0.0
    assert risk.probability == pytest.approx(expected, abs=1e-12)
    assert (risk.lower, risk.upper) == (risk.probability, risk.probability)


@MANY
@given(parameters(KINDS[:3]), precursors(3), st.sampled_from(KINDS[:3]))
def test_a_duplicate_adds_nothing(p: RiskParameters, found: list[Precursor], of: str) -> None:
    """A kind of r = 1 with another, and of the same r with the rest, changes neither m* nor q*."""
    found = [f for f in found if f.kind != KINDS[3] and not f.subject]
    twin = KINDS[3]
    r = {frozenset(k.kinds): k for k in p.correlation}
    pairs = list(p.correlation)
    pairs.append(Pair((of, twin), 1.0, 1.0, 1.0))
    for other in KINDS[:3]:
        k = r.get(frozenset((of, other)))
        if k is not None:
            pairs.append(Pair((twin, other), k.r, k.low, k.high))
    model = CorrelatedRisk(msgspec.structs.replace(p, correlation=tuple(pairs), kappa=0.0), TAXONOMY)
    double = [msgspec.structs.replace(f, kind=twin) for f in found if f.kind == of]
    before, after = model.estimate(found), model.estimate(found + double)
    assert after.m == pytest.approx(before.m, abs=1e-6)
    assert after.q == pytest.approx(before.q, abs=1e-6)


@MANY
@given(parameters(), precursors(), st.data())
def test_more_evidence_never_lowers_p(p: RiskParameters, found: list[Precursor], data: st.DataObject) -> None:
    """A kind, an occurrence, an onset, severity or weight: neither P nor a bound falls, nor that of any mode."""
    model = CorrelatedRisk(p, TAXONOMY)
    before = model.estimate(found)
    grown = []
    for f in found:
        onsets = tuple(sorted({*f.onsets_ns, *data.draw(st.sets(st.integers(0, 4), max_size=1))}))
        severity = max(f.severity, data.draw(st.sampled_from([0.0, 0.5, 1.0])))
        more = float(data.draw(st.integers(0, 2)))
        grown.append(precursor(f.kind, f.subject, severity, f.occurrences + more, onsets, max(f.weight, 0.8)))
    have = {(f.kind, f.subject) for f in found}
    grown += [f for f in data.draw(precursors(2)) if (f.kind, f.subject) not in have]
    after = model.estimate(grown)
    assert after.probability >= before.probability - 1e-8
    assert after.lower >= before.lower - 1e-8
    assert after.upper >= before.upper - 1e-12
    for code, value in before.by_mode.items():
        assert after.by_mode[code] >= value - 1e-8
        assert after.upper_by_mode[code] >= before.upper_by_mode[code] - 1e-12


@MANY
@given(parameters(), precursors())
def test_an_ordered_cascade_weighs_at_least_as_much_as_the_same_kinds_at_once(
    p: RiskParameters, found: list[Precursor]
) -> None:
    model = CorrelatedRisk(p, TAXONOMY)
    at_once = [msgspec.structs.replace(f, onsets_ns=(0,), onset_ns=0) for f in found]
    assert model.estimate(found).probability >= model.estimate(at_once).probability - 1e-12


@MANY
@given(parameters(), precursors(), st.sampled_from([0.9, 0.6, 0.3]))
def test_why(p: RiskParameters, found: list[Precursor], gate: float) -> None:
    """Shares are leave-one-out of the upper bound; the smallest set keeps trust below the gate, no smaller one does."""
    model = CorrelatedRisk(p, TAXONOMY)
    why = model.explain(found, gate, "A1")
    for share in why.attribution:
        rest = [f for f in found if (f.kind, f.subject) != (share.kind, share.subject)]
        assert share.share == pytest.approx(why.probability - model.estimate(rest).upper, abs=1e-12)
    chosen = [f for f in found if (f.kind, f.subject) in why.smallest]
    if 1.0 - why.probability >= gate:
        assert not chosen
        return
    assert 1.0 - model.estimate(chosen).upper < gate
    for size in range(len(chosen)):
        for fewer in itertools.combinations(found, size):
            assert 1.0 - model.estimate(list(fewer)).upper >= gate


@settings(deadline=None)
@given(parameters(), st.lists(precursors(), max_size=6))
def test_what_was_estimated_before_does_not_matter(p: RiskParameters, history: list[list[Precursor]]) -> None:
    model = CorrelatedRisk(p, TAXONOMY)
    for found in history:
        estimate = model.estimate(found)
        assert estimate == CorrelatedRisk(p, TAXONOMY).estimate(found)
        estimate.by_mode["A1"] = 2.0  # whoever writes into one must not move the next


# ---- the paper's case with the shipped parameters

TABLE_3 = load_parameters("table-3", Path(), TAXONOMY)


def test_the_shipped_parameters_are_table_3() -> None:
    links = {(k.first, k.then) for k in TABLE_3.cascade}
    assert links == {
        pair for mode in TAXONOMY.modes for pair in itertools.pairwise(TAXONOMY.kind(k).id for k in mode.cascade)
    }
    assert (TABLE_3.a, TABLE_3.b, TABLE_3.c, TABLE_3.correlation) == (1.6, 2.0, 1.2, ())


def test_the_lift_opens_the_gate_at_the_second_precursor_in_order_only() -> None:
    model = CorrelatedRisk(TABLE_3, TAXONOMY)
    slip = precursor(KINDS[0], "left", 1.0, 1.0, (0,))
    torso = precursor(KINDS[1], "", 1.0, 1.0, (480_000_000,))
    early = precursor(KINDS[1], "", 1.0, 1.0, (-1,))
    # Eq. 1 with m = 2 + 1 and q = 2, and with m = 2: worked out by hand
    in_order = (1.0 - math.exp(-2.4)) / (1.0 + math.exp(-1.6))
    assert model.estimate([slip, torso]).by_mode["A1"] == pytest.approx(in_order, abs=1e-12)
    assert 1.0 - in_order < 0.3
    assert model.estimate([slip, early]).by_mode["A1"] == pytest.approx(0.4546, abs=1e-4)


def test_a_parameter_file_comes_back_as_it_was(tmp_path: Path) -> None:
    p = msgspec.structs.replace(
        TABLE_3, correlation=(Pair((KINDS[0], KINDS[1]), 0.1 + 0.2, 0.1, 0.7),), intervals={"a": (1.0, 2.0)}
    )
    save_parameters(tmp_path / "p.toml", p)
    assert load_parameters("p.toml", tmp_path, TAXONOMY) == p


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ('format = "foreshock-risk-parameters/2"', "format"),
        ("kappa = -1.0", "kappa: -1.0"),
        ("kappa = nan", "kappa: nan"),
        (
            '[[correlation]]\nkinds = ["foot-micro-slp", "torso-angular-spike"]\nr = 0.5\nlow = 0.5\nhigh = 0.5',
            "did you mean 'foot-micro-slip'",
        ),
        (
            '[[correlation]]\nkinds = ["foot-micro-slip", "torso-angular-spike"]\nr = 0.5\nlow = 0.6\nhigh = 0.7',
            "low 0.6 <= r 0.5",
        ),
        (
            '[[cascade]]\nfirst = "foot-micro-slip"\nthen = "foot-micro-slip"\nlift = 1.0\nlow = 0.0\nhigh = 1.0',
            "before itself",
        ),
    ],
)
def test_a_wrong_parameter_file_is_one_error_with_its_place(tmp_path: Path, change: str, said: str) -> None:
    (tmp_path / "p.toml").write_text(
        'name = "x"\n'
        + ("" if change.startswith("[[") else change + "\n")
        + '[provenance]\nsource = "test"\n'
        + (change if change.startswith("[[") else "")
    )
    with pytest.raises(ConfigError, match=r"p\.toml") as e:
        load_parameters("p.toml", tmp_path, TAXONOMY)
    assert said in str(e.value)
