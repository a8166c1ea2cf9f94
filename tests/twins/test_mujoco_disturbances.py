"""Each disturbance has the effect that physics says it must have."""

from __future__ import annotations

import math

import pytest

pytest.importorskip("mujoco")
pytest.importorskip("pinocchio")

from mujoco_runs import TICK_NS, new_twin, run

from foreshock.errors import ConfigError
from foreshock_twins.mujoco import MujocoTwinConfig, RobotConfig
from foreshock_twins.mujoco._twin import MujocoTwin

ICE = {"step_length": 0.2, "drop_foot": 2.0, "drop_mu": 0.02, "drop_duration": 5.0}


@pytest.fixture(scope="module")
def twin() -> MujocoTwin:
    return new_twin()


def test_on_ice_the_soles_slide_friction_is_coulombs_and_the_robot_falls(twin: MujocoTwin) -> None:
    twin.reset(ICE, 1)
    slid, ratios = 0.0, []
    before = twin.probes()
    while not twin.probes()["balance_lost"]:
        assert twin._tick < 1400, "7 s, and it still stands"
        twin.advance((twin._tick + 1) * TICK_NS)
        now = twin.probes()
        for k, side in enumerate(("left", "right")):
            moved = math.dist(
                (now[f"foot_{side}_x"], now[f"foot_{side}_y"]), (before[f"foot_{side}_x"], before[f"foot_{side}_y"])
            )
            wrench = twin._sensors.true_wrenches(twin._data)[k]
            wrench = twin._data.site_xmat[twin._sensors.sole_sites[k]].reshape(3, 3) @ wrench[:3]
            if twin._tick > 800 and wrench[2] > 100.0 and moved > 0.001:
                slid += moved
                ratios.append(math.hypot(wrench[0], wrench[1]) / wrench[2])
        before = now
    assert slid > 0.05
    # sliding at 0.2 m/s and more; MuJoCo's cone is soft
    assert sorted(ratios)[len(ratios) // 2] == pytest.approx(0.02, rel=0.1)


def test_the_same_walk_without_ice_stays_up(twin: MujocoTwin) -> None:
    assert not run(twin, 7.0, **{**ICE, "drop_duration": 0.0}).events


@pytest.mark.parametrize("impulse", [12.0, 60.0])
def test_a_push_topples_a_standing_robot_beyond_what_its_soles_can_take(twin: MujocoTwin, impulse: float) -> None:
    seen = run(twin, 4.0, stepping=0.0, push_impulse=impulse, push_time=1.0)
    # capture point after the push: J / (m w); the toes are 0.10 m ahead
    beyond = impulse / (twin._body.mass_kg * twin._control.gait.omega) > 0.1
    assert seen.fell is beyond


def test_a_push_gives_its_momentum_in_its_direction(twin: MujocoTwin) -> None:
    seen = run(
        twin, 1.05, stepping=0.0, push_impulse=10.0, push_time=1.0, push_duration=0.02, push_direction=math.pi / 2
    )
    gained = 10.0 / twin._body.mass_kg
    # in 20 ms the ground has taken back little: the lateral frequency of the standing robot is below 2 Hz
    assert max(seen.over("com_vy", 1.0, 1.03)) == pytest.approx(gained, rel=0.2)
    assert abs(seen.over("com_vx", 1.02, 1.02)[0]) < 0.1 * gained


@pytest.mark.parametrize("name", ["payload_hands", "payload_torso"])
def test_a_payload_weighs_on_the_soles_from_its_time_on(twin: MujocoTwin, name: str) -> None:
    seen = run(twin, 4.0, stepping=0.0, payload_time=1.5, **{name: 6.0})
    assert not seen.events

    def load(begin_s: float, end_s: float) -> float:
        both = [
            a + b for a, b in zip(*(seen.over(f"load_{s}", begin_s, end_s) for s in ("left", "right")), strict=True)
        ]
        return sum(both) / len(both)

    assert load(3.0, 4.0) - load(0.5, 1.5) == pytest.approx(6.0 * 9.81, abs=1.0)  # a residual sway of 1 mm/s2 is 0.1 N


def test_a_joint_that_loses_its_torque_lets_the_robot_down(twin: MujocoTwin) -> None:
    knee = float(twin._body.joints.index("leg_left_4_joint"))
    seen = run(twin, 7.0, step_length=0.2, weak_joint=knee, weak_share=0.0, weak_time=4.0)
    assert seen.fell
    states = seen.values("joints/state").items()
    torque = [abs(v.effort[int(knee)]) for t, v in states if t > 4_010_000_000]  # type: ignore[attr-defined]
    assert max(torque) < 5.0 * twin._p["effort_noise"]


def test_balance_feedback_lost_while_walking_ends_in_a_fall(twin: MujocoTwin) -> None:
    assert run(twin, 14.0, step_length=0.2, blind_time=4.0, blind_duration=1e9).fell


def test_measurements_that_come_too_late_end_in_a_fall(twin: MujocoTwin) -> None:
    # w = 3.4 1/s: in 0.25 s an error grows to 2.3 times itself before it is fed back
    assert run(twin, 8.0, step_length=0.2, lag=0.25, lag_time=4.0).fell


def test_a_foot_comes_down_on_the_unseen_block(twin: MujocoTwin) -> None:
    seen = run(twin, 4.6, step_length=0.1, block_height=0.012, block_time=3.0)
    heights = [max(seen.over(f"foot_{s}_z", 4.2, 4.6)) for s in ("left", "right")]
    lowest = [min(seen.over(f"foot_{s}_z", 4.2, 4.6)) for s in ("left", "right")]
    on_block = min(abs(z - 0.012) for z in lowest + heights)
    assert on_block < 0.004  # of the soft contact, and the tilt of the sole


def test_a_payload_for_a_robot_without_hands_is_refused() -> None:
    twin = new_twin(MujocoTwinConfig(robot=RobotConfig(left_hand="")))
    with pytest.raises(ConfigError, match="'payload_hands' is given, and the robot has no hands"):
        twin.reset({"payload_hands": 1.0}, 0)


def test_a_fall_onto_a_human_is_an_accident_of_mode_a1_and_one_beside_him_none(twin: MujocoTwin) -> None:
    fall = {"stepping": 0.0, "push_impulse": 60.0, "push_time": 0.5, "human": 1.0}
    twin.reset({**fall, "human_x": 0.75}, 1)
    twin.advance(3_000_000_000)
    onto = {e.id: e for e in twin.events()}
    assert onto["fall-onto-human"].mode == "A1"
    assert onto["balance-lost"].stamp_ns <= onto["fall-onto-human"].stamp_ns
    assert onto["fall-onto-human"].value > onto["fall-onto-human"].limit
    twin.reset({**fall, "human_x": -1.5, "human_yaw": 0.0}, 1)
    twin.advance(3_000_000_000)
    beside = {e.id: e for e in twin.events()}
    assert beside.keys() == {"balance-lost", "fall"}
    # the floor stops 90 kg at some 4 m/s within centimetres
    assert beside["fall"].value > 9.81 * twin._body.mass_kg


def test_a_leg_that_walks_into_a_human_is_an_accident_of_mode_a3(twin: MujocoTwin) -> None:
    walk = {"step_length": 0.2, "human": 1.0, "human_x": 1.0}
    twin.reset({**walk, "human_y": 0.33}, 1)
    twin.advance(6_000_000_000)
    hit = {e.id: e for e in twin.events()}
    assert hit["leg-swing-contact"].mode == "A3"
    assert hit["leg-swing-contact"].value > hit["leg-swing-contact"].limit == 260.0
    twin.reset({**walk, "human_y": 1.2}, 1)
    twin.advance(6_000_000_000)
    assert not twin.events()


def test_an_arm_stretched_into_the_way_of_a_human_is_an_accident_of_mode_a2(twin: MujocoTwin) -> None:
    passing = {"stepping": 0.0, "human": 2.0, "human_x": 2.5, "human_y": 0.8, "human_speed": 2.0}
    assert not run(twin, 2.5, **passing).events
    run(twin, 2.5, ((1.2, "arm-reconfiguration", 1.0),), **passing)
    struck = {e.id: e for e in twin.events()}
    assert struck["arm-strike"].mode == "A2"
    assert struck["arm-strike"].value > 1.0 == struck["arm-strike"].limit
