"""The perception plant: valid FMUs, image formation, energy, convergence, and a misclassification that emerges."""

from __future__ import annotations

import math

import numpy as np
import pytest
from fmpy.validation import validate_fmu
from plant_runner import Log, runner

from foreshock_fmus import build_fmu

PLANT = "perception"
STILL = {"seed": 1.0, "cause_rate": 0.0, "wander": 0.0, "glitch_share": 0.0}
FOG = {"cause": 0.0, "cause_rate": 1.5, "cause_depth": 2.0, "cause_time": 3.0}
WATCH = ["hand_x", "hand_y", "hand_z", "contact_load", "contact_force", "visibility", "forearm_belief"]


def run(parameters: dict[str, float], t_end: float, watch: list[str], version: int = 3, **inputs: float) -> Log:
    """A run with constant interventions."""
    return runner(PLANT, version).run(parameters, t_end, watch, (lambda t, now: inputs) if inputs else None, h=0.02)


@pytest.mark.parametrize("version", [2, 3])
def test_the_fmu_is_valid(version: int) -> None:
    assert validate_fmu(str(build_fmu(PLANT, version))) == []


def test_fmi_2_and_fmi_3_agree() -> None:
    two, three = (run({"seed": 7.0, **FOG}, 6.0, WATCH, version) for version in (2, 3))
    for name in WATCH:
        np.testing.assert_array_equal(two[name], three[name])


def test_contrast_follows_koschmieders_law_and_exposure_keeps_the_mean() -> None:
    """C = g s e^-tau / (g B + p), B = R e^-tau + A (1 - e^-tau), g B = 0.45; 1 % of noise, averaged."""
    depth = 0.8
    cause = {"cause": 0.0, "cause_rate": 10.0, "cause_depth": depth, "cause_time": 1.0, "clear_time": 1e9}
    log = run({**STILL, **cause}, 6.0, ["contrast", "luminance"])
    clear, fog = log["t"] < 0.9, log["t"] > 3.0
    mean = 0.35 * math.exp(-depth) + 0.6 * (1.0 - math.exp(-depth))
    gain = 0.45 / mean  # after the automatic exposure
    expected = gain * 0.12 * math.exp(-depth) / (gain * mean + 0.04)
    assert log["contrast"][fog].mean() == pytest.approx(expected, rel=0.005)
    assert log["contrast"][clear].mean() == pytest.approx(0.45 / 0.35 * 0.12 / 0.49, rel=0.005)
    assert log["luminance"][fog].mean() == pytest.approx(log["luminance"][clear].mean(), rel=0.005)


def test_a_lamp_changes_luminance_for_a_moment_and_contrast_not() -> None:
    log = run({**STILL, "lamp_time": 2.0, "lamp_level": 0.5}, 5.0, ["contrast", "luminance", "visibility"])
    after = (log["t"] > 2.05) & (log["t"] < 2.12)
    assert log["luminance"][after].max() < 0.8 * log["luminance"][log["t"] < 2.0].mean()
    assert log["luminance"][log["t"] > 4.0].mean() == pytest.approx(log["luminance"][log["t"] < 2.0].mean(), rel=0.01)
    assert log["visibility"].min() > 0.85


def test_work_of_the_servo_is_energy_of_the_hand_and_heat() -> None:
    """On tool and forearm alike: likeness 6 sends the hand onto the forearm. RK4 at 1 ms, contact at 16 Hz."""
    parameters = {**STILL, "likeness": 6.0, "dt": 0.0005}
    log = run(parameters, 8.0, ["energy", "servo_work", "heat", "contact_force"])
    assert log["contact_force"].max() > 160.0
    balance = log["servo_work"] - log["heat"] - log["energy"]
    assert np.abs(balance).max() < 0.01 * log["servo_work"].max()


def test_a_finer_step_gives_the_same_motion_and_the_forces_converge() -> None:
    """The touch falls anywhere within a step: the error is of first order in the mean over runs, not in each."""

    def moved(seed: int, dt: float) -> Log:
        return run({"seed": float(seed), "likeness": 6.0, "wander": 0.0, "dt": dt}, 6.0, WATCH)

    errors: dict[float, list[float]] = {0.002: [], 0.0005: []}
    for seed in range(8):
        best = moved(seed, 0.00025)
        assert best["contact_force"].max() > 200.0
        for dt, found in errors.items():
            log = moved(seed, dt)
            for name in ("hand_x", "hand_z"):
                np.testing.assert_allclose(log[name], best[name], atol=1e-4)
            found.append(float(np.abs(log["contact_force"] - best["contact_force"]).max()))
    assert max(errors[0.002]) < 2.0  # N, of some 250
    assert np.mean(errors[0.0005]) < 0.5 * np.mean(errors[0.002])  # a quarter of the step


def test_what_is_measured_is_two_frames_old_and_draws_do_not_depend_on_what_happens() -> None:
    free = run({"seed": 3.0, **FOG}, 8.0, ["sensor_time", "contrast", "tool_confidence"])
    held = run({"seed": 3.0, **FOG}, 8.0, ["contrast", "tool_confidence"], hold=1.0)
    later = free["t"] > 0.1
    np.testing.assert_allclose(free["t"][later] - free["sensor_time"][later], 0.06, atol=1e-9)  # published a step later
    np.testing.assert_array_equal(free["contrast"], held["contrast"])
    np.testing.assert_array_equal(free["tool_confidence"], held["tool_confidence"])


def test_a_value_that_is_cut_off_draws_as_often_as_one_that_is_not() -> None:
    """In a clear image noise takes the sharpness beyond 1 in every other frame."""
    watch = ["sharpness", "tool_center[1]", "tool_center[2]"]
    quiet, noisy = (run({**STILL, "statistics_noise": sd}, 4.0, watch, 2) for sd in (0.0, 0.01))
    assert np.all(quiet["sharpness"] == 1.0)
    assert noisy["sharpness"].max() == 1.0
    assert 0.3 < np.mean(noisy["sharpness"] < 1.0) < 0.7
    for name in watch[1:]:
        np.testing.assert_array_equal(quiet[name], noisy[name])


@pytest.mark.parametrize("cause", [0.0, 1.0, 2.0])
def test_misclassification_emerges_from_each_cause_and_not_without_one(cause: float) -> None:
    """Five seeds each: a deep cause ends on the forearm in most, none does without it or when the arm holds."""
    deep = {**FOG, "cause": cause}
    loads = [run({"seed": float(s), **deep}, 14.0, ["contact_load"])["contact_load"].max() for s in range(5)]
    assert sum(x > 1.0 for x in loads) >= 4
    assert run({"seed": 0.0, **deep, "cause_rate": 0.0}, 14.0, ["contact_load"])["contact_load"].max() == 0.0
    assert run({"seed": 0.0, **deep}, 14.0, ["contact_load"], hold=1.0)["contact_load"].max() == 0.0


def test_severity_has_both_ends() -> None:
    """By likeness, the share of tool evidence that no fog takes: 0 hardly ever harms, 6 does in a clear image."""

    def harmed(likeness: float, **more: float) -> int:
        found = [run({"seed": float(s), **FOG, "likeness": likeness, **more}, 12.0, ["contact_load"]) for s in range(5)]
        return sum(log["contact_load"].max() > 1.0 for log in found)

    counts = [harmed(x) for x in (0.0, 0.75, 1.5)]
    assert counts == sorted(counts)
    assert counts[0] <= 1
    assert counts[-1] >= 4
    assert harmed(6.0, cause_rate=0.0) == 5


def test_a_warned_human_draws_the_arm_back_and_a_clamped_one_cannot() -> None:
    early = run({**STILL, "likeness": 6.0}, 4.0, ["contact_force", "forearm_true_x"], announce=1.0)
    assert early["contact_force"].max() == 0.0
    assert early["forearm_true_x"][-1] == pytest.approx(0.85, abs=1e-9)
    at = {"t": 99.0}

    def warn_when_pressed(t: float, now: object) -> dict[str, float]:
        if now["contact_force"] > 100.0:
            at["t"] = min(at["t"], t)
        return {"announce": float(t >= at["t"])}

    late = runner(PLANT).run(
        {**STILL, "likeness": 6.0}, 4.0, ["contact_force", "contact_load"], warn_when_pressed, h=0.02
    )
    assert late["contact_load"].max() > 1.0
