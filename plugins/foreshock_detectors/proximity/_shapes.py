"""Points whose convex hull encloses a collision shape, for every shape a URDF can name."""

from __future__ import annotations

import itertools
import math
from functools import cache
from typing import Any

import numpy as np
from scipy.spatial import ConvexHull

from foreshock.errors import ConfigError
from foreshock_detectors.proximity._fit import Points

__all__ = ["shape_points"]

_SIDES = 24
"""Corners of the polygon that stands for a circle; circumscribed, so that it is wider by 0.9 % and never narrower."""


def shape_points(name: str, shape: Any) -> Points:
    """Vertices in the shape's own frame, shape (n, 3), m.

    Args:
        name: of the geometry, for the error.
        shape: a coal geometry.

    Raises:
        ConfigError: the shape has no finite hull, or is of an unknown type.
    """
    kind = type(shape).__name__
    if kind.startswith("BVHModel"):
        points = np.array(shape.vertices(), dtype=np.float64)
    elif kind == "Convex":
        points = np.array(shape.points(), dtype=np.float64)
    elif kind == "Box":
        h = shape.halfSide
        points = np.array([h * s for s in itertools.product((-1.0, 1.0), repeat=3)], dtype=np.float64)
    elif kind == "Sphere":
        points = shape.radius * _ball()
    elif kind == "Ellipsoid":
        points = np.asarray(shape.radii, dtype=np.float64) * _ball()
    elif kind == "Capsule":
        ball, up = shape.radius * _ball(), np.array([0.0, 0.0, shape.halfLength])
        points = np.vstack([ball + up, ball - up])
    elif kind == "Cylinder":
        points = np.vstack([_disc(shape.radius, shape.halfLength), _disc(shape.radius, -shape.halfLength)])
    elif kind == "Cone":
        points = np.vstack([_disc(shape.radius, -shape.halfLength), [[0.0, 0.0, shape.halfLength]]])
    else:
        raise ConfigError("proximity.urdf", f"collision geometry {name!r} is a {kind}", "; expected a mesh or solid")
    if points.ndim != 2 or len(points) == 0 or not np.isfinite(points).all():
        raise ConfigError("proximity.urdf", f"collision geometry {name!r} has no vertices, or not all are finite")
    return points


def _disc(radius: float, z: float) -> Points:
    angles = np.arange(_SIDES) * (2.0 * math.pi / _SIDES)
    r = radius / math.cos(math.pi / _SIDES)
    return np.column_stack([r * np.cos(angles), r * np.sin(angles), np.full(_SIDES, z)])


@cache
def _ball() -> Points:
    """A polyhedron around the unit ball: points on the sphere, scaled until the nearest face touches it."""
    rings = [np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]])]
    for k in range(1, _SIDES // 2):
        polar = k * 2.0 * math.pi / _SIDES
        rings.append(_disc(math.sin(polar) * math.cos(math.pi / _SIDES), math.cos(polar)))
    points = np.vstack(rings)
    inradius = float(-ConvexHull(points).equations[:, 3].max())
    return np.asarray(points / inradius, dtype=np.float64)
