"""The whole-body twin: simulated seconds per second of CPU, beside bare ``mj_step`` of the same model."""

from __future__ import annotations

import statistics
import time
from pathlib import Path

import mujoco

from foreshock_twins.mujoco import MujocoTwinConfig, build_twin
from foreshock_twins.mujoco._twin import MujocoTwin
from tests.bench.rows import Row

__all__ = ["rows"]

BEGIN_NS, SECONDS, ROUNDS = 1_500_000_000, 3, 3
WALK = {"step_length": 0.2, "start_time": 0.5}
BESIDE = {"human": 2.0, "human_x": 4.0, "human_y": 0.7, "human_start": 1.0}
"""He is within 1 m of the robot, where contacts are looked for at each step of 1 ms, for about a third of the time."""
AIM = 3.0


def twin_factor(twin: MujocoTwin, parameters: dict[str, float]) -> float:
    """Control, physics, sensors and referee, while it walks."""
    twin.reset(parameters, 1)
    twin.advance(BEGIN_NS)
    begin = time.process_time()
    twin.advance(BEGIN_NS + SECONDS * 1_000_000_000)
    return SECONDS / (time.process_time() - begin)


def bare_factor(twin: MujocoTwin) -> float:
    """Physics alone: the robot stands on both feet, its servos hold the posture."""
    twin.reset({"stepping": 0.0}, 1)
    twin.advance(BEGIN_NS)
    model, data = twin.model, twin._data
    steps = round(SECONDS / model.opt.timestep)
    begin = time.process_time()
    mujoco.mj_step(model, data, steps)
    return SECONDS / (time.process_time() - begin)


def rows() -> list[Row]:
    """One row without and one with a human; all three are measured in turn."""
    twin = build_twin(MujocoTwinConfig(), "talos", Path())
    assert isinstance(twin, MujocoTwin)
    rounds = [(twin_factor(twin, WALK), twin_factor(twin, WALK | BESIDE), bare_factor(twin)) for _ in range(ROUNDS)]
    alone, beside, bare = (statistics.median(column) for column in zip(*rounds, strict=True))
    return [
        Row(
            f"simulated seconds per CPU second, TALOS walks{who}",
            value,
            "x",
            bare,
            "bare mj_step",
            value / bare,
            f"> {AIM:.0f} x",
            value > AIM,
        )
        for who, value in (("", alone), (", a human walks past", beside))
    ]
