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
from foreshock.campaign.ledger import LEDGER, locked
from foreshock.errors import BadInputError, ConfigError
from foreshock.registry import Registry

COMMAND = [sys.executable, "-c", "from foreshock.cli import main; main()", "campaign"]


def started(file: Path, folder: Path) -> Campaign:
    spec, origin = load_campaign(str(file))
    return begin(spec, origin, folder, Registry())


def table(found: Campaign) -> list[Row]:
    """The rows without the one column that says how long each took."""
    return [msgspec.structs.replace(r, wall_s=None) for r in found.rows()]


def test_killed_at_random_moments_it_resumes_to_the_same_table(campaign_file: Path, tmp_path: Path) -> None:
    whole = started(campaign_file, tmp_path / "whole")
    assert execute(whole, 1)
    assert [r.status for r in whole.rows()] == ["ok"] * len(whole.plan.cases)
    broken = tmp_path / "broken"
    words = ["run", str(campaign_file), "--out", str(broken), "--workers", "2"]
    rng = random.Random(1)
    counts = []
    for _ in range(3):
        process = subprocess.Popen([*COMMAND, *words], stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
        deadline = time.monotonic() + 60.0
        before = _count(broken)
        while _count(broken) == before and process.poll() is None and time.monotonic() < deadline:
            time.sleep(0.01)
        time.sleep(rng.uniform(0.0, 0.15))
        process.send_signal(signal.SIGKILL)
        process.wait()
        counts.append(_count(broken))
        words = ["resume", str(broken), "--workers", "2"]
    assert 0 < counts[0] < len(whole.plan.cases), "the first kill came too early or too late"
    assert counts == sorted(counts)
    again, changed = reopen(broken, Registry())
    assert changed == []
    assert execute(again, 2)
    assert table(again) == table(whole)
    assert not (broken / "scratch").exists()


def _count(folder: Path) -> int:
    try:
        with sqlite3.connect(f"file:{folder / LEDGER}?mode=ro", uri=True) as db:
            return int(db.execute("select count(*) from runs").fetchone()[0])
    except sqlite3.OperationalError:  # not yet there
        return 0


def test_what_a_rogue_does_is_classified_and_costs_no_other_run(campaign_file: Path, tmp_path: Path) -> None:
    factor = '[[factors]]\nparameter = "behaviour"\nvalues = [0, 1, 2, 3, 4, 5]\n'  # rogue.toml
    text = campaign_file.read_text().replace("replicates = 12", "replicates = 1\ntimeout_s = 2.0")
    campaign_file.write_text(text.replace('[[arms]]\nid = "none"\nkind = "none"\n', "") + factor)
    found = started(campaign_file, tmp_path / "out")
    told: list[int] = []
    assert execute(found, 1, told=lambda p: told.append(p.failed))
    statuses = {(r.parameters["behaviour"], r.arm): r.status for r in found.rows()}
    kinds = ["ok", "error", "discard", "nan", "hang", "crash"]
    for k, kind in enumerate(kinds):
        assert statuses[float(k), "shadow"] == statuses[float(k), "on"] == kind
        # their interventions are those of a run that failed
        assert statuses[float(k), "random"] == statuses[float(k), "always"] == ("source" if k else "ok")
    assert told[-1] == 5 * 4
    crash = next(r for r in found.rows() if r.status == "crash")
    assert "SIGSEGV" in crash.detail
    assert "on purpose" in next(r for r in found.rows() if r.status == "error").log


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
