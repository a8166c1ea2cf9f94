"""``foreshock sensitivity``: tables, report and JSON, and what it refuses."""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path

import pytest

from foreshock.cli import main
from foreshock.cli.output import console
from foreshock.risk import load_parameters, save_parameters
from foreshock.taxonomy import builtin_taxonomy


@pytest.fixture(autouse=True)
def wide(monkeypatch: pytest.MonkeyPatch) -> None:
    """120 columns, whatever the runner of the tests says of its terminal."""
    monkeypatch.setattr(console, "_width", 120)


def run(capsys: pytest.CaptureFixture[str], *words: str) -> tuple[int, str, str]:
    with pytest.raises(SystemExit) as end:
        main(["sensitivity", *words])
    said = capsys.readouterr()
    return int(end.value.code or 0), said.out, said.err


def test_tables_and_a_report_that_holds_everything(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, out, _ = run(capsys, "--samples", "16", "--out", str(tmp_path))
    assert code == 0
    assert max(map(len, out.splitlines())) <= 120
    rows = [[cell.strip() for cell in line.split("│")[1:-1]] for line in out.splitlines() if line.startswith("│")]
    by_name = {r[0]: r for r in rows if len(r) == 10}
    assert by_name["nothing"][1:5] == ["0.117", "0.455", "0.809", "1.12"]  # Table 4, by Eq. 1
    assert by_name["b = 1"][6] == "NO"
    assert by_name["b = 3"][4] == "never"
    assert by_name["b = 3"][8] == "NO"
    page = (tmp_path / "report.html").read_text()
    assert page.count("data:image/svg+xml;base64,") == 3
    assert not re.search(r"""(src|href)=["'](?!data:)""", page)
    assert "<script" not in page
    assert page.count('class="bad"') == 2
    for name in ("timelines.png", "one-at-a-time.png", "sobol.png"):
        assert (tmp_path / name).read_bytes().startswith(b"\x89PNG")


def test_json_of_the_correlated_model_from_a_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    taxonomy = builtin_taxonomy()
    save_parameters(tmp_path / "mine.toml", load_parameters("table-3", Path(), taxonomy))
    words = ("--mode", "A5", "--model", "correlated", "--samples", "16", "--second-order", "--json")
    code, out, _ = run(capsys, *words, "--parameters", str(tmp_path / "mine.toml"), "--out", str(tmp_path / "out"))
    result = json.loads(out)["result"]
    assert code == 0
    assert [f["id"] for f in result["factors"]][6:] == ["kappa", "lift", "r", "presence", "severity"]
    assert {i["output"] for i in result["sobol"]} > {"p-third", "gate", "gate-on-p"}
    assert len(result["sobol"][0]["interactions"]) == 11 * 10 // 2
    assert "×" in (tmp_path / "out" / "report.html").read_text()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--samples", "100"), "take 64"),
        (("--mode", "A13"), "unknown accident mode 'A13'"),
        (("--parameters", "x.toml"), 'only model = "correlated" has it'),
        (("--model", "correlated", "--parameters", "tabel-3"), "did you mean 'table-3'"),
    ],
)
def test_bad_input_is_refused(words: tuple[str, ...], message: str, capsys: pytest.CaptureFixture[str]) -> None:
    code, out, err = run(capsys, *words)
    assert (code, out) == (2, "")
    assert message in err


def test_without_the_extra_it_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    for name in [n for n in sys.modules if n.split(".")[:2] == ["foreshock", "sensitivity"]]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "SALib.analyze", None)
    code, out, err = run(capsys, "--out", str(tmp_path / "none"))
    assert (code, out) == (2, "")
    assert "pip install 'foreshock[analysis]'" in err
    assert not (tmp_path / "none").exists()
