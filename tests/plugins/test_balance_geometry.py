"""Support polygons, against scipy's hull and closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import nnls
from scipy.spatial import ConvexHull

from foreshock_detectors.balance._polygon import convex_hull, nearest_boundary_point, signed_margin

COORDINATE = st.floats(-0.5, 0.5).map(lambda x: round(x, 6))
POINTS = st.lists(st.tuples(COORDINATE, COORDINATE), min_size=3, max_size=12, unique=True)


def flat(points) -> bool:
    array = np.array(points)
    return np.linalg.svd(array - array.mean(axis=0), compute_uv=False)[1] < 1e-4


@given(POINTS)
def test_hull_has_scipys_area_and_perimeter(points):
    hull = convex_hull(points)
    if flat(points):
        return
    reference = ConvexHull(points)
    x, y = np.array(hull).T
    area = 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))
    perimeter = sum(math.dist(a, b) for a, b in zip(hull, hull[1:] + hull[:1], strict=True))
    # scipy's "volume" in the plane is the area and its "area" the perimeter; double precision on metres
    assert area == pytest.approx(reference.volume, abs=1e-9)
    assert perimeter == pytest.approx(reference.area, abs=1e-9)


@given(POINTS, COORDINATE, COORDINATE)
def test_margin_agrees_with_scipys_half_planes_inside_and_with_a_projection_outside(points, x, y):
    if flat(points):
        return
    hull = ConvexHull(points)
    inside = -float(np.max(hull.equations[:, :2] @ (x, y) + hull.equations[:, 2]))
    margin = signed_margin(convex_hull(points), x, y)
    if inside > 1e-9:
        assert margin == pytest.approx(inside, abs=1e-9)
    elif inside < -1e-9:
        # projection onto the hull: convex weights by non-negative least squares, their sum held at 1 by a heavy row
        corners = np.array(points)[hull.vertices].T
        weights, _ = nnls(np.vstack([corners, 1e4 * np.ones(corners.shape[1])]), np.array([x, y, 1e4]))
        distance = math.dist(corners @ weights / weights.sum(), (x, y))
        assert margin == pytest.approx(-distance, abs=1e-5)


@given(st.floats(-1, 1), st.floats(-1, 1), st.floats(-math.pi, math.pi))
def test_margin_of_a_turned_rectangle_is_the_closed_form(x, y, angle):
    a, b = 0.1025, 0.06
    c, s = math.cos(angle), math.sin(angle)
    corners = [(c * px - s * py, s * px + c * py) for px, py in ((-a, -b), (a, -b), (a, b), (-a, b))]
    dx, dy = abs(x) - a, abs(y) - b
    expected = -math.hypot(max(dx, 0), max(dy, 0)) if max(dx, dy) > 0 else min(-dx, -dy)
    assert signed_margin(corners, c * x - s * y, s * x + c * y) == pytest.approx(expected, abs=1e-12)


def test_outside_a_corner_the_margin_is_euclidean_not_the_distance_to_a_line():
    assert signed_margin([(0, 0), (1, 0), (1, 1), (0, 1)], 4.0, 5.0) == pytest.approx(-5.0)


def test_degenerate_polygons_have_no_inside():
    assert convex_hull([(0, 0), (1, 1), (2, 2), (1, 1)]) == [(0, 0), (2, 2)]
    assert signed_margin([(0, 0), (2, 0)], 1.0, 0.5) == pytest.approx(-0.5)
    assert signed_margin([(1, 1)], 4.0, 5.0) == pytest.approx(-5.0)
    assert nearest_boundary_point([(0, 0), (2, 0)], 3.0, 1.0) == (2, 0)
    with pytest.raises(ValueError, match="without corners"):
        signed_margin([], 0.0, 0.0)
