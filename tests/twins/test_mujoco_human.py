"""The human of the MuJoCo twin: sizes, gait, reach, what perception is told, and contact."""

from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from foreshock.errors import ConfigError
from foreshock.messages import Humans
from foreshock_detectors.proximity import ProximityConfig
from foreshock_detectors.proximity._people import People
from foreshock_twins.mujoco._human import PARTS, HumanMotion, HumanSettings, add_human, apply

MS = 1_000_000
NAMES = [p.name for p in PARTS]
LEFT_FOOT, RIGHT_FOOT = NAMES.index("left-foot"), NAMES.index("right-foot")
CHEST, RIGHT_HAND = NAMES.index("chest"), NAMES.index("right-hand")
BIT = 4


def ends(motion, times_ns):
    return np.array([motion.pose(t).ends for t in times_ns])


motions = st.builds(
    HumanSettings,
    motion=st.sampled_from(["stand", "walk-past", "reach-in"]),
    x_m=st.just(0.9),
    y_m=st.just(0.0),
    yaw_rad=st.just(math.pi),
    start_s=st.floats(0.0, 1.0),
    speed_m_s=st.floats(0.1, 2.0),
    reach_s=st.floats(0.3, 2.0),
)


@settings(deadline=None, max_examples=25)
@given(motions, st.floats(0.0, 30.0))
def test_limbs_keep_their_lengths_and_hang_together(given_settings, t_s):
    e = HumanMotion(given_settings).pose(int(t_s * 1e9)).ends
    np.testing.assert_allclose(np.linalg.norm(e[:, 1] - e[:, 0], axis=1), [p.length for p in PARTS], atol=1e-9)
    for side in ("left", "right"):
        k = {n: NAMES.index(f"{side}-{n}") for n in ("upper-arm", "forearm", "hand", "thigh", "lower-leg")}
        for upper, lower in (("upper-arm", "forearm"), ("forearm", "hand"), ("thigh", "lower-leg")):
            np.testing.assert_allclose(e[k[upper], 0], e[k[lower], 1], atol=1e-9)


@pytest.mark.parametrize(
    ("what", "walk", "reach_s"),
    [
        ("walk-past", 0.3, 1.0),
        ("walk-past", 1.3, 1.0),
        ("walk-past", 2.0, 1.0),
        ("reach-in", 1.0, 0.3),
        ("stand", 1.0, 1.0),
    ],
)
def test_nothing_jumps(what, walk, reach_s):
    """A foot swings at some four times the walker's speed and is lifted; no speed changes by 0.2 m/s in 1 ms (20 g)."""
    motion = HumanMotion(HumanSettings(what, 0.9, 0.0, start_s=0.2, speed_m_s=walk, reach_s=reach_s))
    v = np.diff(ends(motion, range(0, 3000 * MS, MS)), axis=0) / 1e-3
    limit = {"walk-past": 5.0 * walk + 0.5, "reach-in": 2.0 * 1.875 * 1.2 / reach_s, "stand": 1e-9}[what]
    assert np.linalg.norm(v, axis=3).max() < limit
    assert np.linalg.norm(np.diff(v, axis=0), axis=3).max() < 0.2


@pytest.mark.parametrize("speed", [0.3, 0.8, 1.3, 1.6, 2.0])
def test_feet_stay_on_the_floor_and_do_not_slide(speed):
    motion = HumanMotion(HumanSettings("walk-past", yaw_rad=0.0, speed_m_s=speed))
    e = ends(motion, range(0, 6000 * MS, 2 * MS))[:, (LEFT_FOOT, RIGHT_FOOT)]
    height = e[..., 2] - PARTS[LEFT_FOOT].radius  # time, foot, heel or toe
    assert height.min() > -1e-3
    down = height.min(axis=2) < 1e-9
    assert down.any(axis=1).all()
    assert 0.05 < down.all(axis=1)[2000:].mean() < 0.35, "part of the time both feet are on the ground"
    for foot in (0, 1):
        for end in (0, 1):
            rests = (height[:-1, foot, end] < 1e-9) & (height[1:, foot, end] < 1e-9)
            slid = np.linalg.norm(np.diff(e[:, foot, end], axis=0), axis=1)
            assert slid[rests].max() < 1e-8  # a foot that has left the floor by less than 1e-9 m has begun to move


def test_the_velocity_is_that_of_the_trunk():
    motion = HumanMotion(HumanSettings("walk-past", x_m=-3.0, y_m=0.8, yaw_rad=0.3, start_s=0.5, speed_m_s=1.6))
    for t in (0, 500 * MS, 800 * MS, 1299 * MS, 2000 * MS, 7000 * MS):
        before, after = motion.pose(max(t - MS, 0)), motion.pose(t + MS)
        moved = (after.pos[CHEST] - before.pos[CHEST]) / (2e-3 if t else 1e-3)
        # a central difference of a speed that changes by at most 3 m/s^2, and no bob in the velocity
        np.testing.assert_allclose(motion.pose(t).velocity[:2], moved[:2], atol=3e-3)
    assert math.hypot(*motion.pose(7000 * MS).velocity) == pytest.approx(1.6)
    assert motion.pose(400 * MS).velocity == (0.0, 0.0, 0.0)


def test_a_walker_passes_at_his_lateral_distance():
    motion = HumanMotion(HumanSettings("walk-past", x_m=4.0, y_m=0.9, yaw_rad=math.pi))
    track = np.array([motion.pose(k * 100 * MS).pos[CHEST] for k in range(60)])
    np.testing.assert_allclose(track[:, 1], 0.9, atol=1e-9)
    assert track[0, 0] == pytest.approx(4.0)
    # 0.8 s of ramp cover half of what the full speed would
    assert track[-1, 0] == pytest.approx(4.0 - 1.3 * (5.9 - 0.4))


def test_arms_go_against_the_legs():
    motion = HumanMotion(HumanSettings("walk-past", yaw_rad=0.0))
    e = ends(motion, range(2000 * MS, 5000 * MS, 20 * MS))
    legs = e[:, LEFT_FOOT, 0, 0] - e[:, RIGHT_FOOT, 0, 0]
    arms = e[:, NAMES.index("left-hand"), 0, 0] - e[:, RIGHT_HAND, 0, 0]
    assert np.corrcoef(legs, arms)[0, 1] < -0.8  # they need not turn at the same instant


def test_the_hand_reaches_where_it_was_told_and_no_faster():
    target = (0.45, 0.1, 1.1)
    motion = HumanMotion(HumanSettings("reach-in", x_m=0.95, y_m=0.0, start_s=1.0, reach_m=target, reach_s=0.5))
    hand = np.array([motion.pose(t * MS).pos[RIGHT_HAND] for t in range(2000)])
    np.testing.assert_allclose(hand[:1001], np.broadcast_to(hand[0], (1001, 3)), atol=1e-12)
    np.testing.assert_allclose(hand[1500:], np.broadcast_to(target, (500, 3)), atol=1e-9)
    speed = np.linalg.norm(np.diff(hand, axis=0), axis=1) / 1e-3
    # the peak of 10 u^3 - 15 u^4 + 6 u^5 is 15/8
    assert speed.max() == pytest.approx(1.875 * math.dist(hand[0], target) / 0.5, rel=1e-3)


def test_what_is_out_of_reach_is_refused_with_the_distance():
    with pytest.raises(
        ConfigError, match=r"human.reach_m: .* is 2.* m from the right shoulder; an arm reaches 0\.59 m"
    ):
        HumanSettings("reach-in", x_m=3.0)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("speed_m_s", 0.0),
        ("speed_m_s", 2.5),
        ("start_s", -1.0),
        ("reach_s", 0.0),
        ("x_m", math.nan),
        ("yaw_rad", math.inf),
    ],
)
def test_bad_settings_name_the_key(key, value):
    with pytest.raises(ConfigError, match=f"human.{key}: {value!r}"):
        HumanSettings(**{key: value})


def world(conaffinity):
    """A leg-like post that stands on the floor, and the human; only the post can be pushed."""
    spec = mujoco.MjSpec()
    spec.option.timestep = 0.001
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 0.1], contype=1, conaffinity=0)
    post = spec.worldbody.add_body(name="post", pos=[0, 0, 0.5])
    post.add_freejoint()
    size = [0.08, 0.12, 0.5]
    post.add_geom(
        name="post", type=mujoco.mjtGeom.mjGEOM_BOX, size=size, mass=40, contype=0, conaffinity=1 | conaffinity
    )
    add_human(spec, contype=BIT)
    model = spec.compile()
    return model, mujoco.MjData(model)


def walked_into(conaffinity):
    """Names of the human's parts that touched the post, and how far the post was pushed."""
    model, data = world(conaffinity)
    motion = HumanMotion(HumanSettings("walk-past", x_m=1.5, y_m=0.0, yaw_rad=math.pi))
    pairs, post = set(), model.geom("post").id
    for t in range(2500):
        apply(model, data, motion.pose(t * MS))
        mujoco.mj_step(model, data)
        pairs |= {tuple(pair) for pair in data.contact.geom.tolist()}
    human = {model.geom(f"human-{name}").id: name for name in NAMES}
    assert not any(a in human and b in human for a, b in pairs)
    touched = {human[g] for pair in pairs if post in pair for g in pair if g in human}
    return touched, float(np.linalg.norm(data.qpos[:2]))


def test_the_robot_hits_the_human_if_its_geoms_may():
    touched, pushed = walked_into(BIT)
    assert touched
    assert pushed > 0.3
    assert walked_into(0) == (set(), pytest.approx(0.0, abs=1e-3))


def test_perception_is_told_what_mujoco_has():
    model, data = world(BIT)
    motion = HumanMotion(HumanSettings("walk-past", x_m=2.0, y_m=-0.7, yaw_rad=2.0))
    moved = motion.pose(1730 * MS)
    apply(model, data, moved)
    mujoco.mj_forward(model, data)
    truth = moved.truth("worker", 0.02)
    for part, capsule in zip(PARTS, truth.capsules, strict=True):
        geom = data.geom(f"human-{part.name}")
        half = geom.xmat.reshape(3, 3)[:, 2] * model.geom(f"human-{part.name}").size[1]
        np.testing.assert_allclose(geom.xpos - half, capsule.a, atol=1e-5)
        np.testing.assert_allclose(geom.xpos + half, capsule.b, atol=1e-5)
        assert model.geom(f"human-{part.name}").size[0] == capsule.radius
    people = People(ProximityConfig())
    people.take(1, Humans((truth,)))
    assert people.present[0].velocity == truth.velocity
    assert people.present[0].uncertainty_m == 0.02


def test_all_parts_are_there_once_and_a_human_is_as_large_as_the_template():
    assert len(set(NAMES)) == len(PARTS) == 16
    e = HumanMotion(HumanSettings()).pose(0).ends
    top = max(float(e[k, :, 2].max()) + p.radius for k, p in enumerate(PARTS))
    assert top == pytest.approx(1.75, abs=0.01)  # knees are not locked
