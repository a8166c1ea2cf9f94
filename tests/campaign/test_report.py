"""The commands of a campaign: results do not depend on workers, and every point of the report leads to its command."""

from __future__ import annotations

import json
import math
import os
import re
import shutil
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path

import msgspec
import pyarrow.parquet as pq
import pytest

from tests.campaign.conftest import ROGUE

CHROMIUM = shutil.which("chromium")


def started(*words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", "from foreshock.cli import main; main()", "campaign", *words],
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
        env={**os.environ, "COLUMNS": "200"},
    )


def foreshock(*words: str, code: int = 0) -> str:
    done = started(*words)
    assert done.returncode == code, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def smoke(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("smoke") / "out"
    foreshock("run", "smoke", "--out", str(folder), "--workers", "1")
    return folder


class _Links(HTMLParser):
    def __init__(self, page: str) -> None:
        super().__init__()
        self.ids: set[str] = set()
        self.targets: list[str] = []
        self.outside: list[str] = []
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        found = dict(attrs)
        if found.get("id"):
            self.ids.add(str(found["id"]))
        for name in ("href", "src"):
            if value := found.get(name):
                (self.targets if value.startswith("#") else self.outside).append(value)
        assert tag != "script"


def test_every_point_of_the_report_leads_to_a_command_that_runs_it_again(smoke: Path) -> None:
    page = (smoke / "report.html").read_text()
    links = _Links(page)
    assert links.outside == []
    assert {t[1:] for t in links.targets} <= links.ids
    table = pq.read_table(smoke / "runs.parquet").to_pylist()
    assert len(table) == 30
    for row in table:
        assert f"r-{row['key']}" in {t[1:] for t in links.targets}
        assert f"foreshock campaign rerun {smoke} {row['key']}" in page
    key = next(r["key"] for r in table if r["arm"] == "random" and r["accident"])
    assert "the same as in the ledger" in foreshock("rerun", str(smoke), key)
    said = json.loads(foreshock("rerun", str(smoke), "", "--json", code=2))
    assert "several runs begin with ''" in said["errors"][0]["message"]


def _finite(row: dict[str, object]) -> dict[str, object]:
    """Without what JSON cannot say, which is null there."""
    return {k: v for k, v in row.items() if v is not None and not (isinstance(v, float) and not math.isfinite(v))}


def test_results_are_what_was_run_and_parquet_says_the_same_as_json(smoke: Path) -> None:
    status = json.loads(foreshock("status", str(smoke), "--json"))["result"]
    assert (status["planned"], status["done"], status["failed"], status["changed"]) == (30, 30, {}, [])
    results = json.loads(foreshock("report", str(smoke), "--json"))["result"]["results"]
    stored = pq.read_table(smoke / "results.parquet").to_pylist()
    assert [_finite(row) for row in stored] == [_finite(row) for row in results]
    overall = {r["arm"]: r for r in results if r["scope"] == "overall"}
    # A1 unsupervised falls at drop_duration 0.475 and not at 0.1; what is done in time saves it
    assert (overall["none"]["accidents.k"], overall["on"]["accidents.k"]) == (2, 0)
    # judging alone changes nothing
    assert overall["shadow"]["difference.only_first"] == overall["shadow"]["difference.only_second"] == 0


def test_a_comparison_of_nothing_is_no_good_news(smoke: Path, campaign_file: Path, tmp_path: Path) -> None:
    """Both have an arm none, but no scenario in common; and a campaign that was cut short says so."""
    other = tmp_path / "other"
    foreshock("run", str(campaign_file), "--out", str(other), "--workers", "1")
    said = json.loads(foreshock("compare", str(smoke), str(other), "--json", code=2))
    assert "no arm and scenario with runs in common" in said["errors"][0]["message"]


def test_a_comparison_says_what_it_leaves_out_and_fails_where_the_second_lacks_runs(tmp_path: Path) -> None:
    text = (
        'id = "many"\nreplicates = 2\n[[scenarios]]\nuse = "a1-fall-onto-human"\nduration_s = 0.05\n'
        '[[arms]]\nid = "none"\nkind = "none"\n'
    )
    more = '[[scenarios]]\nuse = "a2-arm-torso-strike"\nduration_s = 0.05\n[[arms]]\nid = "shadow"\nkind = "shadow"\n'
    for name, content in (("few", text), ("all", text + more), ("long", text.replace("0.05", "0.06"))):
        (tmp_path / f"{name}.toml").write_text(content)
        foreshock("run", str(tmp_path / f"{name}.toml"), "--out", str(tmp_path / name), "--workers", "1")
    few, whole, long = (str(tmp_path / name) for name in ("few", "all", "long"))
    foreshock("compare", whole, few, "--allow-missing")
    said = json.loads(foreshock("compare", whole, few, "--json", code=1))["result"]
    assert (said["first"]["done"], said["second"]["done"], said["second"]["planned"]) == (8, 2, 2)
    assert said["not_compared"] == {"scenarios": ["a2-arm-torso-strike"], "arms": ["shadow"], "faults": []}
    assert {(m["scenario"], m["arm"]): m["runs"] for m in said["missing"]} == {
        ("a1-fall-onto-human", "shadow"): 2,
        ("a2-arm-torso-strike", "none"): 2,
        ("a2-arm-torso-strike", "shadow"): 2,
    }
    assert "campaign.arms.shadow is gone" in said["differs"]
    foreshock("compare", few, whole)
    said = json.loads(foreshock("compare", few, long, "--json", code=2))
    assert "scenarios.a1-fall-onto-human.duration_s was 0.05, is 0.06" in said["errors"][0]["message"]


def test_a_campaign_is_reported_and_compared_although_its_scenario_and_plant_are_gone(
    campaign_file: Path, tmp_path: Path
) -> None:
    """What the ledger holds is all that it takes; that nobody can tell what has changed is said."""
    plant, scenario, out = tmp_path / "plants" / "rogue", tmp_path / "rogue.toml", tmp_path / "out"
    shutil.copytree(ROGUE, plant)
    scenario.write_text(scenario.read_text().replace(str(ROGUE), str(plant)))
    foreshock("run", str(campaign_file), "--out", str(out), "--workers", "1")
    before = json.loads(foreshock("report", str(out), "--json"))["result"]["results"]
    for gone in (plant, scenario):
        shutil.move(gone, tmp_path / "away")
        state = json.loads(foreshock("status", str(out), "--json"))["result"]
        assert (state["planned"], state["done"]) == (60, 60)
        assert "cannot be compared" in state["changed"][0]
        assert str(gone) in state["changed"][0]
        assert json.loads(foreshock("report", str(out), "--json"))["result"]["results"] == before
        foreshock("compare", str(out), str(out))
        said = json.loads(foreshock("resume", str(out), "--json", code=2))
        assert str(gone) in said["errors"][0]["message"]
        shutil.move(tmp_path / "away", gone)


def test_a_run_that_is_done_again_with_a_report_is_still_one_json(campaign_file: Path, tmp_path: Path) -> None:
    """A run without a result has no report, and that is said."""
    factor = '[[factors]]\nparameter = "behaviour"\nvalues = [0, 3]\n'  # rogue.toml: 3 is NaN
    campaign_file.write_text(campaign_file.read_text().replace("replicates = 12", "replicates = 1") + factor)
    out = tmp_path / "out"
    foreshock("run", str(campaign_file), "--out", str(out), "--workers", "1", code=3)
    keys = {r["status"]: r["key"] for r in pq.read_table(out / "runs.parquet").to_pylist() if r["arm"] == "on"}
    page = tmp_path / "page.html"
    for status, told in (("ok", f"report: {page}"), ("nan", "no report: the run gave no result (nan)")):
        done = started("rerun", str(out), keys[status], "--json", "--report", str(page))
        assert json.loads(done.stdout)["ok"]
        assert told in done.stderr
        assert page.exists() == (status == "ok")
        page.unlink(missing_ok=True)


def test_results_do_not_depend_on_the_number_of_workers(campaign_file: Path, tmp_path: Path) -> None:
    one, two = tmp_path / "one", tmp_path / "two"
    for folder, workers in ((one, "1"), (two, "2")):
        foreshock("run", str(campaign_file), "--out", str(folder), "--workers", workers)
    tables = [pq.read_table(f / "runs.parquet").drop_columns(["wall_s"]) for f in (one, two)]
    assert tables[0].num_rows == 60
    assert tables[0].equals(tables[1])
    assert "0 with any sign of getting worse" in foreshock("compare", str(one), str(two))


def test_a_campaign_that_got_worse_fails_the_comparison(smoke: Path, tmp_path: Path) -> None:
    import sqlite3

    worse = tmp_path / "worse"
    many = tmp_path / "many"
    spec = Path(tmp_path / "many.toml")
    spec.write_text(
        'id = "many"\nreplicates = 8\n[[scenarios]]\nuse = "a1-fall-onto-human"\nduration_s = 0.05\n'
        '[[arms]]\nid = "none"\nkind = "none"\n'
    )
    foreshock("run", str(spec), "--out", str(many), "--workers", "1")
    shutil.copytree(many, worse)
    with sqlite3.connect(worse / "ledger.sqlite") as db:  # as if every run had ended in the accident
        for key, row in db.execute("select key, row from runs").fetchall():
            data = msgspec.json.decode(row)
            data |= {"accident": True, "accident_s": 0.04, "event_s": 0.04, "outcome": "fall-onto-human"}
            db.execute("update runs set row = ? where key = ?", (msgspec.json.encode(data), key))
    assert "worse" in foreshock("compare", str(many), str(worse), code=1)
    foreshock("compare", str(worse), str(many))
    key = pq.read_table(many / "runs.parquet").to_pylist()[0]["key"]
    said = json.loads(foreshock("rerun", str(worse), key, "--json", code=1))["result"]
    assert said["differs"]["accident"] == [True, False]


def chromium(page: Path, profile: Path, *words: str) -> subprocess.CompletedProcess[str]:
    flags = ("--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--enable-logging=stderr")
    return subprocess.run(
        [str(CHROMIUM), *flags, f"--user-data-dir={profile}", *words, page.resolve().as_uri()],
        capture_output=True,
        text=True,
        check=True,
        timeout=120,
    )


@pytest.mark.skipif(CHROMIUM is None, reason="no chromium")
def test_a_browser_shows_the_report(smoke: Path, tmp_path: Path) -> None:
    done = chromium(smoke / "report.html", tmp_path / "profile", "--dump-dom")
    assert "CONSOLE" not in done.stderr, done.stderr
    dom = done.stdout
    assert len(re.findall(r"<rect[^>]* class=\"(?:calm|accident|event|failed)\"", dom)) == 30 + 4
    for title in ("Which arm wins", "Accident rates", "Price and recovery", "Lead times", "Accidents against false"):
        assert title in dom
    assert {"A1", "ROC", "Precision-recall", "Reliability"} <= set(re.findall(r'font-weight="600">([^<]+)</text>', dom))
    # every figure lies within its frame
    panels = re.findall(r'<svg class="panel"[^>]*viewBox="0 0 ([\d.]+) ([\d.]+)".*?</svg>', dom, re.DOTALL)
    found = re.findall(r'<svg class="panel".*?</svg>', dom, re.DOTALL)
    assert len(found) == 4
    for (width, height), panel in zip(panels, found, strict=True):
        marks = re.findall(r'<path class="mark" transform="translate\(([\d.-]+) ([\d.-]+)\)', panel)
        assert marks
        for x, y in marks:
            assert 0.0 <= float(x) <= float(width)
            assert 0.0 <= float(y) <= float(height)


@pytest.mark.skipif(CHROMIUM is None, reason="no chromium")
def test_a_browser_draws_the_colours_of_the_arms(smoke: Path, tmp_path: Path) -> None:
    """The same page without its figures has far less of the colour of the arm in shadow, which all figures show."""
    from matplotlib.image import imread

    page = (smoke / "report.html").read_text()
    bare = tmp_path / "bare.html"
    bare.write_text(re.sub(r"<svg (?!class=.key).*?</svg>", "", page, flags=re.DOTALL))
    counts = []
    for name, file in (("full", smoke / "report.html"), ("bare", bare)):
        shot = tmp_path / f"{name}.png"
        chromium(file, tmp_path / name, f"--screenshot={shot}", "--window-size=1300,3600")
        pixels = imread(shot)[:, :, :3]
        orange = abs(pixels - [0xFF / 255, 0x7F / 255, 0x0E / 255]).max(axis=2) < 0.02
        counts.append(int(orange.sum()))
    assert counts[0] > 4 * counts[1] > 0


def test_a_campaign_from_before_a_column_was_recorded_still_has_its_report(smoke: Path, tmp_path: Path) -> None:
    """Rows without the columns say that they do not know, not that nothing happened."""
    import sqlite3

    old = tmp_path / "old"
    shutil.copytree(smoke, old)
    with sqlite3.connect(old / "ledger.sqlite") as db:
        for key, row in db.execute("select key, row from runs").fetchall():
            data = {k: v for k, v in msgspec.json.decode(row).items() if k not in ("safe_s", "reduced_s")}
            db.execute("update runs set row = ? where key = ?", (msgspec.json.encode(data), key))
    results = json.loads(foreshock("report", str(old), "--json"))["result"]["results"]
    assert not any("reduced.share" in r or "safe_s.n" in r for r in results)
    now = json.loads(foreshock("report", str(smoke), "--json"))["result"]["results"]
    on = next(r for r in now if (r["scope"], r["arm"]) == ("overall", "on"))
    assert (on["reduced.share"], on["safe_s.n"], on["safe_s.reached"]) == (0.0, 2, 2)


def test_the_ranking_is_written_as_markdown(smoke: Path, tmp_path: Path) -> None:
    file = tmp_path / "ranking.md"
    said = json.loads(foreshock("report", str(smoke), "--markdown", str(file), "--json"))["result"]
    assert str(file) in said["files"]
    text = file.read_text()
    tables = [line for line in text.splitlines() if line.startswith("|")]
    assert {line.count("|") for line in tables} == {5, 8}
    for told in (text, (smoke / "report.html").read_text()):  # a command, which a faulty plant may not follow
        assert "time at reduced speed, as commanded" in told
    # four runs an arm show nothing, and so nobody wins
    assert "| A1 | `on` | 0/4 (0–49%) |" in text
    assert text.count("nobody | nobody |") == 1
    duels = pq.read_table(smoke / "duels.parquet").to_pylist()
    assert {d["verdict"] for d in duels} == {"open"}
    traces = pq.read_table(smoke / "traceability.parquet").to_pylist()
    assert {t["mode"] for t in traces} == {f"A{k}" for k in range(1, 13)}
    assert {t["verdict"] for t in traces if t["mode"] != "A1"} == {"not shown"}
    figures = {p["figure"] for p in pq.read_table(smoke / "forecasts.parquet").to_pylist()}
    assert figures == {"roc", "precision-recall", "reliability"}
