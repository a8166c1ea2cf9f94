"""Sensor noise of a run with every action is that of the run without, from the start until after the accident."""

from __future__ import annotations

import numpy as np
import pytest
from plant_runner import runner

CASES = {
    "arm_strike": (6.0, ("soften_arms", "withdraw_arm"), {}, "imu_gyro[1]", None, "hand_x"),
    "actuator_chain": (
        8.0, ("derate", "protective_stop", "brake_joints"), {"latency": 0.0}, "winding_temperature", "heat", "angle",
    ),
    "gait_swing": (
        8.0, ("shorten_step", "speed_scale", "step_suppression", "announce"), {}, "human_vx", None, "pelvis_x",
    ),
    "crossing": (
        8.0, ("slow_approach", "speed_scale", "protective_stop", "replan", "announce"), {"latency": 0.0}, "robot_vx",
        "robot_true_speed", "robot_true_x",
    ),
    "co_carry": (
        12.0, ("slow_approach", "hold", "lower_load", "regrasp"), {"lift": 0.37}, "wrist_force[1]", None, "robot_end_z",
    ),
}  # fmt: skip
"""Length (s), actions, parameters that lead to harm, a measured value and what is true of it (None: it is 0), and what
the actions change."""


@pytest.mark.parametrize("plant", CASES)
def test_noise_does_not_depend_on_what_is_done(plant: str) -> None:
    end, actions, parameters, measured, true, changed = CASES[plant]
    watch = [measured, changed, *([true] if true else [])]
    runs = [
        runner(plant, 2).run(
            {**parameters, "seed": 3.0}, end, watch, lambda t, _, on=on: dict.fromkeys(actions, on * (t > 2.0)), h=0.02
        )
        for on in (0.0, 1.0)
    ]
    noise = [log[measured] - (log[true] if true else 0.0) for log in runs]
    assert np.ptp(noise[0]) > 0.0
    np.testing.assert_allclose(noise[0], noise[1], atol=1e-12, rtol=0.0)  # rounding of the sum
    assert not np.array_equal(runs[0][changed], runs[1][changed])
