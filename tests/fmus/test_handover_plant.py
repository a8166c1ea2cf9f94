"""The handover plant: valid FMUs, momentum, friction, the instability of its linear theory, severity, paired noise."""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable

import numpy as np
import pytest
from fmpy.validation import validate_fmu
from plant_runner import Log, runner

from foreshock_fmus import build_fmu

PLANT = "handover"
EARLY = {"arrival_shift": -2.7, "pull_max": 85.0, "regrasp_time": 0.85}
WATCH = ["pinch_ratio", "pinch_force", "slip", "finger_depth", "effort", "handed_over", "dropped", "hand_x", "object_x"]


def run(
    parameters: dict[str, float], t_end: float = 10.0, act: Callable[[float, Log], dict[str, float]] | None = None,
    watch: list[str] = WATCH, version: int = 3, h: float = 0.02,
) -> Log:  # fmt: skip
    return runner(PLANT, version).run(parameters, t_end, watch, act, h)


def crushed(parameters: dict[str, float], seeds: int = 8, release_after_s: float | None = None) -> int:
    """Runs with an accident; release and retreat so long after the partner has begun to pull hard (30 N)."""
    found = 0
    for seed in range(seeds):
        since: list[float] = []

        def act(t: float, now: Log, since: list[float] = since) -> dict[str, float]:
            if now["effort"] > 30.0 and not since:
                since.append(t)
            on = float(release_after_s is not None and bool(since) and t >= since[0] + release_after_s)
            return {"release": on, "retreat": on}

        found += run({**EARLY, **parameters, "seed": float(seed)}, 8.0, act)["pinch_ratio"][-1] > 1.0
    return found


@pytest.mark.parametrize("version", [2, 3])
def test_the_fmu_is_valid(version: int) -> None:
    assert validate_fmu(str(build_fmu(PLANT, version))) == []


def test_fmi_2_and_fmi_3_agree() -> None:
    watch = [*WATCH, "grip_normal", "hand_visible", "due"]
    two, three = (run({"seed": 7.0, **EARLY}, 6.0, None, watch, version) for version in (2, 3))
    for name in watch:
        np.testing.assert_array_equal(two[name], three[name])


def test_momentum_of_object_and_hand_is_what_arm_and_gripper_give() -> None:
    """What the hand gives the object, it loses: only the arm's force and the gripper's pull change their sum."""
    log = run({"seed": 2.0, **EARLY}, 4.4, None, ["momentum", "arm_force", "pull", "holding"], h=0.0005)
    held = np.flatnonzero(log["holding"] > 0.5)
    assert len(held) > 2000
    gained = np.cumsum((log["arm_force"] - log["pull"])[held]) * 0.0005
    momentum = log["momentum"][held]
    assert np.ptp(momentum) > 1.0
    np.testing.assert_allclose(momentum - momentum[0], gained - gained[0], atol=1e-9)


def test_friction_stays_in_its_cone() -> None:
    """At most 2 mu N on the object, with what the bent finger adds once it is caught."""
    log = run({"seed": 3.0, **EARLY}, 6.0, None, ["pull", "grip_force", "pinch_force"], h=0.001)
    caught = log["pinch_force"] > 0.0
    assert np.all(np.abs(log["pull"]) <= 2.0 * np.where(caught, 1.2, 0.36) * log["grip_force"] + 1e-9)


def root(stiffness: float, guess: complex) -> complex:
    """Root s of the linear loop near a guess: admittance with filter, delay and servo, against object, hand and arm."""

    def loop(s: complex) -> complex:
        arm = 1.5 * s * s + 2 * 0.1 * math.sqrt(stiffness * 1.5) * s + stiffness * 0.2 * s / (1 + 0.2 * s)
        hand = 1 / (1 / (8000 * (1 + 0.02 * s)) + 1 / arm)
        environment = 1 / (1 / (15000 * (1 + 0.002 * s)) + 1 / (s * s + hand))
        admittance = 1 / (3 * s * s + 25 * s + 500) * cmath.exp(-0.04 * s) / (1 + 0.05 * s)
        servo = s * s + 96 * s + 3600
        return 1 + environment * (admittance * (96 * s + 3600) / servo + 1 / (25 * servo))

    s = guess
    for _ in range(50):
        slope = (loop(s + 1e-4) - loop(s - 1e-4)) / 2e-4
        s -= loop(s) / slope
    assert abs(loop(s)) < 1e-6
    return s


def test_a_braced_partner_makes_the_arm_unstable_as_linear_theory_has_it() -> None:
    """No slip (friction 5), a constant effort of 60 N, hence 300 + 40 * 60 N/m: frequency and growth of the pull."""
    grasp = {"friction": 5.0, "hand_friction": 5.0, "regrasp_time": 90.0, "tremor": 0.0}
    effort = {"pull_nominal": 60.0, "pull_max": 60.0, "arrival_shift": -2.9}
    log = run({"seed": 1.0, "arrival_sd": 0.0, **grasp, **effort}, 4.4, None, ["pull", "effort"], h=0.001)
    braced = (log["effort"] > 59.9) & (log["t"] > 3.1) & (log["t"] < 3.86)  # later the arm's speed is at its limit
    t, pull = log["t"][braced], log["pull"][braced]
    expected = root(2700.0, 3 + 18j)
    turns = np.flatnonzero(np.diff(np.sign(np.diff(pull)))) + 1
    period = 2.0 * np.diff(t[turns]).mean()
    assert 2 * math.pi / period == pytest.approx(expected.imag, rel=0.05)
    swings = np.abs(np.diff(pull[turns]))
    growth = np.polyfit(t[turns][1:], np.log(swings), 1)[0]
    assert expected.real > 2.0
    assert growth == pytest.approx(expected.real, abs=0.6)
    relaxed = [root(780.0, guess).real for guess in (-4 + 41j, -10 + 15j)]
    assert max(relaxed) < -2.0, "at 12 N the loop is stable"


def test_half_the_step_gives_the_same_handover_and_nearly_the_same_tug() -> None:
    """Without tremor, whose draws are one per step. The tug is unstable: its slips amplify what differs."""
    calm = {"seed": 1.0, "arrival_sd": 0.0, "tremor": 0.0}
    coarse, fine = (run({**calm, "dt": dt}, 6.0) for dt in (0.0005, 0.00025))
    np.testing.assert_allclose(coarse["object_x"], fine["object_x"], atol=0.003)
    coarse, fine = (run({**calm, **EARLY, "dt": dt}, 4.6) for dt in (0.0005, 0.00025))
    slips = [log["t"][np.argmax(log["slip"] > 0.018)] for log in (coarse, fine)]
    assert slips[0] == pytest.approx(slips[1], abs=0.05)
    assert coarse["pinch_ratio"][-1] == pytest.approx(fine["pinch_ratio"][-1], rel=0.1)


def test_a_partner_on_time_gets_the_object_and_an_early_one_is_crushed() -> None:
    on_time = run({"seed": 4.0}, 30.0)
    assert on_time["handed_over"][-1] == 3.0
    assert on_time["pinch_ratio"].max() == on_time["dropped"].max() == 0.0
    assert crushed({}) >= 6


def test_severity_has_both_ends() -> None:
    assert [crushed({"arrival_shift": s}, 4) for s in (-1.5, -1.0, -0.5)] == [0, 0, 0]
    pulls = [crushed({"pull_max": p}, 4) for p in (30.0, 50.0, 75.0)]
    assert pulls == sorted(pulls)
    assert pulls[0] == 0
    assert pulls[-1] == 4


def test_release_in_time_saves_and_too_late_does_not() -> None:
    """A partner who pulls and grasps forward faster leaves less time."""
    assert crushed({}, 4, release_after_s=0.4) == 0
    fast = {"pull_rate": 300.0, "regrasp_time": 0.4, "pull_max": 130.0}
    assert crushed(fast, 4) == crushed(fast, 4, release_after_s=0.9) == 4


def test_a_release_before_the_partner_holds_drops_the_object() -> None:
    log = run({"seed": 1.0}, 4.0, lambda t, now: {"release": float(t > 1.0)})
    assert log["dropped"].max() == 1.0
    assert log["pinch_ratio"].max() == 0.0


def test_interventions_leave_the_noise_paired() -> None:
    """In the next handover the partner comes at the same time, and the sensors err by the same."""
    watch = ["hand_x", "grip_acceleration"]
    plain = run({"seed": 5.0}, 14.0, None, watch)
    acted = run({"seed": 5.0}, 14.0, lambda t, now: {"hold": float(2.0 < t < 3.0)}, watch)
    second = plain["t"] > 10.0
    for name in watch:  # the accelerometer shows nothing but its noise here
        np.testing.assert_array_equal(plain[name][second], acted[name][second])


@pytest.mark.parametrize(
    "parameters", [{"dt": math.nan}, {"sensor_period": 0.0107}, {"latency": 1.0}, {"grip_delay": 0.1, "dt": 1e-4}]
)
def test_bad_parameters_are_refused(parameters: dict[str, float]) -> None:
    with pytest.raises(Exception, match="fmi3"):
        run(parameters, 0.1)
    run({"dt": 0.0005, "sensor_period": 0.01, "latency": 0.01, "grip_delay": 0.02}, 0.1)
