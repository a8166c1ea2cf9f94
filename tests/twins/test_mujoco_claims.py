"""What docs/whole-body.md says of the twin, where no other test asks: what changes nothing, what is refused, limits."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

pytest.importorskip("mujoco")
pytest.importorskip("pinocchio")

from mujoco_runs import Seen, new_twin, run

from foreshock.errors import ConfigError
from foreshock.messages import JointState
from foreshock_twins.mujoco._twin import MujocoTwin

HIS = ("talos/humans/pose", "talos/human-1/gaze")


@pytest.fixture(scope="module")
def twin() -> MujocoTwin:
    return new_twin()


def own(seen: Seen) -> list[object]:
    """All samples of the robot itself."""
    return [s for s in seen.samples if s.channel not in HIS]


def test_after_a_fall_onto_a_human_with_everything_wrong_a_reset_twin_is_a_new_one(twin: MujocoTwin) -> None:
    wrong = {"push_impulse": 60.0, "push_time": 0.3, "payload_torso": 20.0, "drop_duration": 9.0, "drop_time": 0.0}
    wrong |= {"weak_share": 0.3, "weak_time": 0.0, "lag": 0.1, "lag_time": 0.0, "human": 1.0, "human_x": 0.75}
    asked = ((0.1, "minimal-risk", 1.0), (0.1, "withdraw-arm", 1.0), (0.1, "impact-mitigation", 1.0))
    twin.record(50.0)
    assert run(twin, 1.8, asked, **wrong).fell
    twin.advance(1_800_000_000)
    assert "fall-onto-human" in {e.id for e in twin.events()}
    twin.record(0.0)
    again, new = (run(t, 1.0, human=1.0, human_x=3.0) for t in (twin, new_twin()))
    assert again.samples == new.samples
    assert again.truth == new.truth


def test_events_say_by_how_much_which_limit_was_passed(twin: MujocoTwin) -> None:
    twin.reset({"stepping": 0.0, "push_impulse": 60.0, "push_time": 0.3, "human": 1.0, "human_x": 0.75}, 2)
    twin.advance(1_800_000_000)
    events = twin.events()
    assert [e.stamp_ns for e in events] == sorted(e.stamp_ns for e in events)
    assert {e.id: e.unit for e in events}.items() >= {"fall-onto-human": "N", "touch": "N", "balance-lost": "m"}.items()
    assert all(e.value > e.limit > 0.0 for e in events)


@pytest.mark.parametrize("y_m", [0.95, 6.0])
def test_a_human_who_is_not_touched_changes_nothing(twin: MujocoTwin, y_m: float) -> None:
    """Also where contacts are looked for at each step, within 1 m of the base."""
    alone, beside = run(twin, 2.5), run(twin, 2.5, human=1.0, human_x=0.0, human_y=y_m)
    assert own(alone) == own(beside)


@pytest.mark.parametrize("asked", [[(0.5, "announce", 1.0)], [(0.5, "minimal-risk", 0.0), (0.5, "hold", 0.0)]])
def test_what_is_announced_or_released_changes_nothing(
    twin: MujocoTwin, asked: Sequence[tuple[float, str, float]]
) -> None:
    assert run(twin, 2.5, asked).samples == run(twin, 2.5).samples


def test_a_weak_joint_gives_its_share_of_the_robots_limit_and_no_more(twin: MujocoTwin) -> None:
    name, share = "leg_left_4_joint", 0.05
    pin = twin._body.pin_model  # the limit is that of the model file
    limit = float(pin.effortLimit[pin.joints[pin.getJointId(name)].idx_v])
    knee = twin._body.joints.index(name)
    before, after = [], []
    weak = {"weak_joint": float(knee), "weak_share": share, "weak_time": 0.5, "effort_noise": 0.0}
    for stamp_ns, state in run(twin, 1.0, stepping=0.0, **weak).values("joints/state").items():
        assert isinstance(state, JointState)
        (before if stamp_ns <= 500_000_000 else after).append(abs(state.effort[knee]))
    assert max(before) > share * limit, "it needs more than is left"
    assert 0.5 * share * limit < max(after) <= share * limit, "it gives what is left"


@pytest.mark.parametrize(("name", "value"), [("drop_foot", 0.5), ("human", 1.5)])
def test_half_a_choice_is_refused(twin: MujocoTwin, name: str, value: float) -> None:
    with pytest.raises(ConfigError, match=f"'{name}' = {value}.*; expected a whole number"):
        twin.reset({name: value}, 0)
