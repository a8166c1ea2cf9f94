"""The example of a foreign simulator: fifty lines, no import of Foreshock, in a process of its own."""

from __future__ import annotations

import socket
import subprocess
import sys
from pathlib import Path

import msgspec
import pytest

from foreshock.session.isolated import Job, run_one
from foreshock.session.scenario import load_scenario

FOLDER = Path(__file__).parents[2] / "docs" / "examples" / "foreign-twin"
pytest.importorskip("zenoh")


def test_it_is_short_and_knows_nothing_of_foreshock() -> None:
    lines = [line for line in (FOLDER / "controller.py").read_text().splitlines() if line.strip()]
    assert len(lines) <= 50
    assert not [line for line in lines if "import" in line and "foreshock" in line]


def test_it_shuts_down_unless_it_is_derated() -> None:
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        endpoint = f"tcp/127.0.0.1:{s.getsockname()[1]}"
    process = subprocess.Popen([sys.executable, str(FOLDER / "controller.py"), endpoint, "120"])
    try:
        scenario = load_scenario(FOLDER / "throttling.toml")
        scenario = msgspec.structs.replace(scenario, twin={**scenario.twin, "endpoint": endpoint})
        end = 60
        while True:
            try:
                off = run_one(Job(scenario, "off", 0))
                break
            except Exception:
                end -= 1
                if not end:
                    raise
        on = run_one(Job(scenario, "on", 0))
    finally:
        process.terminate()
        process.wait(20)
    assert (off.outcome, on.outcome) == ("shut-down", "none")
    # 60 W into 4 J/K with 0.5 W/K to 293 K: 373 K after -8 ln(1 - 80/120) s
    assert off.events[0].stamp_ns / 1e9 == pytest.approx(8.79, abs=0.05)
    assert on.first_s["control-latency-spike"] == pytest.approx(5.5, abs=0.5)
