"""The MuJoCo twin in a process of its own, stepped over Zenoh: the same run as in process, digest for digest."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import msgspec
import pytest

from foreshock.session.isolated import Job, run_one
from foreshock.session.scenario import load_scenario

sys.path.append(str(Path(__file__).parent))
from robot import free_endpoint

pytest.importorskip("zenoh")
pytest.importorskip("mujoco")
pytest.importorskip("pinocchio")

SCENARIO = """
id = "talos-on-ice"
title = "Walking, both feet on ice, a human in reach"
mode = "A1"
expect = "accident"
duration_s = 5.0

[twin]
kind = "mujoco"

[config.supervisor]
robot = "talos"
period_s = 0.005

[[config.detectors]]
use = "balance"

[[config.detectors]]
use = "telemetry"

[[config.policies]]
use = "ladder"

[parameters]
step_length = 0.2
start_time = 0.5
drop_foot = 2
drop_mu = 0.02
drop_time = 3.0
drop_duration = 5.0
human = 1
human_y = -1.0
"""


def test_a_stepped_run_over_zenoh_is_the_run_in_process(tmp_path: Path) -> None:
    path = tmp_path / "talos-on-ice.toml"
    path.write_text(SCENARIO)
    scenario = load_scenario(path)
    here = run_one(Job(scenario, "on", 5))
    assert here.interventions, "what goes to the twin matters as much as what comes from it"
    endpoint = free_endpoint()
    command = [sys.executable, "-m", "foreshock", "twin", "serve", str(path), "--listen", endpoint]
    server = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    try:
        assert server.stderr is not None
        assert endpoint in server.stderr.readline()
        over = msgspec.structs.replace(scenario, twin={"kind": "zenoh", "endpoint": endpoint})
        for _ in range(2):  # and again after a reset
            there = run_one(Job(over, "on", 5))
            assert there.digest == here.digest
            assert (there.outcome, there.end_s) == (here.outcome, here.end_s)
    finally:
        server.terminate()
        server.wait(20)
        if server.stderr is not None:
            server.stderr.close()
