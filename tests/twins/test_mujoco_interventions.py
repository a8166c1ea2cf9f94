"""Each intervention changes what the robot does, by its strength, and is undone when released; which helps depends."""

from __future__ import annotations

import pytest

pytest.importorskip("mujoco")
pytest.importorskip("pinocchio")

from mujoco_runs import TICK_NS, Seen, new_twin, run

from foreshock.messages import JointState
from foreshock_twins.mujoco._twin import MujocoTwin

ICE = {"step_length": 0.2, "drop_foot": 2.0, "drop_mu": 0.02, "drop_duration": 5.0}


@pytest.fixture(scope="module")
def twin() -> MujocoTwin:
    return new_twin()


def joint(twin: MujocoTwin, seen: Seen, name: str, at_s: float) -> float:
    state = seen.values("joints/state")[round(at_s / 0.005) * TICK_NS]
    assert isinstance(state, JointState)
    return state.position[state.name.index(name)]


@pytest.mark.parametrize("seed", [1, 2])
def test_suppressing_the_step_saves_the_robot_on_ice(twin: MujocoTwin, seed: int) -> None:
    assert run(twin, 7.0, seed=seed, **ICE).fell
    assert not run(twin, 7.0, ((4.4, "step-suppression", 1.0),), seed=seed, **ICE).fell


def test_too_late_it_saves_nothing(twin: MujocoTwin) -> None:
    lost_s = run(twin, 7.0, **ICE).events["balance-lost"]
    assert run(twin, 7.0, ((lost_s - 0.05, "step-suppression", 1.0),), **ICE).fell


def test_what_helps_depends_on_the_disturbance(twin: MujocoTwin) -> None:
    """Stronger feedback stands in for feedback that is lost, and does nothing for a robot whose feet slide."""
    lock = ((4.4, "balance-lock", 1.0),)
    assert not run(twin, 12.0, lock, step_length=0.2, blind_time=4.0, blind_duration=1e9).fell
    assert run(twin, 7.0, lock, **ICE).fell


def test_on_slick_ice_stronger_feedback_undoes_what_a_suppressed_step_saves(twin: MujocoTwin) -> None:
    slick = {**ICE, "drop_mu": 0.01}
    step = (4.38, "step-suppression", 1.0)
    assert not run(twin, 6.5, (step,), **slick).fell
    assert run(twin, 6.5, (step, (4.38, "balance-lock", 1.0)), **slick).fell


def test_a_suppressed_step_puts_the_foot_down_and_the_walk_goes_on_after_release(twin: MujocoTwin) -> None:
    # at 3.1 s the first foot is in the air
    asked = ((3.1, "step-suppression", 1.0), (5.0, "step-suppression", 0.0))
    seen = run(twin, 10.0, asked, step_length=0.1)
    assert not seen.events
    assert min(min(seen.over("load_left", 3.5, 5.5)), min(seen.over("load_right", 3.5, 5.5))) > 100.0
    assert max(seen.over("steps", 3.4, 5.9)) == min(seen.over("steps", 3.4, 5.9))
    assert abs(sum(seen.over("com_vx", 4.5, 5.5))) / 200.0 < 0.02
    assert seen.truth[-1]["steps"] > seen.truth[round(5.5 / 0.005)]["steps"] + 2


def test_a_weaker_suppression_lets_the_foot_come_down_later(twin: MujocoTwin) -> None:
    def down_s(strength: float) -> float:
        seen = run(twin, 4.5, ((3.1, "step-suppression", strength),), step_length=0.1)
        begin = seen.truth[round(3.05 / 0.005)]["steps"]
        return next(k * 0.005 for k, p in enumerate(seen.truth) if p["steps"] > begin)

    full, half, none = (down_s(s) for s in (1.0, 0.5, 0.0))
    assert 3.1 < full < half < none
    assert full <= 3.1 + 0.15 + 0.02


@pytest.mark.parametrize(("action", "change"), [("arm-reconfiguration", 0.6), ("withdraw-arm", -0.123)])
def test_the_arms_move_by_the_strength_and_back(twin: MujocoTwin, action: str, change: float) -> None:
    asked = ((0.5, action, 1.0), (1.5, action, 0.5), (3.0, action, 0.0))
    seen = run(twin, 4.5, asked, stepping=0.0)
    name = "arm_left_2_joint"
    rest, full, half, back = (joint(twin, seen, name, t) for t in (0.4, 1.4, 2.9, 4.4))
    # the servo's sag differs by posture
    assert full - rest == pytest.approx(change, abs=0.03)
    assert half - rest == pytest.approx(0.5 * change, abs=0.03)
    assert back == pytest.approx(rest, abs=0.005)


@pytest.mark.parametrize("action", ["compliance-tuning", "balance-lock"])
def test_stiffer_legs_and_stronger_feedback_hold_a_pushed_robot_closer(twin: MujocoTwin, action: str) -> None:
    push = {"stepping": 0.0, "push_impulse": 15.0, "push_time": 1.0}
    way = [max(run(twin, 2.5, ((0.5, action, s),), **push).over("com_x", 1.0, 2.5)) for s in (0.0, 0.5, 1.0)]
    assert way[0] > way[1] > way[2]


def test_shorter_steps_make_a_slower_walk(twin: MujocoTwin) -> None:
    """speed-scale at strength s leaves 1 - s of the length, shorten-step at strength 1 leaves 0.4."""
    way = []
    for action, strength in (("announce", 1.0), ("speed-scale", 0.5), ("shorten-step", 1.0)):
        seen = run(twin, 5.5, ((0.1, action, strength),), step_length=0.2, start_time=0.2)
        assert not seen.events
        way.append(seen.truth[-1]["com_x"])
    assert way[1] == pytest.approx(0.5 * way[0], rel=0.1)
    assert way[2] == pytest.approx(0.4 * way[0], rel=0.1)


def test_a_protective_stop_on_one_leg_topples_and_a_suppressed_step_does_not(twin: MujocoTwin) -> None:
    assert run(twin, 7.0, ((4.0, "protective-stop", 1.0),), step_length=0.2).fell
    assert not run(twin, 7.0, ((4.0, "step-suppression", 1.0),), step_length=0.2).fell


def test_a_stop_in_double_support_stands_and_its_release_walks_on(twin: MujocoTwin) -> None:
    seen = run(twin, 8.0, ((0.5, "protective-stop", 1.0), (4.0, "protective-stop", 0.0)), step_length=0.1)
    assert not seen.events
    assert seen.truth[round(4.0 / 0.005)]["steps"] == 0.0
    assert seen.truth[-1]["steps"] >= 3.0


def test_soft_arms_hit_a_human_less_hard_and_withdrawn_arms_not_at_all(twin: MujocoTwin) -> None:
    pushed = {"stepping": 0.0, "arms_forward": 1.0, "push_impulse": 35.0, "push_time": 1.0}
    peaks = []
    for action in ("announce", "soften-arms", "withdraw-arm"):
        seen = run(twin, 1.6, ((0.5, action, 1.0),), human=1.0, human_x=0.78, human_y=-0.2, **pushed)
        peaks.append(seen.truth[-1]["contact_force_peak"])
    assert peaks[0] > peaks[1] > 0.0
    assert peaks[2] == 0.0


def test_yielding_knees_soften_the_fall(twin: MujocoTwin) -> None:
    peaks = []
    for strength in (0.0, 1.0):
        twin.reset({"stepping": 0.0, "push_impulse": 60.0, "push_time": 0.5}, 1)
        twin.advance(500_000_000)
        twin._control.ask("impact-mitigation", strength)
        twin.advance(2_500_000_000)
        peaks.append(twin.probes()["floor_peak"])
    assert peaks[1] < peaks[0]


def test_minimal_risk_is_suppression_and_lock(twin: MujocoTwin) -> None:
    one = run(twin, 5.0, ((3.1, "minimal-risk", 1.0),), step_length=0.1)
    two = run(twin, 5.0, ((3.1, "step-suppression", 1.0), (3.1, "balance-lock", 1.0)), step_length=0.1)
    assert one.truth == two.truth
