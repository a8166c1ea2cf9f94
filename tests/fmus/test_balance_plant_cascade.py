"""The cascade emerges: slip, torso reaction, loss of the CoM, fall onto the human; and acting early saves the robot.

Precursor thresholds: slip 2 mm, torso rate 0.6 rad/s, CoM 40 mm off its plan. Timing bands: around the
source case (0 / 0.48 / 1.12 s), as wide as the README admits.
"""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest
from balance_bench import QUIET, bench

SEEDS = range(1, 25)
FAST = {"sensor_period": 0.1}  # nothing is measured here: saves time, and sensors do not touch the plant


@cache
def runs(trigger: int = 0, acts: tuple[str, ...] = (), parameters: tuple[tuple[str, float], ...] = ()):
    return [
        bench().run({**FAST, **dict(parameters), "seed": float(s)}, 9.0, h=0.005, trigger=trigger, acts=acts)[0]
        for s in SEEDS
    ]


def falls(*args, **kwargs) -> int:
    return sum(math.isfinite(event["tip"]) for event in runs(*args, **kwargs))


def since_slip(name: str) -> np.ndarray:
    return np.array([event[name] - event["slip"] for event in runs()])


def test_default_case_falls_onto_the_human_whatever_the_noise():
    assert falls() == len(SEEDS)
    for event in runs():
        assert event["slip"] < event["torso"] < event["com"] < event["tip"] < event["contact"] <= event["fallen"]
        assert event["peak"] > 280.0, "beyond the transient limit"


def test_timing_of_the_cascade():
    assert 0.3 < np.median(since_slip("torso")) < 0.6
    assert 0.6 < np.median(since_slip("com")) < 1.2
    assert 1.2 < np.median(since_slip("tip")) < 1.8
    assert np.median(since_slip("contact")) > np.median(since_slip("tip")) + 0.2


def test_slip_begins_after_the_friction_drop_and_not_without_it():
    drop = bench().start[bench().index["drop_time"]][0]
    assert all(event["slip"] > drop for event in runs())
    assert all(math.isinf(event["slip"]) for event in runs(parameters=(("drop_duration", 0.0),)))


def test_acting_on_the_second_precursor_saves_and_on_the_third_it_is_mostly_too_late():
    n = len(SEEDS)
    assert falls(1, ("step",)) == 0
    assert falls(2, ("step",)) < 0.5 * n
    assert falls(2, ("step", "lock")) <= 0.1 * n
    assert falls(2, ("step", "lock", "arms", "compliance")) <= 0.1 * n
    assert falls(3, ("step", "lock")) > 0.5 * n
    assert falls(3, ("step",)) > 0.5 * n


def test_not_every_action_helps():
    n = len(SEEDS)
    assert falls(2, ("arms",)) > 0.8 * n
    assert falls(1, ("compliance",)) < 0.2 * n, "yielding while the foot slides stops the slide"
    assert falls(2, ("compliance",)) > 0.5 * n, "the slide is over: too late"


def test_compliance_and_arms_break_no_survivor():
    alone = (("drop_mu", 0.06),)
    assert falls(parameters=alone) == 0
    for act in ("compliance", "arms", "lock"):
        assert falls(1, (act,), alone) == 0


def test_severity_sweep_holds_both_ends():
    assert falls(parameters=(("drop_mu", 0.07),)) == 0, "recovers alone"
    assert falls(parameters=(("drop_duration", 0.1),)) == 0, "recovers alone"
    hopeless = (("drop_duration", 0.0), ("push_impulse", 40.0))
    assert falls(2, ("step", "lock", "arms", "compliance"), hopeless) == len(SEEDS), "nobody can save it"


def test_larger_friction_makes_fewer_falls():
    counts = [falls(parameters=(("drop_mu", mu),)) for mu in (0.035, 0.044, 0.05, 0.06)]
    assert counts == sorted(counts, reverse=True)


def test_a_fall_to_the_other_side_meets_nobody():
    side = bench().start[bench().index["human_place_y"]][0]
    event, _ = bench().run({**QUIET, "human_place_y": -side}, t_end=10.0)
    assert math.isfinite(event["tip"])
    assert math.isfinite(event["fallen"])
    assert math.isinf(event["contact"])
    assert event["peak"] == 0.0


def test_human_out_of_reach_is_not_touched():
    event, _ = bench().run({**QUIET, "human_place_y": -2.5}, t_end=10.0)
    assert math.isfinite(event["fallen"])
    assert math.isinf(event["contact"])


@pytest.mark.parametrize("place", [-0.85, -0.9, -1.0])
def test_impact_mitigation_softens_the_contact(place):
    here = (("human_place_y", place),)
    plain, soft = runs(parameters=here), runs(3, ("mitigation",), here)
    gain = [b["peak"] / a["peak"] for a, b in zip(plain, soft, strict=True)]
    assert np.median(gain) < 0.95
    assert max(gain) < 1.1


@pytest.mark.parametrize(("stepping", "seed"), [(1.0, 1.0), (1.0, 2.0), (0.0, 1.0)])
def test_ten_minutes_without_disturbance_alarm_nobody(stepping, seed):
    parameters = {**FAST, "sensor_period": 1.0, "drop_duration": 0.0, "stepping": stepping, "seed": seed}
    event, _ = bench().run(parameters, t_end=600.0, h=0.005)
    assert math.isinf(event["tip"])
    assert event["max_slip"] < 0.5 * 0.002
    assert event["max_rate"] < 0.75 * 0.6
    assert event["max_deviation"] < 0.75 * 0.040


def test_released_interventions_bring_the_robot_back_to_stepping():
    b = bench()
    b.init({"drop_duration": 0.0, "seed": 3.0})
    supports, deviation = [], []
    for k in range(4000):
        on = 1.0 if 600 <= k < 1000 else 0.0
        for name in ("step_suppression", "balance_lock", "arm_reconfiguration", "compliance_tuning"):
            b[name][:] = on
        assert b.step(k * 0.005) == 0
        supports.append(b["support_left"][0] + b["support_right"][0])
        deviation.append(abs(b["com_deviation"][0]))
    both = np.array(supports) == 2.0
    assert both[640:1000].all(), "stays on both feet"
    assert not both[2000:].all(), "steps again"
    assert b["upright"][0] == 1.0
    assert max(deviation) < 0.04
    assert b["arm_left"][0] == pytest.approx(0.173, abs=0.01)
