"""The tool_in_hand plant: valid FMUs, energy, momentum of the spindle, and chatter that emerges from wear."""

from __future__ import annotations

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.validation import validate_fmu
from plant_runner import Log, runner

from foreshock_fmus import build_fmu

WORN = {"wear_time": 2.0, "wear_rate": 0.3, "wear_max": 1.5, "coupling": 0.038}
QUIET = {"roughness": 0.0, "human_sway": 0.0}
WATCH = ["advance", "angle", "spindle_rate", "normal_force", "overload", "human_force_peak"]


def run(parameters: dict[str, float], t_end: float, watch: list[str], version: int = 3, h: float = 0.01, **inputs: float) -> Log:  # fmt: skip # noqa: E501
    """A run with constant interventions."""
    return runner("tool_in_hand", version).run(
        parameters, t_end, watch, (lambda t, now: inputs) if inputs else None, h=h
    )


def cut(seed: int, t_end: float = 12.0, **parameters: float) -> bool:
    log = run({"seed": float(seed), **WORN, **parameters}, t_end, ["human_force_peak", "cut_speed"], h=0.05)
    return bool(log["human_force_peak"].max() > 1.0 and log["cut_speed"].max() > 1.0)


@pytest.mark.parametrize("version", [2, 3])
def test_the_fmu_is_valid(version: int) -> None:
    assert validate_fmu(str(build_fmu("tool_in_hand", version))) == []


def test_fmi_2_and_fmi_3_agree() -> None:
    two, three = (run({"seed": 7.0, **WORN}, 8.0, WATCH, version) for version in (2, 3))
    assert two["overload"].max() > 0.1
    for name in WATCH:
        np.testing.assert_array_equal(two[name], three[name])


def test_without_damping_cutting_and_people_energy_stays() -> None:
    """A hard spot gives it some; afterwards kinetic, elastic and the work of the fed-forward moment sum to a constant.

    E = M u'^2 / 2 + I a'^2 / 2 + k (p - u)^2 / 2 + k_a a^2 / 2 + M_f a + K depth^2 / 2. RK4 at 0.5 ms near 8 Hz.
    """
    lossless = {"damping": 0.0, "wrist_damping": 0.0, "contact_damping": 0.0, "cutting_ratio": 0.0, "human_near": 0.0}
    limits = {"edge": 5.0, "wrist_torque": 1e3, "wrist_continuous": 1e3, "bite_force": 1e3}
    knot = {"coupling": 0.05, "knot": 0.5, "knot_time": 0.2, "knot_duration": 0.3}
    names = ["advance", "advance_rate", "angle", "angle_rate", "depth"]
    log = run({**QUIET, **lossless, **limits, **knot}, 4.0, names)
    u, v, a, w, depth = (log[n] for n in names)
    forward = 0.35 * (0.0 - 0.05) * 2500.0 * 5000.0 / 7500.0 * 0.024
    elastic = 0.5 * 2500.0 * (0.024 - u) ** 2 + 0.5 * 130.0 * a**2 + 0.5 * 5000.0 * np.maximum(depth, 0.0) ** 2
    energy = 0.5 * 8.0 * v**2 + 0.5 * 0.06 * w**2 + elastic + forward * a
    after = log["t"] > 0.6
    assert np.ptp(v[after]) > 0.02
    assert np.ptp(energy[after]) < 1e-4 * np.abs(energy[after] - energy[0]).max() + 1e-6


def test_the_spindle_gains_what_motor_less_cut_gives_it() -> None:
    names = ["spindle_rate", "spindle_torque_now", "tangential_force", "faulted"]
    log = run({"seed": 2.0, **WORN, "human_near": 0.0}, 8.0, names, h=0.001)
    torque = log["spindle_torque_now"] - 0.05 * log["tangential_force"]
    impulse = np.concatenate(([0.0], np.cumsum(0.5 * (torque[1:] + torque[:-1]) * 0.001)))
    gained = 0.0004 * (log["spindle_rate"] - log["spindle_rate"][0])
    held = log["faulted"] < 0.5  # beyond the workpiece's edge the force jumps between two samples
    gained, impulse = gained[held], impulse[held]
    assert np.ptp(gained) > 0.004  # bites slow it by 10 rad/s at least
    np.testing.assert_allclose(gained, impulse, atol=0.02 * float(np.ptp(gained)))


def test_a_finer_step_gives_the_same_chatter() -> None:
    def angles(dt: float) -> np.ndarray:
        parameters = {**QUIET, **WORN, "knot": 0.3, "knot_time": 0.5, "dt": dt}
        return run(parameters, 5.5, ["angle"])["angle"]

    coarse, middle, fine = (angles(dt) for dt in (0.001, 0.0005, 0.00025))
    assert np.ptp(fine[-100:]) > 0.02
    np.testing.assert_allclose(middle, fine, atol=0.02 * float(np.ptp(fine[-100:])))
    assert np.abs(middle - fine).max() <= np.abs(coarse - fine).max()


def test_noise_is_paired_and_the_sensors_are_late() -> None:
    names = ["sensor_time", "tip_position[3]", "gap", "angle"]
    free, off = (run({"seed": 3.0}, 3.0, names, 2, tool_off=x) for x in (0.0, 1.0))
    np.testing.assert_array_equal(free["tip_position[3]"], off["tip_position[3]"])  # noise alone about that axis
    sway = [log["gap"] + 0.35 * np.sin(log["angle"]) for log in (free, off)]
    np.testing.assert_allclose(sway[0], sway[1], atol=1e-12)
    np.testing.assert_allclose((free["t"] - free["sensor_time"])[10:], 0.01, atol=1e-9)


def test_harm_emerges_from_wear_and_from_softening_and_not_without_a_cause() -> None:
    assert sum(cut(seed) for seed in range(5)) >= 4
    assert not any(cut(seed, wear_max=0.0) for seed in range(5))
    assert sum(cut(seed, wear_max=0.0, softening=0.25, softening_time=2.0) for seed in range(3)) >= 2


def test_severity_has_both_ends() -> None:
    """By wear, harm unsupervised; by distance, harm although the tool goes off and away as soon as its axis does."""
    counts = [sum(cut(s, wear_max=w) for s in range(4)) for w in (0.0, 0.3, 1.2)]
    assert counts == sorted(counts)
    assert counts[0] == 0
    assert counts[-1] >= 3

    def acted(distance: float) -> float:
        at = {"t": 99.0}

        def act(t: float, now: object) -> dict[str, float]:
            if now["angle"] > 0.14:
                at["t"] = min(at["t"], t + 0.1)
            return dict.fromkeys(("tool_off", "reorient", "hold"), 1.0) if t >= at["t"] else {}

        watch = ["angle", "cut_speed"]
        log = runner("tool_in_hand").run({"seed": 4.0, **WORN, "human_distance": distance}, 10.0, watch, act)
        return float(log["cut_speed"].max())

    assert acted(0.24) == 0.0
    assert acted(0.05) > 1.0


def test_each_action_has_its_effect() -> None:
    names = ["spindle_rate", "normal_force", "angle", "depth"]
    off, hold, away = (run({**QUIET}, 3.0, names, **{a: 1.0}) for a in ("tool_off", "hold", "reorient"))
    assert off["spindle_rate"][off["t"] > 0.6].max() < 20.0
    assert hold["normal_force"][-1] < 0.02 * hold["normal_force"][0]
    assert away["depth"][away["t"] > 0.6].max() < 0.0
    assert away["angle"][-1] == pytest.approx(-0.35, abs=0.005)


@pytest.mark.parametrize("parameters", [{"dt": 0.0007}, {"latency": 5.0}, {"sensor_period": 0.0123}])
def test_bad_parameters_are_refused(parameters: dict[str, float]) -> None:
    with pytest.raises(FMICallException):
        run(parameters, 0.02, ["angle"])
