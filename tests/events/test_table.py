"""Tables of events: what is read back is what was written, and a bad row is named and costs no good one."""

from __future__ import annotations

import tempfile
from pathlib import Path

import msgspec
import pyarrow as pa
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pyarrow import parquet

from foreshock.errors import BadInputError
from foreshock.events import DEVIATIONS, TASKS, Event, EventPrecursor, read_events, write_events
from foreshock.taxonomy import builtin_taxonomy
from tests.events.build import event

TAXONOMY = builtin_taxonomy()
GOOD = {
    "id": "video-7",
    "task": "handover",
    "platform": "Digit",
    "environment": "laboratory",
    "spatial_relation": "face to face",
    "deviation": "kinematic;perceptual",
    "precursors": "foot-micro-slip@0.00-1.20*0.8[left-foot];torso-angular-spike@0.48",
    "escalation": "slip, then spike",
    "outcome": "A1",
    "outcome_s": "1.9",
    "observed_s": "3",
    "coder": "anna",
}


def csv_of(path: Path, *rows: dict[str, str]) -> Path:
    names = list(dict.fromkeys(name for row in rows for name in row))
    lines = [",".join(names), *(",".join('"' + row.get(n, "").replace('"', '""') + '"' for n in names) for row in rows)]
    path.write_text("\n".join(lines) + "\n")
    return path


def parquet_of(path: Path, *rows: dict) -> Path:
    parquet.write_table(pa.Table.from_pylist(list(rows)), path)
    return path


def test_the_nine_tasks_are_the_paper_s() -> None:
    words = (
        "assembly, inspection, logistics, maintenance, fastening, handover, navigation, co-carrying, balance recovery"
    )
    assert tuple(w.replace(" ", "-") for w in words.split(", ")) == TASKS


def test_a_row_is_read_as_it_says(tmp_path: Path) -> None:
    table = read_events(csv_of(tmp_path / "a.csv", GOOD), TAXONOMY)
    slip = EventPrecursor("foot-micro-slip", 0.0, 1.2, 0.8, "left-foot")
    spike = EventPrecursor("torso-angular-spike", 0.48)
    assert table.problems == ()
    assert table.events == (
        Event(
            "video-7",
            "handover",
            "Digit",
            "laboratory",
            "face to face",
            ("kinematic", "perceptual"),
            (slip, spike),
            "slip, then spike",
            "A1",
            1.9,
            3.0,
            "anna",
            "video-7",
            "",
        ),
    )


def test_names_are_taken_as_people_write_them(tmp_path: Path) -> None:
    row = GOOD | {
        "task": "Balance recovery",
        "deviation": "Human-behavioral",
        "precursors": "Micro-slip@0.1; Path intersection@0.2",
        "outcome": "fall-onto-human",
    }
    (read,) = read_events(csv_of(tmp_path / "a.csv", row), TAXONOMY).events
    assert (read.task, read.deviation, read.outcome) == ("balance-recovery", ("human-behavioural",), "A1")
    assert [p.kind for p in read.precursors] == ["foot-micro-slip", "path-overlap"]  # Tables 2 and 3 name both


BAD = [
    (
        {"precursors": "foot-micro-slp@0.1"},
        "precursors",
        "unknown kind 'foot-micro-slp'; did you mean 'foot-micro-slip",
    ),
    ({"precursors": "foot-micro-slip@-0.1"}, "precursors", "onset -0.1 is negative"),
    ({"precursors": "foot-micro-slip@0.5-0.2"}, "precursors", "end 0.2 s is before its onset, 0.5 s"),
    ({"precursors": "foot-micro-slip@0.5*1.5"}, "precursors", "severity 1.5 is not within 0..1"),
    ({"precursors": "foot-micro-slip@2.5"}, "precursors", "onset 2.5 s is after the outcome, 1.9 s"),
    ({"precursors": "foot-micro-slip@0.5-3.5"}, "precursors", "end 3.5 s is after the end of observation, 3 s"),
    ({"precursors": "foot-micro-slip 0.5"}, "precursors", "is not kind@onset-end*severity[subject]"),
    ({"precursors": "foot-micro-slip@0,5"}, "precursors", "is not kind@onset-end*severity[subject]"),
    ({"outcome": ""}, "outcome", "missing"),
    ({"outcome": "A13"}, "outcome", "unknown accident mode 'A13'; did you mean"),
    ({"outcome": "none"}, "outcome_s", "1.9 s, but the outcome is 'none'"),
    ({"outcome_s": ""}, "outcome_s", "missing; when did A1 happen?"),
    ({"outcome_s": "-1"}, "outcome_s", "-1 is negative"),
    ({"outcome_s": "4"}, "outcome_s", "4 s is after the end of observation, 3 s"),
    ({"observed_s": ""}, "observed_s", "missing"),
    ({"observed_s": "soon"}, "observed_s", "'soon' is not a finite number"),
    ({"observed_s": "nan"}, "observed_s", "'nan' is not a finite number"),
    ({"task": "hand-over"}, "task", "did you mean 'handover'"),
    ({"task": ""}, "task", "missing"),
    ({"deviation": "kinematik"}, "deviation", "did you mean 'kinematic'"),
    ({"deviation": "kinematic;kinematic"}, "deviation", "stands there twice"),
    ({"id": ""}, "id", "missing"),
    ({"coder": " "}, "coder", "missing"),
    ({"id": "first"}, "id", "'first' by coder 'anna' stands in row 2 already"),
    ({"id": "synthetic-1", "source": "coded"}, "source", "needs the source 'synthetic'"),
]


@pytest.mark.parametrize(("change", "column", "message"), BAD)
def test_a_bad_row_is_named_and_costs_no_good_one(
    change: dict[str, str], column: str, message: str, tmp_path: Path
) -> None:
    rows = (GOOD | {"id": "first", "source": ""}, GOOD | change, GOOD | {"id": "last"})
    table = read_events(csv_of(tmp_path / "a.csv", *rows), TAXONOMY)
    assert [e.id for e in table.events] == ["first", "last"]
    assert [(p.row, p.column) for p in table.problems] == [(3, column)]
    assert message in table.problems[0].message
    assert str(table.problems[0]).startswith(f"row 3, {column}: ")


def test_all_problems_of_a_row_are_listed(tmp_path: Path) -> None:
    row = GOOD | {"task": "x", "outcome": "", "precursors": "a@1;foot-micro-slip@-1", "observed_s": "0"}
    table = read_events(csv_of(tmp_path / "a.csv", row), TAXONOMY)
    assert sorted(p.column for p in table.problems) == ["observed_s", "outcome", "precursors", "precursors", "task"]
    assert {p.value for p in table.problems if p.column == "precursors"} == {"a", "-1.0"}


def test_two_codings_of_one_event_are_no_duplicate(tmp_path: Path) -> None:
    table = read_events(csv_of(tmp_path / "a.csv", GOOD, GOOD | {"coder": "ben"}), TAXONOMY)
    assert table.problems == ()
    assert [e.coder for e in table.events] == ["anna", "ben"]


def test_parquet_rows_are_checked_alike(tmp_path: Path) -> None:
    slip = {"kind": "micro-slip", "onset_s": 0.5, "end_s": None, "severity": None, "subject": None}
    row = GOOD | {"deviation": ["kinematic"], "precursors": [slip], "outcome_s": 1.9, "observed_s": 3.0}
    bad = row | {"id": "two", "precursors": [slip | {"onset_s": -0.5}], "outcome": None}
    table = read_events(parquet_of(tmp_path / "a.parquet", row, bad, row), TAXONOMY)
    assert table.events[0].precursors == (EventPrecursor("foot-micro-slip", 0.5),)
    assert [(p.row, p.column) for p in table.problems] == [(2, "outcome"), (2, "precursors"), (3, "id")]


@pytest.mark.parametrize("column", ["deviation", "precursors", "platform"])
def test_a_parquet_column_of_the_wrong_type_is_a_problem(column: str, tmp_path: Path) -> None:
    row = GOOD | {"deviation": ["kinematic"], "precursors": [], "outcome_s": 1.9, "observed_s": 3.0, column: 7}
    table = read_events(parquet_of(tmp_path / "a.parquet", row), TAXONOMY)
    assert [(p.row, p.column, p.value) for p in table.problems] == [(1, column, "7")]


def test_rows_are_numbered_as_a_spreadsheet_does(tmp_path: Path) -> None:
    file = csv_of(tmp_path / "a.csv", GOOD, GOOD | {"id": "b", "escalation": "two\nlines"}, GOOD | {"task": "x"})
    head, *rest = file.read_text().split("\n")
    file.write_text("\ufeff" + "\r\n".join([head, "", *rest]), newline="")  # as spreadsheets export, with a blank row
    table = read_events(file, TAXONOMY)
    assert len(table.events) == 2
    assert table.problems[0].row == 5


def test_what_is_not_csv_costs_its_row_only(tmp_path: Path) -> None:
    file = csv_of(tmp_path / "a.csv", GOOD, GOOD | {"id": "b"}, GOOD | {"id": "c"}, GOOD | {"id": "d"})
    lines = file.read_text().split("\n")
    lines[2] = lines[2].replace('"b"', '"b"x')
    lines[3] += ',"one more"'
    file.write_text("\n".join(lines))
    table = read_events(file, TAXONOMY)
    assert [e.id for e in table.events] == ["video-7", "d"]
    assert [(p.row, p.column) for p in table.problems] == [(3, ""), (4, "")]
    assert "lines 3 to 3" in table.problems[0].message
    assert "13 cells for 12 columns" in table.problems[1].message


def test_an_unknown_column_is_said(tmp_path: Path) -> None:
    table = read_events(csv_of(tmp_path / "a.csv", GOOD | {"grup": "x"}), TAXONOMY)
    assert len(table.events) == 1
    assert [(p.row, p.column) for p in table.problems] == [(1, "grup")]
    assert "did you mean 'group'" in table.problems[0].message


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.csv", b"", "has no header"),
        ("a.csv", b"id;task;platform\n", "separated by semicolons"),
        ("a.csv", b"id,id\n", "has the column 'id' twice"),
        ("a.csv", b"id,taks,platform\n", "has no column 'task'; did you mean 'taks'"),
        ("a.csv", b"id\xff", "not UTF-8"),
        ("a.parquet", b"PAR1 no", "not a Parquet file"),
        ("a.xlsx", b"", "unknown suffix '.xlsx'"),
    ],
)
def test_a_file_that_is_no_table_is_one_error(name: str, content: bytes, message: str, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(BadInputError, match=message):
        read_events(tmp_path / name, TAXONOMY)


def test_a_missing_file_names_its_neighbours(tmp_path: Path) -> None:
    csv_of(tmp_path / "events.csv", GOOD)
    with pytest.raises(BadInputError, match=r"No such file.*did you mean 'events.csv'"):
        read_events(tmp_path / "event.csv", TAXONOMY)


times = st.floats(0, 5, allow_subnormal=True)
words = st.text(st.characters(codec="utf-8", exclude_characters="\0"), max_size=12)
subjects = words.filter(lambda s: not set(s) & set("[];\r\n"))


@st.composite
def codings(draw: st.DrawFn) -> Event:
    until = draw(st.floats(5, 10))
    accident = draw(st.booleans())
    precursors = []
    for kind in draw(st.lists(st.sampled_from([k.id for k in TAXONOMY.kinds]), max_size=4)):
        onset, end = sorted([draw(times), draw(times)])
        severity = draw(st.floats(0, 1))
        precursors.append(EventPrecursor(kind, onset, draw(st.sampled_from([None, end])), severity, draw(subjects)))
    return Event(
        draw(words.filter(str.strip)),
        draw(st.sampled_from(TASKS)),
        *(draw(words) for _ in range(3)),
        tuple(draw(st.lists(st.sampled_from(DEVIATIONS), unique=True))),
        tuple(precursors),
        draw(words),
        draw(st.sampled_from(TAXONOMY.codes)) if accident else "none",
        until if accident else None,
        until + draw(times),
        draw(words.filter(str.strip)),
        draw(words),
        "synthetic",
    )


@settings(max_examples=40)
@given(st.lists(codings(), max_size=4, unique_by=lambda e: (e.id, e.coder)))
def test_csv_and_parquet_round_trips_are_exact(events: list[Event]) -> None:
    with tempfile.TemporaryDirectory() as folder:
        first, second, third = (Path(folder) / name for name in ("a.csv", "b.parquet", "c.csv"))
        write_events(first, events)
        once = read_events(first, TAXONOMY)
        write_events(second, once.events)
        twice = read_events(second, TAXONOMY)
        write_events(third, twice.events)
        assert once.problems == twice.problems == ()
        assert list(once.events) == list(twice.events) == events
        assert first.read_bytes() == third.read_bytes()


def test_parquet_says_how_many_are_synthetic(tmp_path: Path) -> None:
    events = [event("synthetic-1", "A1", source="synthetic"), event("real")]
    write_events(tmp_path / "a.parquet", events)
    write_events(tmp_path / "b.parquet", events[1:])
    assert parquet.read_schema(tmp_path / "a.parquet").metadata == {
        b"foreshock.synthetic": b"1 of 2 rows are synthetic"
    }
    assert not parquet.read_schema(tmp_path / "b.parquet").metadata
    table = parquet.read_table(tmp_path / "a.parquet").drop_columns(["source"])
    parquet.write_table(table, tmp_path / "c.parquet")
    assert {e.source for e in read_events(tmp_path / "c.parquet", TAXONOMY).events} == {"synthetic"}


@pytest.mark.parametrize("bad", [EventPrecursor("a;b", 0.0), EventPrecursor("a", 0.0, None, 1.0, "x]")])
def test_what_a_cell_cannot_say_is_refused(bad: EventPrecursor, tmp_path: Path) -> None:
    odd = msgspec.structs.replace(event("e"), precursors=(bad,))
    for name in ("a.csv", "a.parquet"):
        with pytest.raises(BadInputError, match="e of anna: precursors"):
            write_events(tmp_path / name, [odd])
        assert not (tmp_path / name).exists()
