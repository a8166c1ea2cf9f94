"""The stop-restart plant: its laws, its random streams, and how the outcome depends on cause and action."""

from __future__ import annotations

import numpy as np
import pytest
from fmpy.validation import validate_fmu
from plant_runner import Inputs, runner

from foreshock_fmus import build_fmu

FADED = {"fade": 0.89, "fade_time": 0.0}
WATCH = ("tool_x", "tool_v", "drive", "brake", "hand_force", "hand_peak", "hand_in", "integrator", "park_x")
STOP_S, RESTART_S = 1.5, 4.1


def act(at_s: float, **inputs: float) -> Inputs:
    """The inputs from a time on."""
    return lambda t, _: inputs if t >= at_s else dict.fromkeys(inputs, 0.0)


def peak(parameters: dict[str, float], inputs: Inputs | None = None, seed: int = 1) -> float:
    """Largest force on the hand in the first cycle (N)."""
    log = runner("stop_restart").run({**FADED, **parameters, "seed": seed}, 6.0, ("hand_peak",), inputs)
    return float(log["hand_peak"][-1])


@pytest.mark.parametrize("version", [2, 3])
def test_the_fmu_is_valid(version: int) -> None:
    assert validate_fmu(str(build_fmu("stop_restart", version))) == []


def test_both_versions_of_fmi_give_the_same() -> None:
    two, three = (runner("stop_restart", v).run(FADED, 6.0, WATCH) for v in (2, 3))
    for name in WATCH:
        assert np.array_equal(two[name], three[name]), name


def test_momentum_and_energy_of_the_axis_are_what_the_forces_gave_it() -> None:
    """m dv = F dt in every step; brakes only take energy, and the balance closes within the step's O(dt)."""
    h, m = 0.0005, 10.0
    log = runner("stop_restart").run({**FADED, "tremor": 0.0}, 6.0, WATCH, h=h)
    v, force = log["tool_v"], log["drive"] + log["hand_force"]
    assert np.allclose(m * np.diff(v), h * (force[1:] + log["brake"][1:]), atol=1e-9)
    middle = 0.5 * (v[1:] + v[:-1])
    taken = h * np.sum(log["brake"][1:] * middle)
    given = h * np.sum(force[1:] * middle)
    gained = np.maximum(h * log["brake"][1:] * middle, 0.0)
    assert gained.sum() < 1e-3  # J: a step in which the drive turns the motion round, and the brake stops it
    assert given + taken == pytest.approx(0.5 * m * (v[-1] ** 2 - v[0] ** 2), abs=1e-9)
    assert taken < -3.0


def test_half_the_step_moves_the_blow_by_less_than_two_milliseconds() -> None:
    def blow(dt: float) -> tuple[float, float]:
        log = runner("stop_restart").run({**FADED, "dt": dt}, 5.0, ("hand_force", "hand_peak"), h=0.001)
        return float(log["t"][np.argmax(log["hand_force"] > 0.0)]), float(log["hand_peak"][-1])

    coarse, fine = blow(0.0005), blow(0.00025)
    assert STOP_S < coarse[0] < RESTART_S
    assert fine[0] == pytest.approx(coarse[0], abs=0.002 + 1e-9)
    assert fine[1] == pytest.approx(coarse[1], rel=0.05)


def test_a_fresh_brake_stops_where_it_was_planned_and_holds() -> None:
    log = runner("stop_restart").run({}, 6.0, WATCH)
    pause = (log["t"] > STOP_S + 0.3) & (log["t"] < RESTART_S)
    assert np.all(log["tool_v"][pause] == 0.0)
    assert log["tool_x"][pause] == pytest.approx(log["park_x"][pause], abs=0.015)
    assert log["hand_in"].max() > 0.95
    assert log["hand_peak"][-1] == 0.0


def test_a_faded_brake_stops_late_winds_up_and_breaks_loose_before_the_planned_restart() -> None:
    log = runner("stop_restart").run(FADED, RESTART_S, WATCH)
    t, v = log["t"], log["tool_v"]
    stopped = float(t[(t > STOP_S) & (v <= 0.0)][0])
    loose = float(t[(t > stopped) & (v < -0.06)][0])
    assert 0.4 < stopped - STOP_S < 0.8
    assert stopped + 0.15 < loose < RESTART_S - 0.5
    held = (t > stopped) & (t < loose - 0.1)
    assert np.all(v[held] == 0.0)
    assert log["integrator"][held].min() < -3.0


def test_more_fade_hurts_more_and_both_ends_exist() -> None:
    """Median over seeds: nothing up to 80 % lost, beyond the limit from 88 % on, worst without any brake."""
    fades = (0.0, 0.5, 0.8, 0.88, 0.94, 1.0)
    medians = [float(np.median([peak({"fade": f}, seed=s) for s in range(5)])) for f in fades]
    assert medians[:3] == [0.0, 0.0, 0.0]
    assert all(m > 280.0 for m in medians[3:])
    assert medians[-1] > 2.0 * medians[3]


def test_the_second_brake_saves_the_hand_from_the_break_away_but_not_at_the_last_moment() -> None:
    for seed in range(5):
        log = runner("stop_restart").run({**FADED, "seed": seed}, RESTART_S, ("tool_v", "hand_force"))
        t = log["t"]
        loose = float(t[(t > STOP_S + 0.6) & (log["tool_v"] < -0.06)][0])
        blow = float(t[np.argmax(log["hand_force"] > 0.0)])
        assert blow > loose + 0.3
        assert peak({}, act(loose + 0.08, protective_stop=1.0), seed) < 140.0
        assert peak({}, act(blow - 0.03, protective_stop=1.0), seed) > 280.0


def test_an_announcement_withdraws_the_hand() -> None:
    log = runner("stop_restart").run(FADED, RESTART_S, ("hand_in", "hand_peak"), act(STOP_S + 0.5, announce=1.0))
    assert log["hand_in"][log["t"] > STOP_S + 1.1].max() < 0.75
    assert log["hand_peak"][-1] == 0.0


def test_hold_empties_the_integrator_and_keeps_the_tool_where_it_is() -> None:
    log = runner("stop_restart").run(FADED, RESTART_S, WATCH, act(STOP_S + 0.8, hold=1.0))
    after = log["t"] > STOP_S + 0.9
    assert np.abs(log["tool_v"][after]).max() < 0.06
    assert log["hand_peak"][-1] == 0.0


def test_actions_leave_the_random_streams_paired() -> None:
    """Sensor noise of a run with all actions is that of the run without."""
    watch = ("joint_velocity", "tool_v")
    every = act(1.0, hold=1.0, announce=1.0, protective_stop=1.0, slow_approach=1.0)
    plain, acted = (runner("stop_restart").run({**FADED, "latency": 0.0}, 6.0, watch, i) for i in (None, every))
    assert not np.array_equal(plain["tool_v"], acted["tool_v"])
    noise = [log["joint_velocity"] - log["tool_v"] / 0.7 for log in (plain, acted)]
    assert np.allclose(*noise, atol=1e-12)
