"""The MuJoCo twin in a process of its own, stepped over Zenoh: the same run as in process, digest for digest."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from foreshock.session.scenario import load_scenario

sys.path.append(str(Path(__file__).parent))
from robot import assert_the_same_over_zenoh

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
    assert_the_same_over_zenoh(scenario, str(path))
