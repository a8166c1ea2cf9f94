"""The arm-strike plant: laws of mechanics, FMI, pairing, and that the bump decides what happens."""

from __future__ import annotations

import math

import numpy as np
import pytest
from fmpy.validation import validate_fmu
from plant_runner import Log, runner

from foreshock_fmus import build_fmu

NOISE = ("balance_noise", "sway_noise")
QUIET = dict.fromkeys(NOISE, 0.0)
FREE = {**QUIET, "passive": 1.0, "push_impulse": 0.0, "human_place_x": 9.0, "stop_stiffness": 0.0, "stop_damping": 0.0}
TRUTH = ("com_x", "torso_pitch", "hand_x", "separation", "contact_use", "contact_force_peak", "tipping", "strike_speed")
ACTS = ("soften_arms", "withdraw_arm")


def bump(
    impulse: float, seed: int = 1, act_after: float = math.inf, acts: tuple[str, ...] = ACTS, **more: float
) -> Log:
    """Two seconds of work, a bump, and what comes of it; acts from act_after the bump on."""
    parameters = {"push_impulse": impulse, "push_time": 2.0, "seed": seed, "human_place_x": 0.54, **more}

    def inputs(t: float, _: object) -> dict[str, float]:
        return {name: float(t >= 2.0 + act_after and name in acts) for name in ACTS}

    return runner("arm_strike").run(parameters, 6.0, TRUTH, inputs)


@pytest.mark.parametrize("version", [2, 3])
def test_fmu_is_valid(version: int) -> None:
    assert validate_fmu(build_fmu("arm_strike", version)) == []


def test_fmi_2_and_3_give_equal_results() -> None:
    two, three = (runner("arm_strike", v).run({"push_impulse": 30.0, "push_time": 0.5}, 2.5, TRUTH) for v in (2, 3))
    for name in TRUTH:
        assert np.array_equal(two[name], three[name]), name


def test_limp_body_keeps_its_energy() -> None:
    """No torques, no contact, no ends of range: a quadruple pendulum. RK4 at 1 ms holds 1e-5 of the energy moved."""
    log = runner("arm_strike").run({**FREE, "start_off": -1.0}, 1.0, ("energy", "com_x", "torso_pitch"))
    moved = 90.0 * 9.81 * 0.1
    assert abs(log["torso_pitch"][-1] - log["torso_pitch"][0]) > 0.05, "it moves"
    assert log["energy"] == pytest.approx(np.full(len(log["t"]), log["energy"][0]), abs=1e-5 * moved)


def test_push_turns_a_rod_as_a_rod() -> None:
    """A short push on the hips, all mass in the legs: rate = impulse l / (I + m c^2) of one rod on a pivot."""
    light = {f"{part}_mass": 0.1 for part in ("trunk", "upper", "fore")}
    tiny = {f"{part}_inertia": 1e-3 for part in ("trunk", "upper", "fore")}
    rod = {**FREE, **light, **tiny, "box_mass": 0.0, "push_height": 0.0, "push_impulse": 2.0, "push_time": 0.0}
    log = runner("arm_strike", 2).run({**rod, "push_duration": 0.002}, 0.01, ("link_angle[1]",), h=0.002)[
        "link_angle[1]"
    ]
    rate = (log[3] - log[1]) / 0.004
    inertia = 2.46 + 31.4 * 0.49**2
    assert rate == pytest.approx(2.0 * 0.8 / inertia, rel=0.03)  # the light links add 0.3 kg at the hips


def test_halving_the_step_changes_nothing_that_matters() -> None:
    one, half = (bump(28.0, **QUIET, dt=dt, human_place_x=9.0) for dt in (0.001, 0.0005))
    for name in ("com_x", "torso_pitch", "hand_x"):
        assert one[name] == pytest.approx(half[name], abs=1e-4), name


def test_same_seed_same_run_and_action_leaves_the_noise_alone() -> None:
    """Before anything differs runs are equal; the human, who is not touched, sways the same in both."""
    a, b = bump(30.0, 7), bump(30.0, 7)
    assert np.array_equal(a["hand_x"], b["hand_x"])
    watch = ("human_true_x", "hand_x")
    run = runner("arm_strike").run
    still, acted = (
        run({"push_impulse": 0.0, "seed": 7}, 3.0, watch, lambda t, _, v=v: dict.fromkeys(ACTS, v)) for v in (0.0, 1.0)
    )
    assert np.array_equal(still["human_true_x"], acted["human_true_x"])
    assert not np.array_equal(still["hand_x"], acted["hand_x"])


def test_bump_throws_the_box_into_the_human_and_without_it_nothing_comes_near() -> None:
    struck, calm = bump(30.0), bump(0.0)
    assert struck["contact_use"][-1] > 1.0
    touch = struck["t"][np.argmax(struck["contact_force_peak"] > 0.0)]
    assert 0.8 < touch - 2.0 < 1.8, "on the rebound, not at once"
    assert calm["separation"].min() > 0.12
    assert calm["contact_use"][-1] == 0.0


def test_contact_force_is_that_of_a_mass_on_a_spring() -> None:
    """F = v sqrt(k mu) of ISO/TS 15066 for the softest and the hardest region in reach, 2 to 12 kg."""
    log = bump(28.0, seed=2)
    v, force = log["strike_speed"][-1], log["contact_force_peak"][-1]
    low, high = (v * math.sqrt(k / (1.0 / m + 1.0 / human)) for k, m, human in ((1e4, 2.0, 40.0), (5e4, 12.0, 75.0)))
    assert low < force < high


def test_harder_bumps_do_more_harm_at_both_ends() -> None:
    """Of four seeds none is struck up to 20 N s, all from 29 to 33; at 40 the robot falls whatever the arms do."""
    struck = {i: sum(bump(i, s)["contact_use"][-1] > 1.0 for s in range(4)) for i in (10.0, 20.0, 29.0, 33.0)}
    assert [struck[i] for i in (10.0, 20.0)] == [0, 0]
    assert [struck[i] for i in (29.0, 33.0)] == [4, 4]
    assert all(bump(40.0, s, act)["tipping"][-1] > 0.5 for s in range(2) for act in (math.inf, 0.2))


def test_early_arms_in_prevent_the_strike_late_ones_do_not() -> None:
    early = [bump(30.0, s, 0.3) for s in range(4)]
    assert [log["contact_use"][-1] for log in early] == [0.0] * 4
    assert not any(log["tipping"][-1] for log in early)
    late = [bump(30.0, s, 1.25)["contact_use"][-1] for s in range(4)]
    assert sum(use > 1.0 for use in late) >= 3


def test_recovery_without_arms_is_weaker() -> None:
    """The bump that trunk and arms together just survive is harder than that which the trunk survives alone."""

    def survived(act_after: float) -> float:
        return max(i for i in np.arange(30.0, 40.0, 0.5) if not bump(i, 3, act_after, human_place_x=9.0)["tipping"][-1])

    assert survived(math.inf) > survived(0.0)


def test_bad_parameters_are_refused() -> None:
    with pytest.raises(Exception, match="Initialization"):
        runner("arm_strike").run({"dt": 0.0015}, 0.1, ("com_x",))
