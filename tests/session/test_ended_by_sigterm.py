"""SIGTERM of a command ends its worker and detector processes too, promptly, and leaves nothing behind."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

ROGUE = Path(__file__).parents[1] / "rogues" / "fmus" / "rogue"
WITHIN_S = 15.0
"""A worker in a native hang is killed after 3 s; the rest is for a machine that is busy with other tests."""
HANG = 4  # rogue.toml

SCENARIO = f"""
id = "rogue"
title = "A plant that runs long, or hangs"
mode = "A9"
expect = "open"
duration_s = 600.0

[twin]
kind = "fmu"
plant = "{ROGUE}"
binding = "{ROGUE / "binding.toml"}"

[config.supervisor]
period_s = 0.001

[[config.detectors]]
use = "telemetry"
isolation = "process"
"""


def parents() -> dict[int, int]:
    """Process id of the parent of each process that runs; a zombie runs no more."""
    found = {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, parent, *_ = stat.read_text().rpartition(")")[2].split()
        except OSError:  # ended meanwhile
            continue
        if state != "Z":
            found[int(stat.parent.name)] = int(parent)
    return found


def below(pid: int) -> set[int]:
    """All descendants of a process."""
    table = parents()
    found: set[int] = set()
    new = {pid}
    while new:
        new = {child for child, parent in table.items() if parent in new}
        found |= new
    return found


def until(holds: Callable[[], bool], within_s: float, what: str) -> None:
    end = time.monotonic() + within_s
    while not holds():
        assert time.monotonic() < end, what
        time.sleep(0.02)


@contextmanager
def foreshock(*words: str, folder: Path) -> Iterator[subprocess.Popen[str]]:
    """The command, running, with a temporary folder of its own."""
    (folder / "temporary").mkdir()
    process = subprocess.Popen(
        [sys.executable, "-c", "from foreshock.cli import main; main()", *words],
        env={**os.environ, "TMPDIR": str(folder / "temporary")},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        yield process
    finally:
        children = below(process.pid)
        process.kill()
        for child in children & parents().keys():  # first: while one runs on, it holds the pipes open
            os.kill(child, signal.SIGKILL)
        process.communicate()


def end(process: subprocess.Popen[str], folder: Path) -> str:
    """Send SIGTERM, twice as timeout(1) does, and check what is left; the standard output."""
    children = below(process.pid)
    process.send_signal(signal.SIGTERM)
    time.sleep(0.05)
    process.send_signal(signal.SIGTERM)
    out, err = process.communicate(timeout=WITHIN_S)
    assert process.returncode == 143, err
    assert "Traceback" not in err
    until(lambda: not children & parents().keys(), 2.0, "a child runs on")
    assert list((folder / "temporary").iterdir()) == []
    return out


@pytest.mark.parametrize("behaviour", [0, HANG])
def test_simulate_ends_with_its_children(tmp_path: Path, behaviour: int) -> None:
    file = tmp_path / "rogue.toml"
    file.write_text(SCENARIO)
    with foreshock("simulate", str(file), "--set", f"behaviour={behaviour}", "--json", folder=tmp_path) as process:
        # the resource tracker, the worker, its detector's child
        until(lambda: len(below(process.pid)) >= 3, 60.0, "no worker with a detector in a child")
        time.sleep(1.0)  # now it runs, or hangs
        answer = json.loads(end(process, tmp_path))
    assert answer["ok"] is False
    assert answer["errors"] == [{"kind": "terminated", "message": "ended by SIGTERM"}]


def test_demo_ends_with_its_workers(tmp_path: Path) -> None:
    with foreshock("demo", "--out", str(tmp_path / "out"), folder=tmp_path) as process:
        until(lambda: len(below(process.pid)) >= 2, 60.0, "no worker")
        time.sleep(0.5)
        end(process, tmp_path)
    assert list((tmp_path / "out").iterdir()) == []
