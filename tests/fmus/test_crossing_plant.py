"""The crossing plant: its laws, its random streams, and how the outcome depends on timing and action."""

from __future__ import annotations

import math

import numpy as np
import pytest
from fmpy.validation import validate_fmu
from plant_runner import Inputs, Log, runner

from foreshock_fmus import build_fmu

QUIET = {"sway_noise": 0.0, "wander_noise": 0.0}
MOTION = ("robot_true_x", "robot_true_y", "human_true_x", "human_true_y", "robot_true_speed", "contact_force_peak")
SEEDS = range(6)


def act(at_s: float, **inputs: float) -> Inputs:
    """The inputs from a time on."""
    return lambda t, _: inputs if t >= at_s else dict.fromkeys(inputs, 0.0)


def run(parameters: dict[str, float], t_end: float = 9.0, inputs: Inputs | None = None, h: float = 0.02) -> Log:
    return runner("crossing").run(
        parameters, t_end, (*MOTION, "visible", "gap", "human_true_vx", "human_seen"), inputs, h
    )


def contacts(parameters: dict[str, float], inputs: Inputs | None = None) -> int:
    """Runs of six seeds in which the force on the chest goes beyond 280 N."""
    return sum(run({**parameters, "seed": float(s)}, inputs=inputs)["contact_force_peak"][-1] > 280.0 for s in SEEDS)


@pytest.mark.parametrize("version", [2, 3])
def test_the_fmu_is_valid(version: int) -> None:
    assert validate_fmu(str(build_fmu("crossing", version))) == []


def test_both_versions_of_fmi_give_the_same() -> None:
    two, three = (runner("crossing", v).run({"seed": 4.0}, 8.0, MOTION) for v in (2, 3))
    for name in MOTION:
        assert np.array_equal(two[name], three[name]), name


def test_contact_keeps_momentum_and_energy() -> None:
    """Head-on, nobody drives, an undamped chest: m v of both and kinetic energy plus k x^2 / 2 stay."""
    free = {"robot_lag": 1e9, "human_lag": 1e9, "contact_damping": 0.0, "human_heading": math.pi, "rack_width": 0.0}
    log = run({**QUIET, **free, "meet_time": 1.0}, 2.0, h=0.001)
    v, u = log["robot_true_speed"], log["human_true_vx"]
    squeeze = np.maximum(0.0, -log["gap"])
    momentum = 90.27 * v + 40.0 * u
    energy = 0.5 * 90.27 * v**2 + 0.5 * 40.0 * u**2 + 0.5 * 25_000.0 * squeeze**2
    assert squeeze.max() > 0.05
    assert momentum == pytest.approx(np.full(len(v), momentum[0]), rel=1e-9)
    # Touch and parting fall within a step of 1 ms, where the force begins with a kink: an error of order dt^2.
    assert energy == pytest.approx(np.full(len(v), energy[0]), rel=1e-4)
    reduced = 90.27 * 40.0 / (90.27 + 40.0)
    assert log["contact_force_peak"][-1] == pytest.approx(2.3 * math.sqrt(25_000.0 * reduced), rel=1e-3)


def test_half_the_step_changes_nothing_that_counts() -> None:
    coarse, fine = run({"seed": 2.0}), run({"seed": 2.0, "dt": 0.0005})
    assert coarse["contact_force_peak"][-1] > 280.0
    assert fine["contact_force_peak"][-1] == pytest.approx(coarse["contact_force_peak"][-1], rel=0.01)
    for name in MOTION[:4]:
        assert fine[name] == pytest.approx(coarse[name], abs=2e-3)


def test_a_rack_that_reaches_to_the_middle_hides_one_half() -> None:
    """Both stand 4 m apart; the rack's edge lies on the line between them."""
    still = {**QUIET, "robot_speed": 0.0, "human_speed": 0.0, "human_aside": 4.0, "rack_y": 0.0}
    log = run({**still, "rack_x": 2.0}, 0.1)
    assert log["visible"][-1] == pytest.approx(0.5, abs=1.0 / 21.0)
    assert run({**still, "rack_x": 2.0, "rack_y": -1.0, "rack_depth": 2.0}, 0.1)["human_seen"][-1] == 0.0
    assert run({**still, "rack_width": 0.0}, 0.1)["visible"][-1] == 1.0


def test_a_biped_stops_from_footfall_to_footfall() -> None:
    """Speed holds until the next footfall, and stands after two: never sooner than one step, within three."""
    for seed in SEEDS:
        log = run({**QUIET, "seed": float(seed), "human_late": 50.0}, 6.0, act(2.0, protective_stop=1.0))
        moving = log["t"][log["robot_true_speed"] > 0.1]
        assert 2.5 < moving[-1] < 3.5
        assert (log["robot_true_speed"][log["t"] <= 2.0] > 0.89).all()


def test_actions_leave_the_random_streams_paired() -> None:
    """One who does not mind the robot walks the same way whatever it does."""
    a, b = run({"hears": 0.0}, 5.0), run({"hears": 0.0}, 5.0, act(1.0, protective_stop=1.0, announce=1.0))
    assert not np.array_equal(a["robot_true_x"], b["robot_true_x"])
    for name in ("human_true_x", "human_true_y"):
        assert np.array_equal(a[name], b[name])


def test_who_comes_at_another_time_is_not_met() -> None:
    found = [contacts({"human_late": late}) for late in (-2.0, -0.5, 0.0, 0.5, 2.0)]
    assert found[0] == found[-1] == 0
    assert found[2] == len(SEEDS)
    assert found[0] <= found[1] <= found[2] >= found[3] >= found[4]


def test_an_early_stop_saves_and_a_late_one_does_not() -> None:
    meeting = 6.0 - 0.48 / math.hypot(0.9, 1.4)
    found = [contacts({}, act(meeting - s, protective_stop=1.0)) for s in (1.5, 0.8, 0.1)]
    assert found[0] == 0
    assert found[0] <= found[1] <= found[2]
    assert found[2] >= len(SEEDS) - 1


def test_one_who_minds_the_robot_lets_it_pass_and_an_announcement_needs_time() -> None:
    assert contacts({"attention": 1.0, "rack_width": 0.0}) == 0
    assert contacts({"hears": 1.0}, act(3.0, announce=1.0)) <= 1
    assert contacts({"hears": 1.0}, act(5.4, announce=1.0)) == len(SEEDS)
