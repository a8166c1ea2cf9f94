"""The grasp plant: valid FMUs, momentum, the fall, convergence, and a drop that emerges from an inflow of mass."""

from __future__ import annotations

import math

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.validation import validate_fmu
from plant_runner import Log, runner

from foreshock_fmus import build_fmu

G = 9.80665
FILLED = {"fill_time": 2.0, "fill_rate": 0.6, "fill_mass": 0.75, "mu": 0.45}
STILL = {"bounce": 0.0, "footfall": 0.0, "tremor": 0.0}
WATCH = ["slide", "wrist_rate", "tilt", "true_tangential", "impact_force_peak", "released"]


def run(
    parameters: dict[str, float], t_end: float, watch: list[str], version: int = 3, h: float = 0.005, **inputs: float
) -> Log:
    """A run with constant interventions."""
    return runner("grasp", version).run(parameters, t_end, watch, (lambda t, now: inputs) if inputs else None, h=h)


def dropped(seed: int, t_end: float = 14.0, **parameters: float) -> bool:
    log = run({"seed": float(seed), **FILLED, **parameters}, t_end, ["impact_force_peak"], h=0.05)
    return bool(log["impact_force_peak"].max() > 260.0)


@pytest.mark.parametrize("version", [2, 3])
def test_the_fmu_is_valid(version: int) -> None:
    assert validate_fmu(str(build_fmu("grasp", version))) == []


def test_fmi_2_and_fmi_3_agree() -> None:
    two, three = (run({"seed": 7.0, **FILLED}, 8.0, WATCH, version) for version in (2, 3))
    assert two["released"][-1] == 1.0
    for name in WATCH:
        np.testing.assert_array_equal(two[name], three[name])


def test_momentum_of_the_object_is_the_impulse_of_what_acts_on_it() -> None:
    """Put down while it slips: m v = integral of pads + support - weight, trapezoids at each tick, hence 1 % of it."""
    names = ["com_rate", "true_tangential", "support_force", "true_mass", "landed", "slide"]
    harder = {"mu": 0.32, "grip_force": 34.0, "lower_acceleration": 4.0, "support_damping": 0.0}  # no jump of force
    log = run({**STILL, **harder}, 1.5, names, h=0.001, lower_load=1.0)
    assert log["landed"][-1] == 1.0
    assert log["slide"].max() > 1e-4
    force = log["true_tangential"] + log["support_force"] - log["true_mass"] * G
    impulse = np.concatenate(([0.0], np.cumsum(0.5 * (force[1:] + force[:-1]) * 0.001)))
    momentum = log["true_mass"] * log["com_rate"]
    assert np.ptp(momentum) > 0.5
    np.testing.assert_allclose(momentum, impulse, atol=0.01 * float(np.ptp(momentum)))


def test_at_rest_the_pads_carry_the_weight_and_the_wrist_holds_level() -> None:
    log = run({**STILL, "mass": 1.4}, 2.0, ["true_tangential", "wrist_angle", "slide"])
    assert log["true_tangential"][-1] == pytest.approx(1.4 * G, rel=1e-4)
    # the planner feeds the moment of 1.5 kg forward, the wrist's stiffness holds the difference
    assert log["wrist_angle"][-1] == pytest.approx(0.1 * G * 0.13 / 60.0, rel=0.02)
    assert log["slide"].max() < 1e-4


def test_the_impact_has_the_energy_of_the_fall() -> None:
    """Undamped, F = m g + sqrt((m g)^2 + k m v^2) with v^2 = 2 g h; the contact's damping ratio of 6 % takes 8 %."""
    names = ["impact_force_peak", "fall_distance", "true_mass", "impact_over", "com_rate"]
    log = run({"seed": 1.0, **FILLED, "drop_height": 0.8}, 9.0, names)
    assert log["impact_over"][-1] == 1.0
    mass, speed = log["true_mass"][-1], -log["com_rate"].min()
    assert speed == pytest.approx(math.sqrt(2.0 * G * 0.76), rel=0.02)  # it leaves the pads with some 0.1 m/s
    peak = mass * G + math.sqrt((mass * G) ** 2 + 60_000.0 * mass * speed**2)
    assert 0.88 * peak < log["impact_force_peak"][-1] < peak


def test_a_finer_step_gives_the_same_slide() -> None:
    """Return mapping and the memory of friction are of first order: the error of the slide halves with the step."""
    quiet = {**FILLED, "tremor": 0.0, "footfall_spread": 0.0}

    def slide_m(dt: float) -> float:
        return float(run({**quiet, "dt": dt}, 4.0, ["slide"])["slide"][-1])

    coarse, middle, fine, finest = (slide_m(dt) for dt in (0.001, 0.0005, 0.00025, 0.0000625))
    assert finest > 0.01
    assert abs(middle - finest) < 0.05 * finest
    assert abs(fine - finest) < 0.7 * abs(middle - finest) < 0.7 * abs(coarse - finest)


def test_an_unstable_wrist_follows_from_slip_and_from_nothing_else() -> None:
    """The servo is stable with the object in its grip, and not without: D / I times the delay passes pi / 2."""
    held = run({"mu": 0.6, "seed": 2.0}, 8.0, ["wrist_rate"])
    slips = run({"seed": 2.0, **FILLED}, 8.0, ["wrist_rate", "slide", "released"])
    sliding = (slips["slide"] > 0.004) & (slips["released"] < 0.5)
    assert slips["wrist_rate"][sliding].std() > 4.0 * held["wrist_rate"].std()


def test_noise_is_paired_and_the_sensors_are_late() -> None:
    names = ["sensor_time", "gyro[1]", "hand_acceleration"]
    free, gripped = (run({"seed": 3.0, **FILLED}, 3.0, names, 2, regrasp=x) for x in (0.0, 1.0))
    np.testing.assert_array_equal(free["gyro[1]"], gripped["gyro[1]"])  # noise alone about that axis
    np.testing.assert_array_equal(free["hand_acceleration"], gripped["hand_acceleration"])
    np.testing.assert_allclose((free["t"] - free["sensor_time"])[10:], 0.01, atol=1e-9)


def test_a_drop_emerges_from_the_inflow_and_not_without_it() -> None:
    assert all(dropped(seed) for seed in range(4))
    assert not any(dropped(seed, fill_mass=0.0) for seed in range(4))


def test_severity_has_both_ends() -> None:
    by_mass = [sum(dropped(s, fill_mass=m) for s in range(3)) for m in (0.2, 0.5, 0.9)]
    by_friction = [sum(dropped(s, mu=mu) for s in range(3)) for mu in (0.60, 0.46, 0.42)]
    for counts in (by_mass, by_friction):
        assert counts == sorted(counts)
        assert counts[0] == 0
        assert counts[-1] == 3
    grip = {"regrasp": 1.0, "lower_load": 1.0}
    watch = ["impact_force_peak"]
    assert run({**FILLED, "fill_mass": 4.5, "fill_rate": 5.0}, 6.0, watch)["impact_force_peak"].max() > 260.0
    late = runner("grasp").run(
        {**FILLED, "fill_mass": 4.5, "fill_rate": 5.0}, 6.0, watch, lambda t, now: grip if t > 2.5 else {}, h=0.005
    )
    assert late["impact_force_peak"].max() > 260.0  # nothing saves it half a second after the inflow began


def test_regrasp_cannot_be_held_for_ever() -> None:
    """The motor's heat, theta' = ((F / F_c)^2 - theta) / T, passes 1 after T ln((r - theta_0) / (r - 1))."""
    log = run({**STILL}, 8.0, ["true_normal", "heat"], regrasp=1.0)
    own = runner("grasp").start
    limit, most = own["force_continuous"], own["regrasp_force"]
    ratio, start = (most / limit) ** 2, (own["grip_force"] / limit) ** 2
    hot_s = own["thermal_time"] * math.log((ratio - start) / (ratio - 1.0))
    before, after = log["t"] < hot_s - 0.1, log["t"] > hot_s + 0.4
    assert log["true_normal"][before].max() == pytest.approx(most, abs=0.1)
    assert log["true_normal"][after].max() < limit + 0.1


@pytest.mark.parametrize("parameters", [{"dt": 0.0007}, {"latency": 5.0}, {"mu": 0.1}, {"sensor_period": 0.0123}])
def test_bad_parameters_are_refused(parameters: dict[str, float]) -> None:
    with pytest.raises(FMICallException):
        run(parameters, 0.02, ["slide"])
