"""The gait_swing plant: laws of the leg, its random streams, and how the outcome depends on cause and action."""

from __future__ import annotations

import math

import numpy as np
import pytest
from fmpy.validation import validate_fmu
from plant_runner import Inputs, Log, runner

from foreshock_fmus import build_fmu

HANGING = {"stepping": 0.0, "control": 0.0, "pull": 0.0, "torque_noise": 0.0}
MOTION = ("foot_x", "foot_y", "foot_lift", "pelvis_x", "human_y", "contact_force_peak", "drift_peak")
SEEDS = range(5)


def act(at_s: float, **inputs: float) -> Inputs:
    """The inputs from a time on."""
    return lambda t, _: inputs if t >= at_s else dict.fromkeys(inputs, 0.0)


def run(parameters: dict[str, float], t_end: float = 8.0, inputs: Inputs | None = None, h: float = 0.02) -> Log:
    watch = (
        *MOTION,
        "leg_energy",
        "drift",
        "foot_speed",
        "capture_excess",
        "pelvis_speed",
        "clearance",
        "support_left",
    )
    return runner("gait_swing").run(parameters, t_end, watch, inputs, h)


def kicks(parameters: dict[str, float], inputs: Inputs | None = None, t_end: float = 8.0) -> int:
    """Runs of five seeds in which the force on the lower leg goes beyond 260 N."""
    runs = (run({**parameters, "seed": float(s)}, t_end, inputs) for s in SEEDS)
    return sum(log["contact_force_peak"][-1] > 260.0 for log in runs)


@pytest.mark.parametrize("version", [2, 3])
def test_the_fmu_is_valid(version: int) -> None:
    assert validate_fmu(str(build_fmu("gait_swing", version))) == []


def test_both_versions_of_fmi_give_the_same() -> None:
    two, three = (runner("gait_swing", v).run({"seed": 4.0}, 7.0, MOTION) for v in (2, 3))
    for name in MOTION:
        assert np.array_equal(two[name], three[name]), name


def test_a_free_leg_keeps_its_energy() -> None:
    """Three coupled swings, a cross slope, no torque: RK4 at 0.5 ms loses nothing that matters in 10 s."""
    log = run({**HANGING, "slope": 0.1, "free_pitch": 0.6, "free_knee": 0.9, "free_roll": 0.3}, 10.0)
    swing = log["leg_energy"].max() - log["leg_energy"].min()
    assert np.ptp(log["foot_x"]) > 0.2
    assert swing < 1e-6 * abs(log["leg_energy"][0])


def test_a_straight_leg_rolls_as_a_compound_pendulum() -> None:
    """2 pi sqrt(I / (g sum m d)) with the masses and centres of talos_reduced.urdf."""
    mass, depth = np.array([6.827, 3.637, 2.849]), np.array([0.1728, 0.38 + 0.1206, 0.38 + 0.325])
    period = 2.0 * math.pi * math.sqrt((mass * depth**2).sum() / (9.81 * (mass * depth).sum()))
    log = run({**HANGING, "free_pitch": 0.0, "free_knee": 0.0, "free_roll": 0.02}, 8.0, h=0.01)
    outward = np.abs(log["foot_y"]) - 0.085
    crossings = log["t"][1:][(outward[1:] > 0.0) & (outward[:-1] <= 0.0)]
    assert np.diff(crossings).mean() == pytest.approx(period, rel=0.005)


def test_half_the_step_changes_nothing_that_counts() -> None:
    coarse, fine = run({"seed": 2.0}, h=0.002), run({"seed": 2.0, "dt": 0.00025}, h=0.002)
    touch = [float(log["t"][np.argmax(log["contact_force_peak"] > 260.0)]) for log in (coarse, fine)]
    assert touch[0] > 1.0
    assert touch[1] == pytest.approx(touch[0], abs=0.004)
    assert fine["drift"][:2500] == pytest.approx(coarse["drift"][:2500], abs=5e-4)


def test_without_a_cause_the_foot_follows_its_plan_and_passes() -> None:
    for seed in SEEDS:
        log = run({"pull": 0.0, "seed": float(seed)})
        assert log["drift_peak"][-1] < 0.015
        assert log["contact_force_peak"][-1] == 0.0
        assert log["clearance"].min() < 0.08, "he stands near enough that the cause matters"


def test_static_drift_is_the_drag_over_the_stiffness_of_the_hip() -> None:
    """F d / (I w^2) at the hip, times d at the foot; d and I are those of a leg with its knee a little bent."""
    mass, depth = np.array([6.827, 3.637, 2.849]), np.array([0.165, 0.47, 0.6])
    stiff = (mass * depth**2).sum() * 11.0**2
    log = run({"pull": 30.0, "pull_back": 0.0, "step_in": 0.0})
    assert log["drift_peak"][-1] == pytest.approx(30.0 * 0.6**2 / stiff, rel=0.25)


def test_actions_leave_the_random_streams_paired() -> None:
    """One who does not mind signals sways the same whatever the robot does."""
    a, b = run({"hears": 0.0}, 5.0), run({"hears": 0.0}, 5.0, act(1.0, step_suppression=1.0, announce=1.0))
    assert not np.array_equal(a["pelvis_x"], b["pelvis_x"])
    assert np.array_equal(a["human_y"], b["human_y"])


def test_more_pull_and_a_nearer_human_kick_more() -> None:
    by_pull = [kicks({"pull": pull}) for pull in (0.0, 20.0, 30.0, 80.0)]
    assert by_pull[0] == 0
    assert by_pull[-1] == len(SEEDS)
    assert by_pull == sorted(by_pull)
    by_step = [kicks({"step_in": step}) for step in (0.1, 0.22, 0.33)]
    assert by_step[0] == 0
    assert by_step[-1] == len(SEEDS)
    assert by_step == sorted(by_step)


def test_a_foot_put_down_in_time_does_not_kick_and_the_robot_can_stand() -> None:
    for seed in SEEDS:
        free = run({"seed": float(seed)}, h=0.01)
        touch = float(free["t"][np.argmax(free["contact_force_peak"] > 260.0)])
        saved = run({"seed": float(seed)}, 9.0, act(touch - 0.5, step_suppression=1.0), h=0.01)
        assert saved["contact_force_peak"][-1] == 0.0
        assert abs(saved["pelvis_speed"][-1]) < 0.01
        assert saved["capture_excess"][-1] < 0.0
        late = run({"seed": float(seed)}, 9.0, act(touch - 0.02, step_suppression=1.0), h=0.01)
        assert late["contact_force_peak"][-1] > 0.0


def test_shorter_steps_alone_do_not_prevent_it_and_a_signal_does_if_it_is_minded() -> None:
    assert kicks({}, act(4.0, shorten_step=1.0), 18.0) >= len(SEEDS) - 2
    assert kicks({"hears": 1.0}, act(5.0, announce=1.0)) == 0
    assert kicks({"hears": 0.0}, act(5.0, announce=1.0)) == len(SEEDS)
