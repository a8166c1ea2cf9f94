"""The actuator-chain plant: energy, heat, queue, FMI, pairing, and that the loss of voltage decides what happens."""

from __future__ import annotations

import math

import numpy as np
import pytest
from fmpy import read_model_description
from fmpy.validation import validate_fmu
from plant_runner import Log, runner

from foreshock_fmus import build_fmu

TRUTH = (
    "angle", "due_angle", "drive_torque", "torque_limit", "loop_latency", "gap", "contact_force_peak", "volts", "heat",
    "braked",
)  # fmt: skip
ACTS = ("derate", "protective_stop", "brake_joints")
BRAKE = ("protective_stop", "brake_joints")
NO_LOSS = {"friction": 0.0, "viscosity": 0.0, "gear_damping": 0.0, "backlash": 0.0}


def sag(volts: float, seed: int = 1, act_at: float = math.inf, acts: tuple[str, ...] = BRAKE, **more: float) -> Log:
    """Twelve seconds in which the supply loses volts between 3 s and 5 s."""
    parameters = {"sag": volts, "sag_time": 3.0, "sag_ramp": 2.0, "seed": seed, "hand_height": -0.06, **more}

    def inputs(t: float, _: object) -> dict[str, float]:
        return {name: float(t >= act_at - 1e-9 and name in acts) for name in ACTS}

    return runner("actuator_chain").run(parameters, 12.0, TRUTH, inputs, 0.02)


def after(log: Log, name: str, above: float) -> float:
    """When a variable is first above a bound."""
    over = log[name] > above
    return float(log["t"][np.argmax(over)]) if over.any() else math.inf


@pytest.mark.parametrize("version", [2, 3])
def test_fmu_is_valid(version: int) -> None:
    assert validate_fmu(build_fmu("actuator_chain", version)) == []


def test_fmi_2_and_3_give_equal_results() -> None:
    two, three = (runner("actuator_chain", v).run({"sag_time": 0.5}, 5.0, TRUTH, h=0.02) for v in (2, 3))
    for name in TRUTH:
        assert np.array_equal(two[name], three[name]), name


def test_limp_arm_without_losses_keeps_its_energy() -> None:
    """Arm and rotor on the gear's spring swing down through the horizontal; RK4 holds 1e-4 of what is moved."""
    free = {**NO_LOSS, "passive": 1.0, "sag": 0.0, "hand_height": -9.0, "dt": 0.0005}
    log = runner("actuator_chain").run(free, 0.5, ("energy", "angle"), h=0.01)
    moved = (4.9 * 0.2 + 4.0 * 0.55) * 9.81 * (math.sin(log["angle"][0]) - math.sin(log["angle"].min()))
    assert moved > 10.0
    assert log["energy"] == pytest.approx(np.full(len(log["t"]), log["energy"][0]), abs=1e-4 * moved)


def test_drive_carries_the_weight_and_the_winding_warms_as_copper_does() -> None:
    """At rest: torque = weight, but for friction; V = E - R (I_rest + P / V); C T' = R i^2 - (T - T_a) / R_h."""
    rest = {"sag": 0.0, "angle_low": 0.4, "angle_high": 0.4, "friction": 0.0, "hand_height": -9.0, "heat_start": 298.15}
    log = runner("actuator_chain").run(rest, 30.0, ("drive_torque", "heat", "volts", "angle"), h=0.02)
    weight = (4.9 * 0.2 + 4.0 * 0.55) * 9.81 * np.cos(log["angle"][-1])
    assert log["drive_torque"][-1] == pytest.approx(weight, rel=1e-3)
    current, heat, cold, span = weight / 9.6, 298.15, 1.1, 1e-3
    for _ in range(30000):
        loss = current**2 * cold * (1.0 + 0.0039 * (heat - 298.15))
        heat += span * (loss - (heat - 298.15) / 1.6) / 45.0
    assert log["heat"][-1] == pytest.approx(heat, abs=0.02)
    volts = log["volts"][-1]
    assert volts == pytest.approx(50.4 - 0.12 * (14.0 + loss / volts), abs=1e-3)


def test_halving_the_step_changes_nothing_that_matters() -> None:
    """Up to the touch; the computing times are the same draws, for control runs every 5 ms in both."""
    one, half = (sag(15.0, dt=dt, hand_height=-9.0) for dt in (0.001, 0.0005))
    upright = one["t"] < 5.0
    assert one["angle"][upright] == pytest.approx(half["angle"][upright], abs=1e-3)
    assert one["volts"][upright] == pytest.approx(half["volts"][upright], abs=1e-3)


def test_latency_grows_as_a_queue_does() -> None:
    """While it overflows, backlog grows by mean work less the period per period, up to its end."""
    log = sag(16.0)
    calm, grown = log["t"] < 3.0, log["loop_latency"] > 0.02
    assert np.median(log["loop_latency"][calm][1:]) == pytest.approx(0.0023, rel=0.1)
    start = np.argmax(grown)
    slope = (log["loop_latency"][start + 4] - log["loop_latency"][start]) / 0.08
    work = 0.0023 * (1.0 + 1.3) / 0.75
    assert slope == pytest.approx(work / 0.005 - 1.0, rel=0.5)  # the clock is slowed by degrees between 40 and 38 V
    assert log["loop_latency"].max() < 0.14 + 0.02


def test_neither_a_slow_clock_nor_active_limits_alone_overload_the_computer() -> None:
    assert sag(16.0, solve_bound=0.0)["loop_latency"].max() < 0.02
    assert sag(0.0, volts_throttle=60.0)["loop_latency"].max() < 0.02


def test_same_seed_same_run_and_action_leaves_the_noise_alone() -> None:
    """Without load the limit binds in neither run: what differs is the plan, and computing times stay the same."""
    assert np.array_equal(sag(15.0, 7)["angle"], sag(15.0, 7)["angle"])
    calm, derated = sag(0.0, 7), sag(0.0, 7, act_at=1.0, acts=("derate",))
    assert np.array_equal(calm["loop_latency"], derated["loop_latency"])
    assert not np.array_equal(calm["angle"], derated["angle"])


def test_lost_cells_crush_the_hand_and_without_the_loss_it_is_safe() -> None:
    crushed, safe = sag(15.0), sag(0.0)
    assert crushed["contact_force_peak"][-1] > 140.0
    bound = crushed["t"][np.argmax((crushed["torque_limit"] <= crushed["drive_torque"] + 1e-9) & (crushed["t"] > 3.0))]
    late, touch = after(crushed, "loop_latency", 0.02), after(crushed, "contact_force_peak", 0.0)
    drift = float(crushed["t"][np.argmax(np.abs(crushed["angle"] - crushed["due_angle"]) > 0.03)])
    assert 3.0 < bound < late < touch
    assert bound < drift < touch
    assert safe["contact_force_peak"][-1] == 0.0
    assert safe["gap"].min() > 0.15
    assert np.abs(safe["angle"] - safe["due_angle"]).max() < 0.02


def test_temperatures_are_kelvin_as_their_unit_says() -> None:
    """45, 110, 140 and 25 degrees Celsius; R_25 is that at 25 degrees Celsius."""
    kelvin = [v for v in read_model_description(build_fmu("actuator_chain", 2)).modelVariables if v.unit == "K"]
    celsius = {v.name: float(v.start) - 273.15 for v in kelvin if v.causality == "parameter" and v.name != "heat_noise"}
    expected = {"heat_start": 45.0, "heat_fold": 110.0, "heat_most": 140.0, "ambient": 25.0}
    assert celsius == pytest.approx(expected, abs=1e-9)  # rounding


def test_hot_winding_is_another_way_to_the_same_end() -> None:
    hot = sag(0.0, heat_start=405.15)
    assert hot["contact_force_peak"][-1] > 140.0


def test_more_voltage_lost_does_more_harm_at_both_ends() -> None:
    crushed = [sum(sag(v, s)["contact_force_peak"][-1] > 140.0 for s in range(3)) for v in (6.0, 10.0, 15.0, 25.0)]
    assert crushed == sorted(crushed)
    assert crushed[0] == 0
    assert crushed[-1] == 3


def test_brake_at_the_drift_saves_the_hand_unless_it_is_too_close() -> None:
    """Supply gone at once: the load falls until the brake has closed and settles by its play, some 2 cm in all."""
    gone = {"sag_ramp": 0.02, "angle_high": 0.36}
    peaks = {
        gap: sag(40.0, 1, 3.1, **gone, hand_height=0.55 * math.sin(0.36) - gap)["contact_force_peak"][-1]
        for gap in (0.01, 0.08)
    }
    assert peaks[0.01] > 140.0
    assert peaks[0.08] == 0.0


def test_braked_arm_sags_by_play_and_wind_up() -> None:
    """At rest, healthy: half of the hub's play, and the weight on the brake's spring."""
    log = sag(0.0, act_at=3.0, angle_high=0.36)
    weight = (4.9 * 0.2 + 4.0 * 0.55) * 9.81 * math.cos(0.36)
    down = log["angle"][149] - log["angle"][-1]
    assert log["braked"][-1] == 1.0
    assert down == pytest.approx(0.01 + (weight - 3.0) / 6000.0, abs=0.003)


def test_protective_stop_holds_what_foldback_leaves_and_no_more() -> None:
    """At 9 V the drive alone carries the load; at 25 V it cannot, and the arm sinks onto the hand all the same."""
    assert sag(9.0, act_at=5.0, acts=("protective_stop",))["contact_force_peak"][-1] == 0.0
    assert sag(25.0, act_at=4.0, acts=("protective_stop",))["contact_force_peak"][-1] > 140.0


def test_bad_parameters_are_refused() -> None:
    with pytest.raises(Exception, match="Initialization"):
        runner("actuator_chain").run({"dt": 0.003}, 0.1, ("angle",))
