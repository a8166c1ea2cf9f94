"""The taxonomy against the paper's Tables 1 to 3 and section 3.2.2, transcribed here independently."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from foreshock_stage import SLIP, detector, module, play, said

from foreshock.config import Config, DetectorEntry, PolicyEntry, SupervisorSettings
from foreshock.errors import ConfigError, PluginError
from foreshock.registry import Registry
from foreshock.supervisor import Supervisor
from foreshock.taxonomy import PrecursorKind, builtin_taxonomy

TAXONOMY = builtin_taxonomy()

TABLE_1 = """
A1 | Fall onto human | 18 (14.3%)
A2 | Arm/torso strike | 15 (11.9%)
A3 | Leg swing contact | 10 (7.9%)
A4 | Crush/pinch at handover | 12 (9.5%)
A5 | Dropped object/tool | 11 (8.7%)
A6 | Navigation conflict | 9 (7.1%)
A7 | Startle reaction | 8 (6.3%)
A8 | Perception-error motion | 13 (10.3%)
A9 | Control/power fault | 7 (5.6%)
A10 | Tool-related harm | 9 (7.1%)
A11 | Co-carry instability | 8 (6.3%)
A12 | Stop/restart mishap | 6 (4.8%)
"""

TABLE_2 = """
Motion/Balance | A1, A2, A11
Manipulation | A4, A5, A10, A11
Perceptual | A6, A8
Human behavioral | A7, A12
Navigation | A3, A6
System/Telemetry | A9, A12
"""

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

SECTION_3_2_2 = """
Motion/Balance | sway amplitude increase, micro-slip, torso angular spike
Manipulation | grip micro-slip, force oscillation, tilt drift
Perceptual | occlusion, low vision-confidence, ID switching
Human behavioral | rapid reach-in, gaze diversion, posture lowering
Navigation | narrowing clearance, path intersection
System/Telemetry | torque saturation, latency spike, communication delay
"""

FIGURE_2 = {
    "Motion/Balance": 29,
    "Manipulation": 23,
    "Perceptual": 18,
    "Human behavioral": 15,
    "Navigation": 9,
    "System/Telemetry": 6,
}


def rows(table: str) -> list[list[str]]:
    return [[cell.strip() for cell in line.split("|")] for line in table.strip().splitlines()]


def slug(words: str) -> str:
    """The paper's words as a kebab-case name."""
    return re.sub(r"[^a-z0-9]+", "-", words.lower()).strip("-")


def test_table_1_modes_counts_and_shares() -> None:
    wanted = []
    for code, title, figures in rows(TABLE_1):
        n, percent = re.fullmatch(r"(\d+) \(([\d.]+)%\)", figures).groups()
        wanted.append((code, title, int(n), float(percent)))
    assert [(m.code, m.title, m.n, m.percent) for m in TAXONOMY.modes] == wanted
    assert sum(m.n for m in TAXONOMY.modes) == 126
    # each printed percentage is its count's, rounded to one place; their sum is 100 up to that rounding
    for m in TAXONOMY.modes:
        assert m.percent == pytest.approx(100.0 * m.n / 126, abs=0.05 + 1e-9)
    assert sum(m.percent for m in TAXONOMY.modes) == pytest.approx(100.0, abs=12 * 0.05)


def test_table_2_classes_and_their_modes() -> None:
    assert [(c.title, list(c.modes)) for c in TAXONOMY.classes] == [(t, m.split(", ")) for t, m in rows(TABLE_2)]


def test_figure_2_shares_sum_to_100_percent() -> None:
    assert {c.title: round(100 * c.share) for c in TAXONOMY.classes} == FIGURE_2
    assert sum(c.share for c in TAXONOMY.classes) == pytest.approx(1.0, abs=1e-12)


def test_table_3_cascades_in_order() -> None:
    table = rows(TABLE_3)
    assert len(table) * 3 == 36
    names = [slug(cell) for row in table for cell in row[1:]]
    # timing mismatch stands in A4 and A12
    assert len({TAXONOMY.kind(n).id for n in names}) == 35
    for code, *cascade in table:
        assert TAXONOMY.mode(code).cascade == tuple(TAXONOMY.kind(slug(c)).id for c in cascade)


def test_section_3_2_2_examples_and_their_classes() -> None:
    for title, words in rows(SECTION_3_2_2):
        examples = tuple(TAXONOMY.kind(slug(w)).id for w in words.split(","))
        (class_,) = [c for c in TAXONOMY.classes if c.title == title]
        assert class_.examples == examples
        assert {TAXONOMY.class_of(e) for e in examples} == {class_.id}


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("path intersection", "path overlap"),
        ("force oscillation", "grip oscillation"),
        ("micro-slip", "foot micro-slip"),
        ("occlusion", "visual occlusion"),
        ("latency spike", "control latency spike"),
    ],
)
def test_synonyms_of_the_paper_are_one_kind(one: str, other: str) -> None:
    assert TAXONOMY.kind(slug(one)) is TAXONOMY.kind(slug(other))


def test_a_foot_s_slip_is_not_a_grip_s() -> None:
    assert TAXONOMY.kind("micro-slip") is not TAXONOMY.kind("grip-micro-slip")


def test_a_kind_is_tied_to_a_mode_by_its_class_or_a_cascade() -> None:
    by_class = {t: m.split(", ") for t, m in rows(TABLE_2)}
    titles = {c.id: c.title for c in TAXONOMY.classes}
    for kind in TAXONOMY.kinds:
        tied = set(by_class[titles[kind.class_]])
        tied |= {code for code, *cells in rows(TABLE_3) if kind.id in {TAXONOMY.kind(slug(c)).id for c in cells}}
        assert set(TAXONOMY.modes_of(kind.id)) == tied
        for code in TAXONOMY.codes:
            assert (kind.id in TAXONOMY.kinds_of(code)) is (code in tied)


def test_every_name_is_kebab_case_and_every_entry_says_where_it_stands() -> None:
    for entry in (*TAXONOMY.kinds, *TAXONOMY.modes, *TAXONOMY.classes):
        assert slug(entry.id) == entry.id
        assert re.search(r"Table|section|Figure", entry.source)


def test_errors_name_the_nearest() -> None:
    with pytest.raises(ConfigError, match=r"here: unknown precursor kind 'foot-mikro-slip'.*'foot-micro-slip'"):
        TAXONOMY.kind("foot-mikro-slip", "here")
    with pytest.raises(ConfigError, match=r"unknown accident mode 'A13'.*did you mean"):
        TAXONOMY.mode("A13")


KNEE = PrecursorKind("knee-buckling", "Knee buckling", "motion-balance", "the plugin's manual", aliases=("buckling",))


def test_a_plugin_extends_the_taxonomy_and_the_kind_counts() -> None:
    spec = detector("knee", ["buckling"], lambda now: [said("knee-buckling", True, now)])
    config = Config((DetectorEntry("knee"),), policies=(PolicyEntry("paper-gate"),))
    supervisor = Supervisor(config, registry=Registry(modules={"knee": module([spec], precursors=[KNEE])}))
    (d,) = play(supervisor, 1)
    assert [p.kind for p in d.precursors] == ["knee-buckling"]
    # by its class it belongs to A1, A2 and A11
    assert [c for c, p in d.risk.by_mode.items() if p > 0.0] == ["A1", "A2", "A11"]


def test_a_toml_file_extends_the_taxonomy(tmp_path: Path) -> None:
    file = tmp_path / "own.toml"
    file.write_text(
        '[[kinds]]\nid = "knee-buckling"\ntitle = "Knee buckling"\nclass = "motion-balance"\nsource = "ours"\n'
        'modes = ["A3"]\naliases = ["buckling"]\n'
    )
    spec = detector("knee", ["buckling"], lambda now: [said("knee-buckling", True, now)])
    config = Config(
        (DetectorEntry("knee"),),
        supervisor=SupervisorSettings(taxonomy="own.toml"),
        policies=(PolicyEntry("paper-gate"),),
    )
    supervisor = Supervisor(config, tmp_path, Registry(modules={"knee": module([spec])}))
    (d,) = play(supervisor, 1)
    assert [c for c, p in d.risk.by_mode.items() if p > 0.0] == ["A1", "A2", "A3", "A11"]


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ('[[kinds]]\nid = "k"\ntitle = "K"\nclass = "balance"\nsource = "s"\n', "unknown class 'balance'"),
        ('[[kinds]]\nid = "k"\ntitle = "K"\nclass = "navigation"\nsource = "s"\nmodes = ["A99"]\n', "A99"),
        (f'[[kinds]]\nid = "{SLIP}"\ntitle = "K"\nclass = "navigation"\nsource = "s"\n', f"share the name '{SLIP}'"),
        ('[[kinds]]\nid = "k"\ntitle = "K"\nclass = "navigation"\nsource = "s"\naliases = ["reach-in"]\n', "reach-in"),
        ('[[kinds]]\nid = "k"\ntitle = "K"\nclas = "navigation"\nsource = "s"\n', "clas"),
        ('[[kinds]]\nid = "k"\n', "title"),
        ("[[kinds", "own.toml"),
    ],
)
def test_a_bad_extension_is_one_clear_error(tmp_path: Path, text: str, problem: str) -> None:
    file = tmp_path / "own.toml"
    file.write_text(text)
    with pytest.raises(ConfigError, match=problem) as e:
        TAXONOMY.extended_from(file)
    assert "own.toml" in str(e.value)


def test_a_missing_extension_is_named(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"none\.toml"):
        TAXONOMY.extended_from(tmp_path / "none.toml")


def test_two_plugins_cannot_define_one_kind_differently() -> None:
    other = PrecursorKind("knee-buckling", "Other", "navigation", "elsewhere")
    registry = Registry(modules={"a": module(precursors=[KNEE]), "b": module(precursors=[other])})
    registry.load("a")
    registry.load("b")
    with pytest.raises(PluginError, match="knee-buckling"):
        registry.precursors()
