"""Parameter files: what is saved comes back, what is shipped is Table 3, what is wrong is refused with its place."""

from __future__ import annotations

import math
import re
from itertools import pairwise
from pathlib import Path
from typing import Any

import msgspec
import pytest
from brute_force import KINDS
from hypothesis import given, settings
from hypothesis import strategies as st
from stories import TAXONOMY, parameters

from foreshock.errors import ConfigError
from foreshock.records import Precursor
from foreshock.risk import (
    CorrelatedRisk,
    IndependentRisk,
    Link,
    LogisticExponential,
    Pair,
    Provenance,
    RiskParameters,
    RiskSettings,
    load_parameters,
    save_parameters,
)

TABLE_3 = """
A1 | Foot micro-slip | Torso angular spike | Center-of-mass lateral deviation
A2 | Excessive arm velocity | Rapid torso recovery | Human proximity breach
A3 | Swing-leg drift | Path overlap | Narrow shared space
A4 | Timing mismatch | Grip oscillation | Handover occlusion
A5 | Grip micro-slip | Wrist instability | Mass misestimation
A6 | Path convergence | Visual occlusion | High approach speed
A7 | Abrupt motion onset | Unexpected restart | Human inattentiveness
A8 | Confidence collapse | Visual degradation | Limb/tool misclass.
A9 | Torque saturation | Control latency spike | Actuator drift
A10 | Tool-tip oscillation | Unsafe orientation | Loss of tool stability
A11 | Uneven load sharing | Phase mismatch | Grip desync
A12 | Delayed stop | Restart overshoot | Timing mismatch
"""
"""As the paper prints it."""


def table_3() -> list[list[str]]:
    """Kind ids per row."""
    rows = [line.split(" | ")[1:] for line in TABLE_3.strip().splitlines()]
    names = [[re.sub(r"[^a-z0-9]+", "-", cell.lower()).strip("-") for cell in row] for row in rows]
    return [[TAXONOMY.kind(name).id for name in row] for row in names]


def shipped() -> RiskParameters:
    return load_parameters("table-3", Path("no-such-folder"), TAXONOMY)


def risks(p: RiskParameters) -> tuple[float, float, float]:
    """P of the cascade of A1 in its order, with its bounds."""
    found = [
        Precursor(k, "", "ongoing", 1.0, 1.0, 1.0, t * 1_000_000, "d", onsets_ns=(t * 1_000_000,))
        for t, k in enumerate(table_3()[0])
    ]
    risk = CorrelatedRisk(p, TAXONOMY).estimate(found)
    return risk.lower, risk.probability, risk.upper


# ---- what is shipped


def test_the_shipped_parameters_are_the_consecutive_pairs_of_table_3() -> None:
    rows = table_3()
    assert len(rows) == 12
    expected = {step for row in rows for step in pairwise(row)}
    assert len(expected) == 24
    found = shipped()
    assert sorted((x.first, x.then) for x in found.cascade) == sorted(expected)
    assert found.correlation == ()
    assert (found.a, found.b, found.c) == (1.6, 2.0, 1.2)
    assert found.window_s == 1.5
    assert found.horizon_s == 0.0  # nothing was calibrated
    for x in found.cascade:
        assert 0.0 <= x.low <= x.lift <= x.high
        assert x.lift > 0.0


def test_the_shipped_parameters_are_table_3_by_name_only() -> None:
    with pytest.raises(ConfigError, match=r"table-4.*table-3"):
        load_parameters("table-4", Path("no-such-folder"), TAXONOMY)


def test_the_cascade_of_a1_raises_p_above_table_4_and_its_bounds_hold_the_paper_s() -> None:
    low, p, upper = risks(shipped())
    independent = LogisticExponential().of_counts(3.0, 3.0)
    assert low <= independent <= p <= upper
    assert p > independent


# ---- round trips


@settings(max_examples=200, deadline=None)
@given(
    parameters(),
    st.dictionaries(st.sampled_from(["a", "b", "c", "kappa"]), st.tuples(st.floats(0.0, 1.0), st.floats(1.0, 3.0))),
    st.text(st.characters(exclude_categories=["Cs"]), max_size=20),
    st.floats(0.1, 10.0),
    st.booleans(),
)
def test_a_file_gives_back_what_was_saved(
    tmp_path_factory: pytest.TempPathFactory,
    p: RiskParameters,
    intervals: dict[str, tuple[float, float]],
    text: str,
    number: float,
    synthetic: bool,
) -> None:
    source = Provenance(
        source=text, created="2026-11-25", command='a --b="c"', data=("x.csv", text), synthetic=synthetic, note=text
    )
    saved = msgspec.structs.replace(
        p, name="of-a-test", provenance=source, window_s=number, horizon_s=number, intervals=intervals
    )
    folder = tmp_path_factory.mktemp("parameters")
    save_parameters(folder / "mine.toml", saved)
    assert load_parameters("mine.toml", folder, TAXONOMY) == saved
    assert load_parameters(str(folder / "mine.toml"), Path("elsewhere"), TAXONOMY) == saved


def test_a_file_in_a_folder_below_and_the_shipped_set_saved_anew(tmp_path: Path) -> None:
    (tmp_path / "fits").mkdir()
    save_parameters(tmp_path / "fits" / "mine.toml", shipped())
    assert load_parameters("fits/mine.toml", tmp_path, TAXONOMY) == shipped()


def test_a_file_beside_the_configuration_may_leave_out_all_that_has_a_default(tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text('name = "mine"\n[provenance]\nsource = "a test"\n')
    assert load_parameters("mine.toml", tmp_path, TAXONOMY) == RiskParameters(
        name="mine", provenance=Provenance(source="a test")
    )


def test_aliases_are_resolved_to_ids(tmp_path: Path) -> None:
    saved = RiskParameters(
        name="mine",
        provenance=Provenance(source="a test"),
        correlation=(Pair(kinds=("micro-slip", "com-deviation"), r=0.5, low=0.4, high=0.6),),
        cascade=(Link(first="micro-slip", then="com-deviation", lift=1.0, low=0.0, high=2.0),),
    )
    save_parameters(tmp_path / "mine.toml", saved)
    found = load_parameters("mine.toml", tmp_path, TAXONOMY)
    assert set(found.correlation[0].kinds) == {"foot-micro-slip", "com-lateral-deviation"}
    assert (found.cascade[0].first, found.cascade[0].then) == ("foot-micro-slip", "com-lateral-deviation")


def test_the_matrix_is_symmetric_with_ones_on_its_diagonal_and_zero_where_no_pair_is_named() -> None:
    p = RiskParameters(
        name="mine",
        provenance=Provenance(source="a test"),
        correlation=(Pair(kinds=(KINDS[2], KINDS[0]), r=0.5, low=0.4, high=0.6),),
    ).check(TAXONOMY, "a test")
    assert p.matrix(list(KINDS[:3])).tolist() == [[1.0, 0.0, 0.5], [0.0, 1.0, 0.0], [0.5, 0.0, 1.0]]


# ---- bad files

GOOD = """
name = "mine"
format = "foreshock-risk-parameters/1"
a = 1.6
kappa = 1.0
presence = 0.5
window_s = 1.5

[provenance]
source = "a test"

[intervals]
a = [1.0, 2.0]

[[correlation]]
kinds = ["foot-micro-slip", "torso-angular-spike"]
r = 0.5
low = 0.4
high = 0.6

[[correlation]]
kinds = ["torso-angular-spike", "grip-micro-slip"]
r = 0.25
low = 0.2
high = 0.3

[[cascade]]
first = "foot-micro-slip"
then = "torso-angular-spike"
lift = 1.5
low = 1.0
high = 2.0
"""
TWICE = (
    '[[correlation]]\nkinds = ["grip-micro-slip", "torso-angular-spike"]\nr = 0.1\nlow = 0.1\nhigh = 0.1\n\n[[cascade]]'
)
TWICE_BY_ALIAS = TWICE.replace("grip-micro-slip", "micro-slip")
LINK_TWICE = """[[cascade]]
first = "foot-micro-slip"
then = "torso-angular-spike"
lift = 1.0
low = 1.0
high = 1.0

[[cascade]]"""
CORRELATED = GOOD[GOOD.index("r = 0.5") : GOOD.index("\n\n[[cascade]]")]
INDEFINITE = (
    CORRELATED.replace("r = 0.5", "r = 0.9").replace("0.6", "1.0").replace("r = 0.25", "r = 0.9").replace("0.3", "1.0")
)
"""foot - torso - grip with 0.9, 0.9 and 0: 1 - 0.9 sqrt 2 < 0 is an eigenvalue."""
BAD: dict[str, tuple[str, str, list[str]]] = {
    "unknown kind": (
        '"grip-micro-slip"',
        '"grip-micro-slop"',
        ["correlation", "'grip-micro-slop'", "'grip-micro-slip'"],
    ),
    "unknown kind in a cascade": (
        'first = "foot',
        'first = "food',
        ["cascade", "food-micro-slip", "'foot-micro-slip'"],
    ),
    "r above 1": ("r = 0.5\nlow = 0.4\nhigh = 0.6", "r = 1.5\nlow = 0.4\nhigh = 1.6", ["correlation", "1.5"]),
    "r below 0": ("r = 0.5\nlow = 0.4", "r = -0.5\nlow = -0.6", ["correlation", "-0.5"]),
    "low above r": ("low = 0.4", "low = 0.55", ["correlation", "0.55"]),
    "high below r": ("high = 0.6", "high = 0.45", ["correlation", "0.45"]),
    "high above 1": ("high = 0.6", "high = 1.25", ["correlation", "1.25"]),
    "r is NaN": ("r = 0.5", "r = nan", ["correlation", "nan"]),
    "low is NaN": ("low = 0.4", "low = nan", ["correlation", "nan"]),
    "high is NaN": ("high = 0.6", "high = nan", ["correlation", "nan"]),
    "r is text": ("r = 0.5", 'r = "0.5"', ["correlation", "0.5"]),
    "pair twice": ("[[cascade]]", TWICE, ["correlation", "grip-micro-slip", "torso-angular-spike"]),
    "pair twice by its alias": ("[[cascade]]", TWICE_BY_ALIAS, ["correlation", "micro-slip", "torso-angular-spike"]),
    "pair of one kind": (
        '"foot-micro-slip", "torso',
        '"torso-angular-spike", "torso',
        ["correlation", "torso-angular-spike"],
    ),
    "pair of one kind by its alias": ('"torso-angular-spike"]', '"micro-slip"]', ["correlation", "micro-slip"]),
    "no correlation matrix": (CORRELATED, INDEFINITE, ["correlation"]),
    "lift below 0": ("lift = 1.5\nlow = 1.0", "lift = -1.5\nlow = -2.0", ["cascade", "-1.5"]),
    "lift above high": ("lift = 1.5", "lift = 2.5", ["cascade", "2.5"]),
    "lift below low": ("lift = 1.5", "lift = 0.5", ["cascade", "0.5"]),
    "lift is NaN": ("lift = 1.5", "lift = nan", ["cascade", "nan"]),
    "lift without end": ("high = 2.0", "high = inf", ["cascade", "inf"]),
    "link twice": ("[[cascade]]", LINK_TWICE, ["cascade", "foot-micro-slip", "torso-angular-spike"]),
    "link to itself": ('then = "torso-angular-spike"', 'then = "foot-micro-slip"', ["cascade", "foot-micro-slip"]),
    "another format": ("parameters/1", "parameters/2", ["format", "foreshock-risk-parameters/2"]),
    "gain of 0": ("a = 1.6", "a = 0.0", ["a", "0.0"]),
    "gain of NaN": ("a = 1.6", "a = nan", ["a", "nan"]),
    "kappa below 0": ("kappa = 1.0", "kappa = -1.0", ["kappa", "-1.0"]),
    "kappa is NaN": ("kappa = 1.0", "kappa = nan", ["kappa", "nan"]),
    "presence above 1": ("presence = 0.5", "presence = 1.5", ["presence", "1.5"]),
    "presence is NaN": ("presence = 0.5", "presence = nan", ["presence", "nan"]),
    "window of 0": ("window_s = 1.5", "window_s = 0.0", ["window_s", "0.0"]),
    "window of NaN": ("window_s = 1.5", "window_s = nan", ["window_s", "nan"]),
    "misspelt field": ("kappa = 1.0", "kapa = 1.0", ["kapa", "kappa"]),
    "no provenance": ('[provenance]\nsource = "a test"', "", ["provenance"]),
    "no toml": ("[intervals]", "[intervals", []),
}


@pytest.mark.parametrize("name", BAD)
def test_a_bad_file_is_one_error_that_names_its_place(name: str, tmp_path: Path) -> None:
    old, new, named = BAD[name]
    assert old in GOOD
    (tmp_path / "mine.toml").write_text(GOOD.replace(old, new, 1))
    with pytest.raises(ConfigError) as refused:
        load_parameters("mine.toml", tmp_path, TAXONOMY)
    message = str(refused.value)
    for part in ["mine.toml", *named]:
        assert part in message
    assert "\n" not in message.strip()


def test_the_file_that_all_of_these_are_made_from_is_good(tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text(GOOD)
    found = load_parameters("mine.toml", tmp_path, TAXONOMY)
    assert (found.presence, len(found.correlation), len(found.cascade)) == (0.5, 2, 1)
    assert found.intervals == {"a": (1.0, 2.0)}


def test_the_pair_that_is_out_of_range_is_named_by_its_number(tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text(GOOD.replace("low = 0.2", "low = 0.27"))
    with pytest.raises(ConfigError, match=r"correlation\[1\]"):
        load_parameters("mine.toml", tmp_path, TAXONOMY)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"mine\.toml"):
        load_parameters("mine.toml", tmp_path, TAXONOMY)


def test_a_folder_and_a_file_of_bytes_are_refused(tmp_path: Path) -> None:
    (tmp_path / "folder.toml").mkdir()
    (tmp_path / "bytes.toml").write_bytes(b'name = "\xff\xfe"\x00')
    for name in ("folder.toml", "bytes.toml"):
        with pytest.raises(ConfigError, match=re.escape(name)):
            load_parameters(name, tmp_path, TAXONOMY)


@pytest.mark.parametrize("r", [0.0, 0.5, 1.0])
def test_singular_matrices_are_correlation_matrices(r: float) -> None:
    """Three kinds of which two are duplicates."""
    pairs = [
        Pair(kinds=(KINDS[0], KINDS[1]), r=1.0, low=1.0, high=1.0),
        Pair(kinds=(KINDS[0], KINDS[2]), r=r, low=r, high=r),
        Pair(kinds=(KINDS[1], KINDS[2]), r=r, low=r, high=r),
    ]
    p = RiskParameters(name="mine", provenance=Provenance(source="a test"), correlation=tuple(pairs))
    assert p.check(TAXONOMY, "a test").correlation == tuple(pairs)


def test_kinds_of_a_plugin_are_known_once_the_taxonomy_has_them() -> None:
    kind = msgspec.structs.replace(TAXONOMY.kind(KINDS[0]), id="ankle-buzz", aliases=())
    p = RiskParameters(
        name="mine",
        provenance=Provenance(source="a test"),
        correlation=(Pair(kinds=("ankle-buzz", KINDS[0]), r=0.5, low=0.5, high=0.5),),
    )
    assert p.check(TAXONOMY.extended([kind]), "here").correlation[0].r == 0.5
    with pytest.raises(ConfigError, match=r"here.*ankle-buzz"):
        p.check(TAXONOMY, "here")


# ---- settings


@pytest.mark.parametrize(
    ("fields", "place"),
    [
        ({"parameters": "table-3"}, "risk.parameters"),
        ({"kappa": 1.0}, "risk.kappa"),
        ({"presence": 0.5}, "risk.presence"),
        ({"model": "correlated", "parameters": "table-3", "kappa": -1.0}, "risk.kappa"),
        ({"model": "correlated", "parameters": "table-3", "kappa": math.nan}, "risk.kappa"),
        ({"model": "correlated", "parameters": "table-3", "presence": 1.5}, "risk.presence"),
        ({"model": "correlated", "parameters": "table-3", "presence": math.nan}, "risk.presence"),
        ({"a": 0.0}, "risk.a"),
        ({"a": math.nan}, "risk.a"),
        ({"b": math.inf}, "risk.b"),
        ({"c": -1.0}, "risk.c"),
    ],
)
def test_settings_out_of_range_or_of_another_model_are_refused(fields: dict[str, Any], place: str) -> None:
    with pytest.raises(ConfigError, match=re.escape(place)):
        RiskSettings(**fields)


def test_settings_give_the_model_that_they_name(tmp_path: Path) -> None:
    independent = RiskSettings(b=3.0).build(tmp_path, TAXONOMY, 1.0)
    assert isinstance(independent, IndependentRisk)
    one = [Precursor(KINDS[0], "", "ongoing", 1.0, 1.0, 1.0, 0, "d")]
    assert independent.estimate(one).probability == pytest.approx(
        LogisticExponential(b=3.0).of_counts(1.0, 1.0), abs=1e-12
    )
    correlated = RiskSettings(model="correlated", parameters="table-3").build(tmp_path, TAXONOMY, 1.5)
    assert isinstance(correlated, CorrelatedRisk)
    assert correlated.estimate(one).probability == pytest.approx(LogisticExponential().of_counts(1.0, 1.0), abs=1e-12)


def test_what_the_settings_give_stands_instead_of_what_the_file_says(tmp_path: Path) -> None:
    save_parameters(tmp_path / "mine.toml", shipped())
    same = RiskSettings(model="correlated", parameters="mine.toml").loaded(tmp_path, TAXONOMY)
    assert same == shipped()
    changed = RiskSettings(model="correlated", parameters="mine.toml", a=1.0, b=3.0, c=2.0, kappa=0.0, presence=0.25)
    found = changed.loaded(tmp_path, TAXONOMY)
    assert (found.a, found.b, found.c, found.kappa, found.presence) == (1.0, 3.0, 2.0, 0.0, 0.25)
    assert found.cascade == shipped().cascade


CALIBRATED = RiskParameters(
    name="fit", provenance=Provenance(source="a campaign", synthetic=True), window_s=1.0, horizon_s=2.0
)


def test_calibrated_parameters_hold_for_their_window_only(tmp_path: Path) -> None:
    save_parameters(tmp_path / "fit.toml", CALIBRATED)
    settings_ = RiskSettings(model="correlated", parameters="fit.toml")
    settings_.build(tmp_path, TAXONOMY, 1.0)
    for window_s in (1.5, 0.5):
        with pytest.raises(ConfigError) as refused:
            settings_.build(tmp_path, TAXONOMY, window_s)
        for part in ("window", "fit", "1.0", str(window_s)):
            assert part in str(refused.value)


def test_parameters_that_were_not_calibrated_hold_for_any_window(tmp_path: Path) -> None:
    for window_s in (0.5, 1.0, 1.5):
        RiskSettings(model="correlated", parameters="table-3").build(tmp_path, TAXONOMY, window_s)


def test_a_file_that_does_not_fit_is_refused_by_the_settings_too(tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text(GOOD.replace("grip-micro-slip", "grip-micro-slop"))
    with pytest.raises(ConfigError, match=r"mine\.toml.*grip-micro-slop.*grip-micro-slip"):
        RiskSettings(model="correlated", parameters="mine.toml").build(tmp_path, TAXONOMY, 1.5)
    with pytest.raises(ConfigError, match=r"none\.toml"):
        RiskSettings(model="correlated", parameters="none.toml").build(tmp_path, TAXONOMY, 1.5)
