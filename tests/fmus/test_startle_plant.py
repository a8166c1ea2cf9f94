"""The startle plant: its laws, its random streams, and how the outcome depends on cause and action."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from fmpy.validation import validate_fmu
from plant_runner import Inputs, runner

from foreshock_fmus import build_fmu

SCENE = {"stop_time": 2.0, "restart_time": 8.0, "queue": 0.28, "windup": 40.0, "distance": 0.7, "bench_gap": 0.24}
QUIET = {"sway": 0.0, "threshold_sd": 0.0}
WATCH = ("robot_x", "robot_v", "startle", "human_u", "human_v", "bench_peak", "robot_peak", "fallen", "attention")


def act(at_s: float, **inputs: float) -> Inputs:
    """The inputs from a time on."""
    return lambda t, _: inputs if t >= at_s else dict.fromkeys(inputs, 0.0)


def peak(parameters: dict[str, float], inputs: Inputs | None = None, seed: int = 1) -> float:
    """Largest force of the bench on the pelvis (N)."""
    log = runner("startle").run({**SCENE, **parameters, "seed": seed}, 12.0, ("bench_peak",), inputs)
    return float(log["bench_peak"][-1])


@pytest.mark.parametrize("version", [2, 3])
def test_the_fmu_is_valid(version: int) -> None:
    assert validate_fmu(str(build_fmu("startle", version))) == []


def test_both_versions_of_fmi_give_the_same() -> None:
    two, three = (runner("startle", v).run(SCENE, 10.0, WATCH) for v in (2, 3))
    for name in WATCH:
        assert np.array_equal(two[name], three[name]), name


def test_momentum_of_the_robot_is_what_the_forces_gave_it() -> None:
    """m dv = (drive + brake - c v) dt in every step, and over the whole lunge."""
    watch = ("robot_v", "drive", "brake", "robot_force")
    log = runner("startle").run({**SCENE, "distance": 3.0}, 10.0, watch, h=0.001)
    given = 0.001 * (log["drive"][1:] + log["brake"][1:] - 20.0 * log["robot_v"][:-1])
    assert np.allclose(60.0 * np.diff(log["robot_v"]), given, atol=1e-9)
    assert log["robot_v"].max() > 0.5


def test_without_ankles_the_human_is_an_inverted_pendulum_of_constant_orbital_energy() -> None:
    """v^2 - w^2 u^2, w^2 = g / h, within a percent of what it is the difference of: an O(dt) of semi-implicit Euler."""
    passive = {**QUIET, "ankle_lag": 1e9, "push_speed": 0.05, "bench_gap": 5.0, "foot_room": 9.0, "queue": 0.0}
    log = runner("startle").run(passive, 0.8, ("human_u", "human_v"), h=0.001)
    w2 = 9.81 / 0.95
    energy = log["human_v"] ** 2 - w2 * log["human_u"] ** 2
    assert np.all(np.abs(energy - 0.05**2) < 0.01 * (log["human_v"] ** 2 + w2 * log["human_u"] ** 2))
    closed = 0.05 / math.sqrt(w2) * np.sinh(math.sqrt(w2) * log["t"])
    assert log["human_u"] == pytest.approx(closed, rel=0.01, abs=1e-5)


def test_half_the_step_moves_the_impact_by_less_than_two_milliseconds() -> None:
    def impact(dt: float) -> tuple[float, float]:
        log = runner("startle").run({**SCENE, "dt": dt}, 10.0, ("bench_force", "bench_peak"), h=0.001)
        return float(log["t"][np.argmax(log["bench_force"] > 0.0)]), float(log["bench_peak"][-1])

    coarse, fine = impact(0.001), impact(0.0005)
    assert coarse[0] > 8.0
    assert fine[0] == pytest.approx(coarse[0], abs=0.002 + 1e-9)
    assert fine[1] == pytest.approx(coarse[1], rel=0.03)


def test_the_accident_comes_from_the_restart_and_from_nothing_else() -> None:
    struck = [peak({}, seed=s) for s in range(10)]
    calm = [peak({"queue": 0.0}, seed=s) for s in range(10)]
    assert sum(f > 360.0 for f in struck) >= 9
    assert max(calm) == 0.0


def test_an_attentive_human_is_not_startled_by_what_startles_an_absent_one() -> None:
    mild = {**SCENE, "queue": 0.22, "seed": 1}
    absent = runner("startle").run(mild, 12.0, WATCH)
    attentive = runner("startle").run({**mild, "own_work": 0.0, "look_median": 30.0}, 12.0, WATCH)
    assert attentive["attention"][800] > 0.9
    assert attentive["startle"][-1] == 0.0 < absent["startle"][-1]


def test_more_queued_motion_startles_more_and_both_ends_exist() -> None:
    """Median over seeds: nothing at 2 cm, a bump beyond the limit at 30 cm, never less for more."""
    medians = [float(np.median([peak({"queue": q}, seed=s) for s in range(5)])) for q in (0.02, 0.08, 0.16, 0.24, 0.32)]
    assert medians[0] == 0.0
    assert medians[-1] > 360.0
    assert all(b >= a - 30.0 for a, b in pairwise(medians)), medians


def test_hold_saves_when_early_and_not_when_late_or_the_lunge_is_brutal() -> None:
    seeds = range(6)
    early = [peak({}, act(8.07, hold=1.0), s) for s in seeds]
    late = [peak({}, act(8.45, hold=1.0), s) for s in seeds]
    brutal = [peak({"drive_force": 1500.0, "velocity_gain": 3000.0, "speed_max": 2.5, "distance": 0.6},
                   act(8.07, hold=1.0), s) for s in seeds]  # fmt: skip
    assert sum(f > 360.0 for f in early) == 0
    assert sum(f > 360.0 for f in late) >= 5
    assert sum(f > 360.0 for f in brutal) >= 4


def test_an_announcement_turns_the_head_and_raises_the_threshold() -> None:
    mild = {**SCENE, "queue": 0.22, "seed": 1}
    called = runner("startle").run(mild, 10.0, ("attention", "startle"), act(7.0, announce=1.0))
    left = runner("startle").run(mild, 10.0, ("attention", "startle"))
    at = 799  # just before the restart
    assert left["attention"][at] < 0.3
    assert called["attention"][at] > 0.7
    assert called["startle"][-1] == 0.0 < left["startle"][-1]


def test_actions_leave_the_random_streams_paired() -> None:
    """Sensor noise of a run with all actions is that of the run without."""
    still = {**SCENE, "latency": 0.0}
    watch = ("base_v", "robot_v")
    plain = runner("startle").run(still, 10.0, watch)
    acted = runner("startle").run(still, 10.0, watch, act(4.0, hold=1.0, announce=1.0, slow_approach=1.0))
    assert not np.array_equal(plain["robot_v"], acted["robot_v"])
    assert np.allclose(plain["base_v"] - plain["robot_v"], acted["base_v"] - acted["robot_v"], atol=1e-12)
