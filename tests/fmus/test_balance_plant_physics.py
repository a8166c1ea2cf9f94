"""Laws that the balance plant must obey whatever its parameters: energy, friction, support, symmetry, convergence."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from balance_bench import NOISELESS, QUIET, bench
from hypothesis import given, settings
from hypothesis import strategies as st

H_M, MASS_KG, G, SOLE_M = 0.87668, 90.272192, 9.81, 0.06
# Ankles and hips that do not answer: the CoP stays where it is, the trunk is not driven.
STANDING = {"stepping": 0.0, "com_bias": 0.0, "drop_duration": 0.0, **QUIET}
PASSIVE = {**STANDING, "ankle_lag": 1e12, "hip_lag": 1e12, "mu": 2.0}
MOTION = ("com_y", "com_vy", "torso_roll", "torso_rate", "foot_left_y", "foot_right_y", "zmp_y")


def passive_run(impulse: float, t_end: float):
    stiff = {"friction_stiffness": 2e4, "friction_damping": 30.0}
    push = {"push_impulse": impulse, "push_time": 0.1, "push_duration": 0.05, "push_height": H_M}
    _, log = bench().run({**PASSIVE, **stiff, **push}, t_end=t_end, watch=(*MOTION, "upright"))
    return log


def test_passive_robot_is_a_linear_inverted_pendulum_with_constant_orbital_energy():
    """com'' = w^2 (com - P), w^2 = m g / (m h - beta), beta = -10.78 kg m by Pinocchio."""
    log = passive_run(8.0, 0.9)
    after = (log["t"] > 0.2) & (log["upright"] > 0.5)
    y, v = log["com_y"][after] - log["zmp_y"][after], log["com_vy"][after]
    w2 = MASS_KG * G / (MASS_KG * H_M + 10.776)
    energy = v**2 - w2 * y**2
    assert energy[0] > 0.004
    assert energy == pytest.approx(np.full(len(energy), energy[0]), rel=0.01)
    t = log["t"][after] - log["t"][after][0]
    w = math.sqrt(w2)
    closed = y[0] * np.cosh(w * t) + v[0] / w * np.sinh(w * t)
    assert y == pytest.approx(closed, rel=0.02)


def test_ground_never_gives_energy_to_the_feet():
    """Work of friction on the feet only falls, but for what the bristles can store: N mu^2 / (2 s0), 0.64 J."""
    watch = ("foot_left_y", "foot_right_y", "friction_left", "friction_right", "upright")
    _, log = bench().run({}, t_end=5.0, watch=watch)
    standing = log["upright"] > 0.5
    work = np.zeros(standing.sum() - 1)
    for foot in ("left", "right"):
        y, force = log[f"foot_{foot}_y"][standing], log[f"friction_{foot}"][standing]
        loaded = 0.5 * (force[1:] + force[:-1])
        work += np.cumsum(loaded * np.diff(y))
    rise = np.max(work - np.minimum.accumulate(work))
    assert rise < 0.64 + 0.1
    assert work[-1] < -1.0, "a foot has slid"


@given(
    mu=st.floats(0.02, 0.08),
    start=st.floats(1.0, 3.0),
    duration=st.floats(0.05, 1.0),
    foot=st.sampled_from([0.0, 1.0, 2.0]),
    push=st.floats(-25.0, 25.0),
    seed=st.integers(0, 2**40),
)
@settings(max_examples=25, deadline=None)
def test_friction_stays_in_its_cone_and_the_cop_in_the_support(mu, start, duration, foot, push, seed):
    parameters = {
        "drop_mu": mu, "drop_time": start, "drop_duration": duration, "drop_foot": foot, "push_impulse": push,
        "push_time": 2.0, "seed": float(seed),
    }  # fmt: skip
    sides = ("left", "right")
    watch = [f"{n}_{s}" for n in ("friction", "load", "support") for s in sides] + [f"foot_{s}_y" for s in sides]
    _, log = bench().run(parameters, t_end=4.5, watch=[*watch, "zmp_y", "support_min_y", "support_max_y", "upright"])
    standing = log["upright"] > 0.5
    t = log["t"] - 0.001  # friction shown at the end of a step is that of the step
    for i, side in enumerate(sides):
        slippery = (t >= start - 0.001) & (t < start + duration - 0.001) & (foot in (i, 2.0))
        edge = (np.abs(t - start) < 0.0021) | (np.abs(t - start - duration) < 0.0021)
        limit = np.where(slippery & ~edge, mu, 0.6) * log[f"load_{side}"]
        assert np.all(np.abs(log[f"friction_{side}"][standing]) <= limit[standing] + 1e-9)
        assert np.all(log[f"load_{side}"] >= 0.0)
    assert np.all(log["zmp_y"] >= log["support_min_y"] - 1e-12)
    assert np.all(log["zmp_y"] <= log["support_max_y"] + 1e-12)
    left, right = log["support_left"] > 0.5, log["support_right"] > 0.5
    assert np.all(left | right)
    high = np.where(left, log["foot_left_y"], log["foot_right_y"]) + SOLE_M
    assert log["support_max_y"][standing] == pytest.approx(high[standing], abs=1e-12)


def test_mirrored_case_is_the_mirror_image():
    names = [*MOTION, "contact_force_peak", "tilt", "arm_left", "arm_right"]
    plain = {"seed": 5.0, "drop_foot": 0.0}
    bias, place = bench().start[bench().index["com_bias"]][0], bench().start[bench().index["human_place_y"]][0]
    mirrored = {"seed": 5.0, "drop_foot": 1.0, "first_support": -1.0, "com_bias": -bias, "human_place_y": -place}
    for acts in ((), ("step", "arms")):
        ev_a, a = bench().run(plain, t_end=6.0, watch=names, trigger=2, acts=acts)
        ev_b, b = bench().run(mirrored, t_end=6.0, watch=names, trigger=2, acts=acts)
        for event, when in ev_a.items():  # mirrored sums round differently
            assert ev_b[event] == pytest.approx(when, rel=1e-6), event
        for one, other, sign in (
            ("com_y", "com_y", -1), ("torso_roll", "torso_roll", -1), ("zmp_y", "zmp_y", -1), ("tilt", "tilt", -1),
            ("contact_force_peak", "contact_force_peak", 1), ("foot_left_y", "foot_right_y", -1),
            ("arm_left", "arm_right", 1),
        ):  # fmt: skip
            assert a[one] == pytest.approx(sign * b[other], rel=1e-6, abs=1e-6), one


def test_later_disturbance_gives_the_same_cascade_later():
    b = bench()
    gait = 2.0 * (b.start[b.index["single_support"]][0] + b.start[b.index["double_support"]][0])
    start = b.start[b.index["drop_time"]][0]
    first, _ = b.run({**QUIET, "drop_time": start + gait}, t_end=10.0)
    later, _ = b.run({**QUIET, "drop_time": start + 2.0 * gait}, t_end=10.0)
    assert math.isfinite(first["contact"])
    for event in ("slip", "torso", "com", "tip", "contact", "fallen"):
        assert later[event] - first[event] == pytest.approx(gait, abs=0.002)


@pytest.mark.parametrize("parameters", [QUIET, {"seed": 3.0}, {"seed": 4.0, "push_impulse": 8.0}])
def test_half_the_step_moves_no_event_by_more_than_two_milliseconds(parameters):
    coarse, _ = bench().run(parameters, t_end=6.0)
    fine, _ = bench().run({**parameters, "dt": 0.0005}, t_end=6.0)
    for event in ("slip", "torso", "com", "tip", "contact", "fallen"):
        assert fine[event] == pytest.approx(coarse[event], abs=0.002 + 1e-9), event
    assert fine["peak"] == pytest.approx(coarse["peak"], rel=0.02)


def test_sensor_noise_and_latency_do_not_touch_the_plant():
    _, a = bench().run({"seed": 8.0}, t_end=5.0, watch=MOTION)
    _, b = bench().run({"seed": 8.0, **NOISELESS, "sensor_period": 0.01}, t_end=5.0, watch=MOTION)
    _, c = bench().run({"seed": 9.0}, t_end=5.0, watch=MOTION)
    for name in MOTION:
        assert np.array_equal(a[name], b[name])
    assert not np.array_equal(a["com_y"], c["com_y"])


def test_intervention_leaves_the_process_noise_paired():
    """Robot standing still: acting changes nothing that moves it, so both runs stay equal but for the arms."""
    base = {"stepping": 0.0, "drop_duration": 0.0}
    _, a = bench().run(base, t_end=3.0, watch=MOTION)
    _, b = bench().run(base, t_end=3.0, watch=MOTION, trigger=4, delay=1.0, acts=("step", "mitigation"))
    for name in MOTION:
        assert np.array_equal(a[name], b[name])


def test_latency_shows_the_past():
    _, now = bench().run({**NOISELESS}, t_end=1.0, h=0.005, watch=("q", "sensor_time"))
    _, late = bench().run({**NOISELESS, "latency": 0.03}, t_end=1.0, h=0.005, watch=("q", "sensor_time"))
    assert np.array_equal(late["q"][6:], now["q"][:-6])
    assert late["sensor_time"][6:] == pytest.approx(late["t"][6:] - 0.03, abs=1e-9)


def test_noise_has_the_declared_spread_and_no_drift():
    """Standing: 1000 samples, so that the spread is known to 2.2% (one sd); five of them are allowed."""
    _, log = bench().run(STANDING, t_end=5.0, h=0.005, watch=("q", "imu_gyro", "left_force", "imu_acceleration"))
    q, gyro, force = log["q"], log["imu_gyro"], log["left_force"]
    for values, sd in ((q[:, 20], 1e-4), (q[:, 0], 3e-4), (gyro[:, 1], 5e-3), (force[:, 0], 2.0)):
        assert np.std(values) == pytest.approx(sd, rel=0.12)
        assert abs(np.mean(values) - np.median(values)) < 0.2 * sd
        assert abs(np.corrcoef(values[1:], values[:-1])[0, 1]) < 0.16
    assert np.mean(log["imu_acceleration"][:, 2]) == pytest.approx(G, abs=0.01)


def test_undamped_fall_keeps_pinocchios_energy():
    """Hips slack, legs elastic, nobody hit: kinetic plus potential energy by Pinocchio stays."""
    pin = pytest.importorskip("pinocchio")
    share = Path(pin.__file__).parents[4] / "share" / "example-robot-data" / "robots" / "talos_data"
    model = pin.buildModelFromUrdf(str(share / "robots" / "talos_reduced.urdf"), pin.JointModelFreeFlyer())
    data = model.createData()
    undamped = ("fall_hip_stiffness", "fall_hip_damping", "leg_damping", "stop_damping")
    free = {**dict.fromkeys(undamped, 0.0), "human_place_y": 50.0}
    _, log = bench().run({**QUIET, **NOISELESS, **free}, t_end=8.0, h=0.005, watch=("q", "v", "upright", "tilt"))
    falling = (log["upright"] < 0.5) & (np.abs(log["tilt"]) < 0.58)
    motion = zip(log["q"][falling], log["v"][falling], strict=True)
    kinetic = [pin.computeKineticEnergy(model, data, q, v) for q, v in motion]
    potential = [pin.computePotentialEnergy(model, data, q) for q in log["q"][falling]]
    total = np.array(kinetic) + np.array(potential)
    assert kinetic[-1] > 80.0
    assert np.max(total) < total[0] + 4.0, "no energy from nowhere"
    assert total[-1] == pytest.approx(total[0], abs=4.0)  # in between the hips' elastic stop stores some


def test_contact_obeys_momentum():
    """What the human gains is the impulse of the contact force."""
    _, log = bench().run(QUIET, t_end=8.0, watch=("contact_force", "human_true_y"))
    force, y = log["contact_force"], log["human_true_y"]
    assert force.max() > 0.0
    end = int(np.flatnonzero(force > 0.0)[-1]) + 1
    speed = abs(y[end] - y[end - 1]) / 0.001
    impulse = np.sum(0.5 * (force[1:end] + force[: end - 1])) * 0.001
    assert 40.0 * speed == pytest.approx(impulse, rel=0.05)


@pytest.mark.parametrize(
    ("parameters", "words"),
    [
        ({"dt": 0.0007}, "dt = 0.0007"),
        ({"first_support": 0.5}, "first_support"),
        ({"latency": 5.0}, "latency"),
        ({"delay": 5.0}, "delay"),
        ({"mu": math.nan}, "not finite"),
    ],
)
def test_bad_parameters_are_refused_with_a_reason(parameters, words):
    with pytest.raises(AssertionError, match=words):
        bench().init(parameters)


def test_bad_inputs_and_steps_are_refused():
    b = bench()
    b.init()
    assert b.step(0.0, 0.0007) == 1
    assert b.step(1.0, 0.005) == 1
    assert b.step(0.0, 0.005) == 0
    b["balance_lock"][:] = math.nan
    assert b.step(0.005, 0.005) == 2
