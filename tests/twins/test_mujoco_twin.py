"""The MuJoCo twin as a twin: deterministic, reset to new, walking for as long as it runs, and what it refuses."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest

pytest.importorskip("mujoco")
pytest.importorskip("pinocchio")

from mujoco_runs import TICK_NS, new_twin, run

from foreshock.errors import BadInputError, ConfigError, TwinError
from foreshock.messages import Humans, JointState, MotionPlan, Odometry, is_finite
from foreshock.records import Intervention
from foreshock_twins.mujoco import MujocoTwinConfig, RobotConfig, build_twin
from foreshock_twins.mujoco._parameters import PARAMETERS
from foreshock_twins.mujoco._twin import MujocoTwin

ASKED = ((2.4, "step-suppression", 1.0), (2.6, "arm-reconfiguration", 0.5), (2.8, "step-suppression", 0.0))
SHAKEN = {
    "push_impulse": 8.0,
    "push_time": 2.0,
    "drop_duration": 0.5,
    "drop_time": 2.2,
    "payload_hands": 4.0,
    "human": 2.0,
    "human_y": 1.0,
}


@pytest.fixture(scope="module")
def twin() -> MujocoTwin:
    return new_twin()


def test_the_same_seed_gives_the_same_samples_also_after_use_and_in_a_new_twin(twin: MujocoTwin) -> None:
    first = run(twin, 3.0, ASKED, seed=7, **SHAKEN)
    run(twin, 1.0, ((0.5, "protective-stop", 1.0),), seed=8, payload_torso=20.0, weak_share=0.1, weak_time=0.2)
    again = run(twin, 3.0, ASKED, seed=7, **SHAKEN)
    new = run(new_twin(), 3.0, ASKED, seed=7, **SHAKEN)
    assert first.digest() == again.digest() == new.digest()
    assert first.truth == again.truth == new.truth
    other = run(twin, 0.1, seed=8, **SHAKEN).values("joints/state")
    same = first.values("joints/state")
    assert all(same[stamp] != value for stamp, value in other.items())


def test_how_time_is_cut_into_calls_changes_nothing(twin: MujocoTwin) -> None:
    fine = run(twin, 0.5, seed=3).samples
    twin.reset({}, 3)
    coarse = list(twin.advance(333_000_000))  # no whole tick
    coarse += twin.advance(500_000_000)
    assert sorted(coarse, key=lambda s: (s.channel, s.seq)) == sorted(fine, key=lambda s: (s.channel, s.seq))


@pytest.mark.parametrize("length_m", [0.0, 0.1, 0.2])
def test_nominal_walking_stays_up_and_gets_where_its_steps_lead(twin: MujocoTwin, length_m: float) -> None:
    seen = run(twin, 9.0, step_length=length_m)
    assert not seen.events
    end = seen.truth[-1]
    steps = end["steps"]
    # 7.5 s of walking less the first shift of weight, at 0.9 s a step
    assert steps == 8.0
    forward = 0.5 * (end["foot_left_x"] + end["foot_right_x"])
    # the feet are half a step apart about their middle; a tenth of a step is what tracking may leave over
    assert forward == pytest.approx(length_m * (steps - 0.5), abs=0.1 * length_m * steps + 0.02)
    assert abs(end["com_y"]) < 0.12


def test_it_walks_stands_and_walks_again(twin: MujocoTwin) -> None:
    seen = run(twin, 12.0, step_length=0.15, start_time=0.5, walk_time=3.0, stand_time=3.0)
    assert not seen.events
    speed = [sum(seen.over("com_vx", a, a + 1.0)) / 200.0 for a in (2.0, 5.5, 8.5)]
    assert speed[0] > 0.1
    assert abs(speed[1]) < 0.02
    assert speed[2] > 0.1


def test_every_channel_comes_at_its_period_with_finite_messages_of_its_type(twin: MujocoTwin) -> None:
    seen = run(twin, 1.0, human=1.0, human_x=2.0, camera_latency=0.0, latency=0.0)
    count = Counter(s.channel for s in seen.samples)
    for channel in twin.channels:
        assert count[f"talos/{channel.name}"] == 1_000_000_000 // channel.period_ns, channel.name
    types = {c.name: c.type for c in twin.channels}
    for sample in seen.samples:
        assert type(sample.value).__name__ == types[sample.channel.removeprefix("talos/")]
        assert is_finite(sample.value)
    joints = next(iter(seen.values("joints/state").values()))
    assert isinstance(joints, JointState)
    assert len(joints.name) == len(joints.position) == len(joints.velocity) == len(joints.effort) == 32


def test_latency_and_lag_are_what_measurements_are_late_by(twin: MujocoTwin) -> None:
    seen = run(twin, 1.0, latency=0.01, lag=0.03, lag_time=0.5, human=1.0, human_x=2.0)
    late = {s.stamp_ns: s.received_ns - s.stamp_ns for s in seen.samples if s.channel == "talos/imu/torso"}
    assert {d for t, d in late.items() if t < 400_000_000} == {10_000_000}
    assert {d for t, d in late.items() if t > 600_000_000} == {40_000_000}
    humans = [s for s in seen.samples if isinstance(s.value, Humans)]
    assert {s.received_ns - s.stamp_ns for s in humans} == {60_000_000}


def test_the_plan_is_what_the_robot_does(twin: MujocoTwin) -> None:
    seen = run(twin, 6.0, step_length=0.1)
    plans, left = seen.values("left_foot/plan"), seen.values("left_foot/odometry")
    assert left
    for stamp, measured in left.items():
        planned = plans.get(stamp)
        if isinstance(planned, Odometry) and isinstance(measured, Odometry) and stamp > 1_000_000_000:
            off = [a - b for a, b in zip(planned.position, measured.position, strict=True)]
            # below the 40 mm at which a swing foot counts as adrift
            assert max(map(abs, off)) < 0.03
    motion = seen.values("plan/motion").values()
    assert {m.support for m in motion if isinstance(m, MotionPlan)} == {("left", "right"), ("left",), ("right",)}


def test_before_reset_and_after_close_it_says_so() -> None:
    twin = new_twin()
    with pytest.raises(TwinError, match="not been reset"):
        twin.advance(TICK_NS)
    assert twin.probes() == {}
    twin.reset({}, 0)
    twin.close()
    twin.close()
    with pytest.raises(TwinError, match="closed"):
        twin.advance(TICK_NS)


@pytest.mark.parametrize(
    ("parameters", "words"),
    [
        ({"push_impuls": 1.0}, "no parameter 'push_impuls'.*did you mean 'push_impulse'"),
        ({"mu": 0.0}, "'mu' = 0.0 is out of range; expected 0.001 to 2.0"),
        ({"mu": float("nan")}, "'mu' = nan is out of range"),
        ({"weak_joint": 32.0}, "'weak_joint' = 32.0 is no number of a joint; expected 0 to 31"),
        ({"weak_joint": 1.5}, "'weak_joint' = 1.5"),
        ({"human": 3.0, "human_x": 5.0}, "from the right shoulder"),
    ],
)
def test_a_bad_parameter_is_named(twin: MujocoTwin, parameters: dict[str, float], words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        twin.reset(parameters, 0)


@pytest.mark.parametrize(
    ("robot", "words"),
    [
        ({"model": "no.urdf"}, "no.urdf: no such file"),
        ({"model": "robot.sdf"}, "neither .urdf nor .xml"),
        ({"left_foot": "left_sole"}, "robot.left_foot: the robot has no link 'left_sole'.*left_sole_link"),
        ({"torso": "chest"}, "robot.torso: the robot has no link 'chest'"),
        ({"left_foot": "arm_left_3_link"}, "robot.left_foot: the leg to"),
        ({"posture": {"leg_left_9_joint": 0.1}}, "robot.posture: the robot has no joint 'leg_left_9_joint'"),
        ({"arms_out": {"arm_9": 0.1}}, "robot.arms_out: the robot has no joint 'arm_9'"),
        ({"reference": "sitting"}, "no reference configuration 'sitting'; did you mean 'half_sitting'"),
        ({"base": "pelvis"}, "robot.base: the model has no body 'pelvis'"),
    ],
)
def test_a_bad_robot_is_named(robot: dict[str, object], words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        build_twin(MujocoTwinConfig(robot=RobotConfig(**robot)), "talos", Path())  # type: ignore[arg-type]


def test_bad_sizes_and_strengths_are_refused(twin: MujocoTwin) -> None:
    with pytest.raises(ConfigError, match=r"sole_x_min_m: 0\.2 is not below"):
        RobotConfig(sole_x_min_m=0.2)
    twin.reset({}, 0)
    with pytest.raises(BadInputError, match=r"strength is 1\.5"):
        twin.intervene(Intervention(0, "hold", 1.5))
    twin.intervene(Intervention(0, "regrasp", 1.0))  # not its own: ignored


def test_physics_that_diverges_ends_the_run_as_nan_and_leaves_no_file(
    twin: MujocoTwin, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    twin.reset({}, 0)
    twin._data.qvel[0] = float("nan")
    with pytest.raises(TwinError) as caught:
        twin.advance(TICK_NS)
    assert caught.value.kind == "nan"
    assert not list(tmp_path.iterdir())
    with pytest.raises(TwinError, match="not been reset"):
        twin.advance(2 * TICK_NS)
    assert not run(twin, 0.5).events


def test_every_parameter_starts_within_its_range() -> None:
    assert all(p.low <= p.start <= p.high for p in PARAMETERS.values())
