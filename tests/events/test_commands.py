"""``foreshock events`` from a shell: what it prints, and the exit codes."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import click
import pytest
from click.testing import CliRunner, Result

from foreshock.cli.events_cmd import events
from foreshock.errors import BadInputError, MissingExtraError
from foreshock.events import read_events
from foreshock.taxonomy import builtin_taxonomy


def run(*words: object) -> Result:
    return CliRunner().invoke(events, [str(w) for w in words], standalone_mode=False)


def answer(*words: object) -> tuple[int, dict]:
    done = run(*words, "--json")
    assert done.exception is None, done.exception
    return done.return_value or 0, json.loads(done.stdout)["result"]


@pytest.fixture
def table(tmp_path: Path) -> Path:
    path = tmp_path / "events.csv"
    assert run("generate", "--seed", 1, "--n", 4, "--out", path).exception is None
    return path


@pytest.fixture
def broken(table: Path) -> Path:
    lines = table.read_text().splitlines(keepends=True)
    path = table.with_name("broken.csv")
    path.write_text("".join([*lines[:3], lines[3].replace("@", "@-"), *lines[4:], lines[1]]))
    return path


def test_generate_says_synthetic(tmp_path: Path) -> None:
    done = run("generate", "--seed", 1, "--n", 4, "--near-misses", 2, "--out", tmp_path / "deep" / "a.parquet")
    assert "SYNTHETIC" in done.stdout
    code, result = answer("generate", "--seed", 1, "--n", 4, "--out", tmp_path / "a.csv")
    assert code == 0
    assert (result["rows"], result["events"], result["accidents"], result["synthetic"]) == (8, 4, 4, 4)


def test_check_lists_row_and_column_and_exits_1(table: Path, broken: Path) -> None:
    assert answer("check", table) == (0, {"file": str(table), "rows": 8, "problems": []})
    code, result = answer("check", broken)
    assert code == 1
    assert result["rows"] == 7
    assert [(p["row"], p["column"]) for p in result["problems"]][-1] == (10, "id")
    assert {(p["row"], p["column"]) for p in result["problems"][:-1]} == {(4, "precursors")}
    done = run("check", broken)
    assert "row 4, precursors: precursor 1 (" in done.stdout
    assert " is negative" in done.stdout
    assert "7 good rows" in done.stdout


def test_convert_keeps_the_good_rows(table: Path, broken: Path, tmp_path: Path) -> None:
    code, result = answer("convert", table, tmp_path / "a.parquet")
    assert (code, result["problems"]) == (0, [])
    taxonomy = builtin_taxonomy()
    assert read_events(tmp_path / "a.parquet", taxonomy) == read_events(table, taxonomy)
    code, result = answer("convert", broken, tmp_path / "b.parquet")
    assert (code, result["rows"]) == (1, 7)
    assert len(read_events(tmp_path / "b.parquet", taxonomy).events) == 7


def test_analyse_prints_and_writes_a_report(broken: Path, tmp_path: Path) -> None:
    done = run("analyse", broken, "--out", tmp_path / "report.html")
    assert done.exception is None, done.exception
    assert "SYNTHETIC: Accident modes beside Table 1" in done.stdout
    assert "left out: row 4, precursors" in done.stderr
    assert "SYNTHETIC" in (tmp_path / "report.html").read_text()
    code, result = answer("analyse", broken)
    assert code == 0
    assert (result["analysis"]["rows"], result["analysis"]["events"]) == (7, 4)
    assert {p["row"] for p in result["problems"]} == {4, 10}


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("check", "nowhere.csv"), "nowhere.csv: No such file"),
        (("generate", "--seed", 1, "--out", "a.xlsx"), "unknown suffix '.xlsx'; known: .csv, .parquet"),
        (("convert", "same.csv", "same.csv"), "is the table that is read"),
        (("record", "a1-fall-onto-humn", "--seeds", "0:1", "--out", "a.csv"), "did you mean 'a1-fall-onto-human'"),
    ],
)
def test_bad_input_is_one_error(words: tuple, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    done = run(*words)
    assert isinstance(done.exception, BadInputError)
    assert message in str(done.exception)


@pytest.mark.parametrize(
    ("option", "value", "message"),
    [
        ("--seeds", "5", "is not FIRST:END"),
        ("--seeds", "5:5", "is not FIRST:END"),
        ("--vary", "drop_mu=1", "is not NAME=LOW:HIGH"),
        ("--vary", "0.1:0.2", "is not NAME=LOW:HIGH"),
        ("--vary", "=0.1:0.2", "is not NAME=LOW:HIGH"),
    ],
)
def test_a_malformed_option_is_named(option: str, value: str, message: str) -> None:
    words = {"--seeds": "0:1", "--out": "a.csv"} | {option: value}
    done = run("record", "a1-fall-onto-human", *(w for pair in words.items() for w in pair))
    assert isinstance(done.exception, click.BadParameter)
    assert message in done.exception.message


@pytest.mark.parametrize(
    ("lacking", "words"),
    [
        ("pyarrow", ("generate", "--seed", 1, "--n", 1, "--out", "a.parquet")),
        ("statsmodels.stats.inter_rater", ("analyse", "{table}")),
        ("scipy.stats", ("analyse", "{table}")),
        ("jinja2", ("analyse", "{table}", "--out", "a.html")),
    ],
)
def test_a_missing_package_is_named_with_the_command_that_installs_it(
    lacking: str, words: tuple, table: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(table.parent)
    monkeypatch.setitem(sys.modules, lacking, None)
    assert run("check", table).exception is None  # CSV needs none of them
    done = run(*(str(w).format(table=table) for w in words))
    assert isinstance(done.exception, MissingExtraError)
    assert "pip install 'foreshock[analysis]'" in str(done.exception)
    assert not (table.parent / "a.parquet").exists()
