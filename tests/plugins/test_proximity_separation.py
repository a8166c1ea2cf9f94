"""S_p term by term against ISO/TS 15066 by hand, its monotony, and the reach of a fall against a fall."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from foreshock.errors import ConfigError
from foreshock_detectors.proximity import ProximityConfig
from foreshock_detectors.proximity._closing import ClosingSpeed
from foreshock_detectors.proximity._fall import Topple
from foreshock_detectors.proximity._separation import protective_separation

CONFIG = ProximityConfig(reaction_s=0.1, stopping_s=0.6, stopping_speed_ratio=0.5, c_m=0.2, z_d_m=0.02, z_r_m=0.01)
CALM = {
    "distance_m": 2.0,
    "human_speed_m_s": None,
    "human_age_s": 0.0,
    "robot_speed_m_s": 0.0,
    "robot_age_s": 0.0,
    "uncertainty_m": 0.0,
    "fall_clearance_m": None,
}
EXACT = {"rel": 1e-12, "abs": 1e-12}


def separation(config=CONFIG, **changes):
    return protective_separation(config, **(CALM | changes))


@pytest.mark.parametrize(
    ("changes", "terms"),
    [
        # v_h 1.6 m/s over 0.1 + 0.6 s; C; Z_d at least 0.02; Z_r
        ({}, (1.12, 0.0, 0.0, 0.2, 0.02, 0.01, 0.0)),
        # at 0.5 m and nearer people reach with 2.0 m/s
        ({"distance_m": 0.5}, (1.4, 0.0, 0.0, 0.2, 0.02, 0.01, 0.0)),
        # v_r 0.8 m/s: 0.08 m in T_r, then braked evenly over 0.6 s: 0.24 m
        ({"robot_speed_m_s": 0.8}, (1.12, 0.08, 0.24, 0.2, 0.02, 0.01, 0.0)),
        # a robot that withdraws takes nothing off
        ({"robot_speed_m_s": -0.8}, (1.12, 0.0, 0.0, 0.2, 0.02, 0.01, 0.0)),
        # 50 ms old human, 20 ms old robot: 1.6 * 0.75, 0.8 * 0.12
        ({"human_age_s": 0.05, "robot_age_s": 0.02, "robot_speed_m_s": 0.8}, (1.2, 0.096, 0.24, 0.2, 0.02, 0.01, 0.0)),
        # measured: he stands; walks 1 m/s
        ({"human_speed_m_s": 0.0}, (0.0, 0.0, 0.0, 0.2, 0.02, 0.01, 0.0)),
        ({"human_speed_m_s": 1.0, "distance_m": 0.3}, (0.7, 0.0, 0.0, 0.2, 0.02, 0.01, 0.0)),
        # the tracker is less certain than Z_d's default
        ({"uncertainty_m": 0.07}, (1.12, 0.0, 0.0, 0.2, 0.07, 0.01, 0.0)),
        # 2.0 m away, 0.4 m of it beyond a fall
        ({"fall_clearance_m": 0.4}, (1.12, 0.0, 0.0, 0.2, 0.02, 0.01, 1.6)),
        # inside the fall by 0.3 m
        ({"fall_clearance_m": -0.3}, (1.12, 0.0, 0.0, 0.2, 0.02, 0.01, 2.3)),
    ],
)
def test_every_term_by_hand(changes, terms):
    found = separation(**changes)
    assert msgspec.structs.astuple(found) == pytest.approx(terms, **EXACT)
    assert found.s_p_m == pytest.approx(sum(terms), **EXACT)


def test_a_floor_under_the_measured_human_speed():
    floor = msgspec.structs.replace(CONFIG, v_h_least_m_s=0.5)
    assert separation(floor, human_speed_m_s=0.1).s_h_m == pytest.approx(0.35, **EXACT)
    assert separation(floor, human_speed_m_s=0.9).s_h_m == pytest.approx(0.63, **EXACT)


lengths = st.floats(0.0, 5.0)
speeds = st.floats(-3.0, 3.0)
state = st.fixed_dictionaries(
    {
        "distance_m": st.floats(-0.2, 6.0),
        "human_speed_m_s": st.none() | st.floats(0.0, 3.0),
        "human_age_s": st.floats(0.0, 0.5),
        "robot_speed_m_s": speeds,
        "robot_age_s": st.floats(0.0, 0.1),
        "uncertainty_m": st.floats(0.0, 0.5),
        "fall_clearance_m": st.none() | st.floats(-3.0, 3.0),
    }
)


@given(state, st.sampled_from(sorted(CALM)), st.floats(1e-3, 2.0))
def test_the_margin_falls_with_every_argument_that_makes_things_worse(values, name, step):
    """Rounding aside: each S_p is a sum of some ten products below 10 m."""
    if values[name] is None:
        return
    better_when_larger = name in ("distance_m", "fall_clearance_m")
    more = values | {name: values[name] + step}
    before = values["distance_m"] - separation(**values).s_p_m
    after = more["distance_m"] - separation(**more).s_p_m
    assert after >= before - 1e-12 if better_when_larger else after <= before + 1e-12


@given(state, st.sampled_from(["reaction_s", "stopping_s", "c_m", "z_r_m", "v_h_near_m_s"]), st.floats(1e-3, 1.0))
def test_s_p_grows_with_every_parameter(values, field, step):
    wider = msgspec.structs.replace(CONFIG, **{field: getattr(CONFIG, field) + step})
    assert separation(wider, **values).s_p_m >= separation(**values).s_p_m - 1e-12


def test_a_post_topples_over_its_edge():
    """A post of radius 0.1 and height 1.7 m, ends at 0.1 and 1.6 m, edge 0.1 m out: rho = sqrt(0.1^2 + 1.6^2) + 0.1.

    A man of radius 0.2 stands 3 m away.
    """
    post = Topple(np.array([[[0.0, 0.0, 0.1], [0.0, 0.0, 1.6]]]), np.array([0.1]), 0.1)
    rho = math.hypot(0.1, 1.6) + 0.1
    assert post.reaches_m(np.array((0.0, 1.0, 0.0))) == pytest.approx((0.1, rho), **EXACT)
    man = np.array([[[0.0, 0.0, -0.8], [0.0, 0.0, 0.8]]])
    clearance = post.clearance_m((0.0, 3.0, 0.9), man, np.array([0.2, 0.2]))
    assert clearance == pytest.approx(3.0 - 0.2 - 0.1 - rho, **EXACT)
    # level closest points: S_f is the reach lying down minus the reach now, which is the edge itself
    d = 3.0 - 0.2 - 0.1
    assert separation(distance_m=d, fall_clearance_m=clearance).s_f_m == pytest.approx(rho, **EXACT)


@given(st.integers(0, 2**32 - 1), st.floats(-math.pi, math.pi))
def test_no_part_of_a_falling_robot_gets_beyond_the_reach(seed, heading):
    """Random bodies turned about the edge in steps of one degree until they lie; and their posture now is within."""
    rng = np.random.default_rng(seed)
    ends = rng.uniform((-0.4, -0.4, 0.1), (0.4, 0.4, 1.7), (12, 2, 3))
    radius = rng.uniform(0.03, 0.15, 12)
    body = Topple(ends, radius, 0.1)
    u = np.array((math.cos(heading), math.sin(heading), 0.0))
    edge, reach = body.reaches_m(u)
    ground = (ends[..., 2] - radius[:, None]).min()
    x, h = ends @ u - edge, ends[..., 2] - ground
    farthest = max(
        float((x * math.cos(a) + h * math.sin(a) + radius[:, None]).max()) for a in np.radians(np.arange(0, 181))
    )
    assert farthest <= reach + 1e-12
    assert farthest >= reach - 2e-3  # half a degree off the top of a circle of 2 m is 0.1 mm: the bound is tight


@given(st.integers(0, 2**32 - 1))
def test_the_fall_never_lengthens_the_separation(seed):
    """X - rho <= X - max(x + r) <= d: a half space apart along u bounds the distance."""
    rng = np.random.default_rng(seed)
    ends = rng.uniform((-0.4, -0.4, 0.1), (0.4, 0.4, 1.7), (8, 2, 3))
    radius = np.full(8, 0.1)
    man = rng.uniform((-0.3, -0.3, -0.9), (0.3, 0.3, 0.9), (6, 2, 3))
    centre = (float(rng.uniform(-3, 3)), float(rng.uniform(-3, 3)), 0.9)
    clearance = Topple(ends, radius, 0.1).clearance_m(centre, man, np.full(12, 0.1))
    gap = min(
        float(np.linalg.norm(p[:, None] - q[None], axis=2).min())
        for p in [np.linspace(a, b, 20) for a, b in ends]
        for q in [np.linspace(a, b, 20) + centre for a, b in man]
    )
    assert clearance <= gap - 0.2 + 1e-9 or gap < 0.2


def test_closing_speed_is_the_slope():
    closing = ClosingSpeed(0.5)
    for k in range(30):
        assert closing.value_m_s is None or k > 3
        closing.push(round(k * 5e7), 5.0 - 0.8 * k * 0.05)
    assert closing.value_m_s == pytest.approx(0.8, rel=1e-9)
    closing.push(round(29 * 5e7), 1.0)  # a repeated stamp changes nothing
    assert closing.value_m_s == pytest.approx(0.8, rel=1e-9)
    closing.push(round(60 * 5e7), 1.0)  # after a gap nothing is known
    assert closing.value_m_s is None


def test_noise_of_the_slope_is_as_documented():
    """sqrt(12 / n) sigma / T for n = 11 samples within 0.5 s; the exact sum of squares is n (n^2 - 1) / 12 steps^2."""
    rng, slopes = np.random.default_rng(9), []
    for _ in range(2000):
        closing = ClosingSpeed(0.5)
        for k, d in enumerate(3.0 + 0.02 * rng.standard_normal(11)):
            closing.push(round(k * 5e7), float(d))
        slopes.append(closing.value_m_s)
    exact = 0.02 / math.sqrt(11 * 120 / 12 * 0.05**2)
    assert np.std(slopes) == pytest.approx(exact, rel=0.06)  # sd of a sd over 2000: 1.6 %
    assert exact == pytest.approx(math.sqrt(12 / 11) * 0.02 / 0.5, rel=0.1)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("reaction_s", 0.0),
        ("stopping_s", -0.1),
        ("c_m", float("nan")),
        ("capsules", -1),
        ("stopping_speed_ratio", 1.2),
        ("closing_m_s", 2.5),
        ("v_h_far_m_s", 2.5),
        ("sensor_range_m", float("inf")),
    ],
)
def test_settings_out_of_range_are_named(field, value):
    with pytest.raises(ConfigError, match=f"proximity.{field}"):
        ProximityConfig(**{field: value})
