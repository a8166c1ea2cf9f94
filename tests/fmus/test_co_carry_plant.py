"""The co-carry plant: valid FMUs, energy, momentum, statics, free fall, severity from nothing to beyond help."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np
import pytest
from fmpy.validation import validate_fmu
from plant_runner import Log, runner

from foreshock_fmus import build_fmu

PLANT = "co_carry"
G = 9.81
LIFTED = {"lift": 0.37, "content_friction": 0.19}
WATCH = [
    "leg_force_peak",
    "robot_lost",
    "partner_lost",
    "slip",
    "content",
    "tilt",
    "lag",
    "robot_force",
    "partner_force",
]
STILL = {"partner_bounce": 0.0, "robot_bounce": 0.0, "cadence_noise": 0.0, "bounce_noise": 0.0}
Act = Callable[[float, Mapping[str, float]], Mapping[str, float]]


def run(
    parameters: dict[str, float], t_end: float = 16.0, act: Act | None = None, watch: list[str] = WATCH,
    version: int = 3, h: float = 0.02,
) -> Log:  # fmt: skip
    return runner(PLANT, version).run(parameters, t_end, watch, act, h)


def fell(parameters: dict[str, float], seeds: int = 4, act: Callable[[], Act] | None = None) -> int:
    """Runs in which the load falls on the partner's foot with more than 260 N."""
    runs = (run({"seed": float(s), **parameters}, act=act() if act else None) for s in range(seeds))
    return sum(int(log["leg_force_peak"][-1] > 260.0) for log in runs)


def once_out_of_step(**inputs: float) -> Callable[[], Act]:
    """Inputs that are set for good once the gaits are pi / 3 apart, 0.15 s later."""

    def make() -> Act:
        since: list[float] = []

        def act(t: float, now: Mapping[str, float]) -> Mapping[str, float]:
            if abs(now["lag"]) > math.pi / 3 and not since:
                since.append(t)
            return inputs if since and t >= since[0] + 0.15 else dict.fromkeys(inputs, 0.0)

        return act

    return make


@pytest.mark.parametrize("version", [2, 3])
def test_the_fmu_is_valid(version: int) -> None:
    assert validate_fmu(str(build_fmu(PLANT, version))) == []


def test_fmi_2_and_fmi_3_agree() -> None:
    watch = [*WATCH, "grip_normal", "agreed_share"]
    two, three = (run({"seed": 7.0, **LIFTED}, 12.0, None, watch, version) for version in (2, 3))
    for name in watch:
        np.testing.assert_array_equal(two[name], three[name])


def test_energy_is_kept_where_nothing_takes_it() -> None:
    """Arms as springs, frictionless content that starts off the middle and slides to and fro, nobody walks."""
    free = {**STILL, "partner_damping": 0.0, "robot_damping": 0.0, "content_friction": 0.0, "content_way": 50.0}
    strong = {"grip_margin": 20.0, "grip_max": 1e5, "partner_hold": 1e6, "content_start": 0.4, "overload_slowing": 0.0}
    strong["partner_reaction"] = 0.05
    changes = []
    for dt in (0.0002, 0.0001):
        log = run({**free, **strong, "dt": dt}, 1.2, None, ["energy", "tilt", "content"], h=0.02)
        assert np.ptp(log["tilt"]) > 0.01
        assert np.ptp(log["content"]) > 0.01
        changes.append(np.abs(log["energy"] - log["energy"][0]).max())
    assert changes[0] < 0.02
    assert changes[1] < 0.6 * changes[0], "of first order in the step"


def test_vertical_momentum_is_what_the_forces_give() -> None:
    """Walking, lifting and falling: arms, floor, foot and gravity, and nothing else. Trapezoids of a step each."""
    watch = ["vertical_momentum", "robot_force", "partner_force", "floor_force", "leg_force", "partner_lost"]
    dt = 0.0005
    log = run({"seed": 2.0, **LIFTED, "dt": dt}, 11.0, None, watch, h=dt)
    assert log["partner_lost"][-1] == 1.0
    force = log["robot_force"] + log["partner_force"] + log["floor_force"] + log["leg_force"] - 20.0 * G
    given = np.concatenate([[0.0], np.cumsum(force[1:]) * dt])
    momentum = log["vertical_momentum"]
    assert np.ptp(momentum) > 30.0
    # the content's tilt * speed is taken at the end of a step: some 0.1 % of the momentum
    np.testing.assert_allclose(momentum - momentum[0], given, atol=0.1)


def test_at_rest_the_lever_decides_the_shares() -> None:
    """Content at s, load level: the robot carries m g / 2 - m_c g s / L."""
    strong = {"grip_margin": 2.0, "grip_max": 1e4, "overload_slowing": 0.0}
    log = run({**STILL, **strong, "content_start": -0.3, "content_friction": 1.0}, 8.0)
    assert log["robot_force"][-1] == pytest.approx(20 * G / 2 + 12 * G * 0.3 / 1.6, rel=0.002)
    assert log["partner_force"][-1] == pytest.approx(20 * G / 2 - 12 * G * 0.3 / 1.6, rel=0.002)


def test_content_slides_once_the_tilt_exceeds_its_friction() -> None:
    """tan of the tilt, taken as the tilt: 0.2 rad of 1.6 m are 0.32 m of lift."""
    calm = {**STILL, "grip_margin": 2.0, "grip_max": 1e4, "content_friction": 0.2, "lift_duration": 4.0}
    below, above = (run({**calm, "lift": lift}, 20.0) for lift in (0.3, 0.36))
    assert np.abs(below["content"]).max() < 0.02
    assert above["content"].min() < -0.5


def test_a_dropped_end_falls_as_a_rod_that_turns_about_the_other() -> None:
    """Rigid hands of the partner, an empty box: the free end of a uniform rod starts with 3 g / 2 (closed form)."""
    empty = {**STILL, "content_mass": 0.0, "box_mass": 20.0, "partner_stiffness": 1e6, "partner_damping": 1e3}
    lose = {"friction": 0.01, "pad_length": 0.001, "partner_hold": 1e6, "dt": 0.0001, "partner_reaction": 0.05}
    log = run({**empty, **lose}, 0.4, None, ["robot_end_z", "robot_lost", "partner_end_z"], h=0.002)
    lost = int(np.argmax(log["robot_lost"] > 0.5))
    t, z = log["t"][lost : lost + 40] - log["t"][lost], log["robot_end_z"][lost : lost + 40]
    assert -2.0 * np.polyfit(t, z, 2)[0] == pytest.approx(1.5 * G, rel=0.05)


def test_half_the_step_moves_the_loss_by_less_than_a_tenth_of_a_second() -> None:
    """Without noise, whose draws are one per step."""
    calm = {**LIFTED, "cadence_noise": 0.0, "bounce_noise": 0.0}
    lost = []
    for dt in (0.001, 0.0005):
        log = run({**calm, "dt": dt})
        lost.append(log["t"][np.argmax(log["robot_lost"] > 0.5)])
        assert log["leg_force_peak"][-1] > 260.0
    assert lost[0] == pytest.approx(lost[1], abs=0.1)


def test_in_step_nothing_slips_for_a_minute() -> None:
    log = run({"seed": 3.0}, 60.0)
    assert log["slip"].max() < 0.01
    assert np.abs(log["lag"]).max() < 0.6
    assert log["leg_force_peak"].max() == 0.0


def test_severity_has_both_ends() -> None:
    falls = [fell({"lift": lift, "content_friction": 0.19}) for lift in (0.1, 0.25, 0.34, 0.4)]
    assert falls == sorted(falls)
    assert (falls[0], falls[-1]) == (0, 4)
    assert fell({**LIFTED, "content_way": 0.15}) == 0, "a partition saves it"
    assert fell({**LIFTED, "entrainment": 0.6}) < 4, "legs that keep step save it, or some"


def test_gripping_harder_and_standing_saves_and_too_late_it_does_not() -> None:
    """On ice the content is at the robot's end, and the grip lost, before the gaits are out of step."""
    assert fell(LIFTED) == 4
    assert fell(LIFTED, act=once_out_of_step(hold=1.0, regrasp=1.0, lower_load=1.0)) == 0
    harsh = {"lift": 0.6, "lift_duration": 0.6, "content_friction": 0.05}
    assert fell(harsh, act=once_out_of_step(hold=1.0, regrasp=1.0, lower_load=1.0)) == 4


def test_a_load_put_down_rests_on_the_floor() -> None:
    log = run({"seed": 1.0}, 8.0, lambda t, now: {"lower_load": float(t > 1.0), "hold": float(t > 1.0)},
              ["robot_end_z", "partner_end_z", "leg_force_peak"])  # fmt: skip
    assert log["robot_end_z"][-1] == pytest.approx(0.15, abs=0.02)
    assert log["partner_end_z"][-1] == pytest.approx(0.15, abs=0.02)
    assert log["leg_force_peak"][-1] == 0.0


def test_interventions_leave_the_noise_paired() -> None:
    """Gripping harder changes nothing of gaits and load while nothing slips."""
    firm = {"seed": 5.0, "grip_margin": 1.6}
    plain = run(firm, 10.0)
    acted = run(firm, 10.0, lambda t, now: {"regrasp": float(t > 2.0)})
    for name in ("lag", "robot_force", "partner_force", "tilt"):
        np.testing.assert_array_equal(plain[name], acted[name])


@pytest.mark.parametrize(
    "parameters", [{"dt": math.nan}, {"sensor_period": 0.0107}, {"latency": 1.0}, {"partner_reaction": 1.0, "dt": 1e-4}]
)
def test_bad_parameters_are_refused(parameters: dict[str, float]) -> None:
    with pytest.raises(Exception, match="fmi3"):
        run(parameters, 0.1)
    run({"dt": 0.001, "sensor_period": 0.02, "latency": 0.02, "partner_reaction": 0.35}, 0.1)
