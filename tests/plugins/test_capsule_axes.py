"""Placements of capsules from the ends of their segments, and the shared reading of a robot's state."""

from __future__ import annotations

import coal
import numpy as np
import pinocchio as pin
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from foreshock.messages import JointState, Odometry
from foreshock_detectors._body_state import BodyVectors
from foreshock_detectors._floating_base import FloatingBase
from foreshock_detectors.balance import BalanceConfig
from foreshock_detectors.proximity._axes import capsule_placements
from foreshock_detectors.proximity._bulk import ShapeArrays

points = st.tuples(*[st.floats(-2.0, 2.0).map(lambda x: round(x, 3))] * 3)
UNIT = 1e-12  # a unit vector from whole mm over lengths of 1 mm and more, in doubles


@settings(max_examples=200, deadline=None)
@given(st.lists(st.tuples(points, points), min_size=1, max_size=8))
@example([((0.0, 0.0, 1.0), (0.0, 0.0, -1.0)), ((1.0, 1.0, 1.0), (1.0, 1.0, 1.0)), ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))])
def test_a_placement_turns_z_to_the_segment_by_a_rotation(segments):
    ends = np.array(segments)
    places, half = capsule_placements(ends)
    for (a, b), place, h in zip(ends, places, half, strict=True):
        turn = place[:3].T
        np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=UNIT)
        assert np.linalg.det(turn) == pytest.approx(1.0, abs=UNIT)
        tips = {tuple(np.round(place[3] + s * h * turn[:, 2], 9) + 0.0) for s in (1, -1)}
        assert tips == {tuple(np.round(p, 9) + 0.0) for p in (a, b)}


def test_shape_placements_reach_pinocchio():
    geometry = pin.GeometryModel()
    for k in range(3):
        geometry.addGeometryObject(pin.GeometryObject(f"ball {k}", 0, pin.SE3.Identity(), coal.Sphere(0.1)))
    geometry.addCollisionPair(pin.CollisionPair(0, 1))
    geometry.addCollisionPair(pin.CollisionPair(1, 2))
    shapes = ShapeArrays(geometry)
    shapes.placements[:, :3] = np.eye(3)
    shapes.placements[:, 3] = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 0.0, 0.7))
    assert pin.computeDistances(geometry, shapes.data) == 1
    assert [r.min_distance for r in shapes.data.distanceResults] == pytest.approx([0.8, 0.5], abs=1e-12)


def test_joints_in_any_order_and_numbers_that_are_finite_alone():
    robot = FloatingBase(BalanceConfig(), "balance")
    names = tuple(robot.model.names)[2:]
    position = tuple(float(k) / 100 for k in range(len(names)))
    base = Odometry((1.0, 2.0, 3.0), (0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    there, back = BodyVectors(robot), BodyVectors(robot)
    there.write(JointState(names, position, position), base, 0)
    back.write(JointState(names[::-1], position[::-1], position[::-1]), base, 0)
    np.testing.assert_array_equal(there.q, back.q)
    np.testing.assert_array_equal(there.v, back.v)
    np.testing.assert_array_equal(there.q[:3], 0.0)
    far = Odometry((1.7e308, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), (1.7e308, 0.0, 0.0), (0.0, 0.0, 0.0))
    with pytest.raises(ValueError, match="base/odometry: the sum"):
        there.write(JointState(names, position, position), far, 0)
