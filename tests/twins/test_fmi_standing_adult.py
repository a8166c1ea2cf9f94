"""The human template: size, symmetry, regions, placement."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from foreshock_twins.fmi._adult import STANDING_ADULT, STATURE_M, placed

# ISO/TS 15066, table A.2, in words of ours.
TRUNK = {"forehead", "face", "neck", "back", "chest", "abdomen", "pelvis"}
REGIONS = TRUNK | {"upper-arm", "forearm", "hand", "thigh", "lower-leg"}


def test_it_stands_on_the_floor_and_is_as_tall_as_it_says():
    assert len(STANDING_ADULT) == 14
    assert max(max(c.a[2], c.b[2]) + c.radius for c in STANDING_ADULT) == pytest.approx(STATURE_M)
    assert 0.0 <= min(min(c.a[2], c.b[2]) - c.radius for c in STANDING_ADULT) < 0.05
    assert {c.region for c in STANDING_ADULT} <= REGIONS


def test_left_and_right_are_mirrored():
    def key(c, sign):
        return (c.region, c.radius, (c.a[0], sign * c.a[1], c.a[2]), (c.b[0], sign * c.b[1], c.b[2]))

    assert {key(c, 1.0) for c in STANDING_ADULT} == {key(c, -1.0) for c in STANDING_ADULT}


def test_no_gap_along_the_body_axis():
    """From the floor to the top of the head the silhouette is closed: no height is without a capsule."""
    spans = sorted((min(c.a[2], c.b[2]) - c.radius, max(c.a[2], c.b[2]) + c.radius) for c in STANDING_ADULT)
    reach = spans[0][1]
    for low, high in spans:
        assert low <= reach + 0.05  # the ankle and foot stay out of the template
        reach = max(reach, high)


@given(st.floats(-50, 50), st.floats(-50, 50), st.floats(-5, 5), st.floats(-10, 10))
def test_placing_is_a_rigid_motion(x, y, z, yaw):
    moved = placed(x, y, z, yaw)
    for before, after in zip(STANDING_ADULT, moved, strict=True):
        for p, q in ((before.a, after.a), (before.b, after.b)):
            expected = complex(x, y) + complex(p[0], p[1]) * complex(math.cos(yaw), math.sin(yaw))
            assert (q[0], q[1], q[2]) == pytest.approx((expected.real, expected.imag, z + p[2]), abs=1e-9)
        assert (after.region, after.radius) == (before.region, before.radius)
