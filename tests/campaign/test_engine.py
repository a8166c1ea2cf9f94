"""A campaign in its folder: killed at any moment it resumes to the same table, and no run costs another."""

from __future__ import annotations

import os
import random
import signal
import sqlite3
import subprocess
import sys
import time
from pathlib import Path

import msgspec
import pytest

from foreshock.campaign import Campaign, Estimate, Row, begin, execute, load_campaign, reopen
from foreshock.campaign.engine import refuse_changes
from foreshock.campaign.ledger import LEDGER, Ledger, locked
from foreshock.errors import BadInputError, ConfigError
from foreshock.registry import Registry

COMMAND = [sys.executable, "-c", "from foreshock.cli import main; main()", "campaign"]


def started(file: Path, folder: Path) -> Campaign:
    spec, origin = load_campaign(str(file))
    return begin(spec, origin, folder, Registry())


def table(found: Campaign) -> list[Row]:
    """The rows without the one column that says how long each took."""
    return [msgspec.structs.replace(r, wall_s=None) for r in found.rows()]


def test_killed_ten_times_at_random_moments_it_resumes_to_the_same_table(campaign_file: Path, tmp_path: Path) -> None:
    """No seed: a moment that breaks it may come up in any run of the test, and is named when it does."""
    campaign_file.write_text(campaign_file.read_text().replace("replicates = 12", "replicates = 40"))
    whole = started(campaign_file, tmp_path / "whole")
    assert execute(whole, 1)
    assert [r.status for r in whole.rows()] == ["ok"] * len(whole.plan.cases)
    broken = tmp_path / "broken"
    chance = random.SystemRandom()
    kills: list[str] = []
    counts = []
    for _ in range(10):
        words = ["resume", str(broken)] if _begun(broken) else ["run", str(campaign_file), "--out", str(broken)]
        process = subprocess.Popen(
            [*COMMAND, *words, "--workers", "2"], stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL
        )
        # some moments lie before its first row, most lie while rows are written
        rows, wait_s = chance.choice((0, 1, 1, 1)), chance.uniform(0.0, 0.2)
        before, deadline = _count(broken), time.monotonic() + 60.0
        while _count(broken) < before + rows and process.poll() is None and time.monotonic() < deadline:
            time.sleep(0.005)
        time.sleep(wait_s)
        process.send_signal(signal.SIGKILL)
        process.wait()
        counts.append(_count(broken))
        kills.append(f"{wait_s:.4f} s after row {before + rows}, at {counts[-1]} rows")
    said = "\n".join(kills)
    assert counts == sorted(counts), said
    assert sum(0 < n < len(whole.plan.cases) for n in counts) >= 5, f"too few came while rows were written:\n{said}"
    again, changed = reopen(broken, Registry())
    assert changed == []
    assert execute(again, 2)
    assert table(again) == table(whole), said
    assert not (broken / "scratch").exists()


def _count(folder: Path, of: str = "runs") -> int:
    try:
        with sqlite3.connect(f"file:{folder / LEDGER}?mode=ro", uri=True) as db:
            return int(db.execute(f"select count(*) from {of}").fetchone()[0])
    except sqlite3.OperationalError:  # not yet there
        return 0


def _begun(folder: Path) -> bool:
    return _count(folder, "meta") > 0


def test_killed_while_it_was_begun_it_can_be_begun_again(campaign_file: Path, tmp_path: Path) -> None:
    with Ledger(tmp_path / "out", new=True):
        pass  # and no more: nothing of the campaign is in it
    found = started(campaign_file, tmp_path / "out")
    assert found.rows() == []


def test_a_segfault_a_hang_and_a_nan_in_two_hundred_runs_cost_three_rows(campaign_file: Path, tmp_path: Path) -> None:
    rogue = {40: 5, 101: 4, 160: 3}  # rogue.toml: segmentation fault, hang, NaN; below 1 nothing happens
    kinds = {5: "crash", 4: "hang", 3: "nan"}
    factor = f'[[factors]]\nparameter = "behaviour"\nvalues = {[rogue.get(k, k / 1000) for k in range(200)]}\n'
    text = 'id = "rogues"\ntimeout_s = 4.0\n[[scenarios]]\nuse = "rogue.toml"\n[[arms]]\nid = "on"\nkind = "on"\n'
    campaign_file.write_text(text + factor)
    found = started(campaign_file, tmp_path / "out")
    assert execute(found, 2)
    rows = found.rows()
    assert len(rows) == 200
    assert {k: r.status for k, r in enumerate(rows) if not r.ok} == {k: kinds[b] for k, b in rogue.items()}
    good = [r for r in rows if r.ok]
    assert len(good) == 197
    # 0.3 s, all the same: the rogues beside them changed nothing
    assert {(r.outcome, r.end_s, r.peak_p, r.level) for r in good} == {("none", 0.3, good[0].peak_p, good[0].level)}
    assert "SIGSEGV" in rows[40].detail
    assert "no result within 4 s" in rows[101].detail


def test_bad_input_is_said_at_once_and_not_kept(campaign_file: Path, tmp_path: Path) -> None:
    campaign_file.write_text(campaign_file.read_text() + '[[factors]]\nparameter = "behavior"\nvalues = [0, 1]\n')
    found = started(campaign_file, tmp_path / "out")
    with pytest.raises(BadInputError, match="did you mean 'behaviour'"):
        execute(found, 1)
    assert found.rows() == []


def test_a_change_is_named_and_only_what_depends_on_it_runs_again(campaign_file: Path, tmp_path: Path) -> None:
    text = campaign_file.read_text().replace("replicates = 12", "replicates = 1")
    campaign_file.write_text(text)
    folder = tmp_path / "out"
    found = started(campaign_file, folder)
    assert execute(found, 1)
    scenario = tmp_path / "rogue.toml"
    scenario.write_text(scenario.read_text() + "[parameters]\nfrom = 0.02\n")
    as_it_was, changed = reopen(folder, Registry())
    assert changed == ["scenarios.rogue.parameters.from is new"]
    assert as_it_was.rows() == found.rows()  # can still be reported and compared
    with pytest.raises(ConfigError, match=r"is not what it was.*\n.*parameters.from is new"):
        refuse_changes(folder, changed)
    again, _ = reopen(folder, Registry(), accept=True)
    assert again.rows() == []
    estimates: list[Estimate] = []
    assert execute(again, 1, estimated=estimates.append)
    assert len(again.rows()) == len(again.plan.cases)
    assert [e.runs for e in estimates] == [len(again.plan.cases) - 2]  # one with a supervisor, one without, came first
    assert reopen(folder, Registry())[1] == []
    # all is there: nothing is left to estimate, nothing runs
    assert execute(again, 1, estimated=estimates.append, told=lambda _: pytest.fail("it ran something"))
    assert estimates[-1] == Estimate(0, 0.0, 0.0)


def test_the_budget_of_runs_and_of_time(campaign_file: Path, tmp_path: Path) -> None:
    campaign_file.write_text(campaign_file.read_text() + "[budget]\nhours = 1e-9\n")
    found = started(campaign_file, tmp_path / "out")
    assert not execute(found, 1)
    assert len(found.rows()) < len(found.plan.cases)


def test_one_process_at_a_time_and_one_campaign_a_folder(campaign_file: Path, tmp_path: Path) -> None:
    folder = tmp_path / "out"
    found = started(campaign_file, folder)
    with pytest.raises(ConfigError, match="holds a campaign already"):
        started(campaign_file, folder)
    with locked(folder), pytest.raises(BadInputError, match="another process"):
        execute(found, 1)
    with pytest.raises(ConfigError, match="holds no campaign"):
        reopen(tmp_path, Registry())
    assert os.path.lexists(folder / LEDGER)
