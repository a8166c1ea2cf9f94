"""``foreshock calibrate fit`` from a shell: the parameter file that a supervisor takes, and the report."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from foreshock.calibration.nominal import write_nominal
from foreshock.cli.calibrate_cmd import calibrate
from foreshock.errors import BadInputError
from foreshock.events import Event, EventPrecursor, write_events
from foreshock.risk import load_parameters
from foreshock.taxonomy import builtin_taxonomy

SLIP, TORSO, COM = "foot-micro-slip", "torso-angular-spike", "com-lateral-deviation"


@pytest.fixture
def table(tmp_path: Path) -> Path:
    """40 events of up to three precursors in a row: the more of them and the worse, the likelier the accident."""
    rng = np.random.default_rng(3)
    events = []
    for k in range(40):
        severity = rng.uniform(size=3)
        n = int(rng.integers(1, 4))
        seen = tuple(
            EventPrecursor(kind, 1.0 + 0.3 * i, 1.2 + 0.3 * i, round(float(severity[i]), 3))
            for i, kind in enumerate((SLIP, TORSO, COM)[:n])
        )
        hit = rng.random() < severity[:n].sum() / 3.0
        outcome, at = ("A1", 2.0) if hit else ("none", None)
        events.append(Event(f"e{k}", "assembly", "", "", "", ("kinematic",), seen, "", outcome, at, 4.0, "x"))
    write_events(tmp_path / "events.parquet", events)
    runs = []
    for _ in range(4):
        sway = rng.standard_normal(100)
        noise = rng.standard_normal((2, 100))
        runs.append({SLIP: noise[0].tolist(), TORSO: sway.tolist(), COM: (sway + 0.5 * noise[1]).tolist()})
    write_nominal(tmp_path / "nominal.parquet", runs)
    return tmp_path / "events.parquet"


def run(table: Path, *words: object) -> Result:
    given = ["fit", table, "--mode", "A1", "--out", table.with_name("fitted.toml"), *words]
    return CliRunner().invoke(calibrate, [str(w) for w in given], standalone_mode=False)


def test_everything_is_fitted_and_read_back(table: Path) -> None:
    nominal, report = table.with_name("nominal.parquet"), table.with_name("report.html")
    done = run(table, "--nominal", nominal, "--folds", 2, "--json", "--report", report)
    assert done.exception is None, done.exception
    result = json.loads(done.stdout)["result"]
    assert {p["name"] for p in result["profiles"]} == {"window_s", "rho", "presence"}
    read = load_parameters("fitted.toml", table.parent, builtin_taxonomy())
    assert 0.5 <= read.window_s <= 3.0
    for name in ("a", "b", "c", "kappa", "window_s", "rho", "presence"):
        low, high = read.intervals[name]
        assert low <= getattr(read, name) <= high, name
    (pair,) = [p for p in read.correlation if set(p.kinds) == {TORSO, COM}]
    low, high = read.intervals["rho"]
    # two noises of variance 1 and 1.25 that share 1: r0 = 1 / sqrt(1.25); four runs of 100 say it to about 0.1
    assert pair.r == pytest.approx(read.rho / np.sqrt(1.25), abs=0.1)
    assert pair.low <= 0.9 * low + 0.1
    page = report.read_text()
    for alt in ("Correlation matrix R", "Cascade lift J", "Profile likelihood of what was fitted by it"):
        assert f'alt="{alt}"' in page


def test_a_given_window_is_kept(table: Path) -> None:
    done = run(table, "--window", 1.25)
    assert done.exception is None, done.exception
    assert load_parameters("fitted.toml", table.parent, builtin_taxonomy()).window_s == 1.25
    lines = {word: line for line in done.stdout.splitlines() for word in ("window_s", "rho") if word in line}
    assert "1.250" in lines["window_s"]
    assert "not fitted" in lines["window_s"]
    assert "not fitted" in lines["rho"]  # no nominal runs, no R


def test_what_cannot_be_is_named(table: Path) -> None:
    done = run(table, "--folds", 41)
    assert isinstance(done.exception, BadInputError)
    assert "41 folds of 40 groups" in str(done.exception)
