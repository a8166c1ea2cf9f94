"""All placements and velocities of Pinocchio's data as arrays, without a Python object per joint or shape.

Reading 34 placements through the bindings costs 35 us, these views cost nothing. Pinocchio hands out ``oMi[i]``,
``v[i]`` and ``oMg[i]`` as live views into std::vectors, whose elements lie one behind the other and stay where they are
for the life of the data. The layout is not promised in Python, so it is checked on the addresses and on the values of
every element before it is used.
"""

from __future__ import annotations

import ctypes
from itertools import pairwise
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

__all__ = ["JointArrays", "ShapeArrays"]

_SE3_DOUBLES, _MOTION_DOUBLES = 12, 6


class JointArrays:
    """Placements and velocities of all joints as they were computed last by ``forwardKinematics(model, data, q, v)``.

    Attributes:
        data: pinocchio.Data; it owns the memory, and the views are its only other owner here.
        placements: shape (njoints, 4, 3): the columns of the rotation joint to world, then the translation (m).
        velocities: shape (njoints, 6): linear (m/s) and angular (rad/s) velocity in the joint's own axes.

    Raises:
        RuntimeError: this version of Pinocchio stores them otherwise.
    """

    def __init__(self, model: Any) -> None:
        self.data: Any = model.createData()
        self.placements = _placements(self.data.oMi)
        self.velocities = _view([m.linear for m in self.data.v], _MOTION_DOUBLES)
        self._check(model)

    def _check(self, model: Any) -> None:
        rng = np.random.default_rng(0)
        for _ in range(2):
            q = pin.integrate(model, pin.neutral(model), rng.uniform(-0.5, 0.5, model.nv))
            pin.forwardKinematics(model, self.data, q, rng.uniform(-1.0, 1.0, model.nv))
            same = all(np.array_equal(m.vector, v) for m, v in zip(self.data.v, self.velocities, strict=True))
            if not same or not _agree(self.data.oMi, self.placements):
                raise RuntimeError(f"Pinocchio {pin.__version__} stores joint placements in an unknown layout")


class ShapeArrays:
    """Placements of all shapes of a geometry, to be written: ``computeDistances(geometry, data)`` reads them.

    Attributes:
        data: pinocchio.GeometryData; it owns the memory, and the view is its only other owner here.
        placements: shape (shapes, 4, 3): the columns of the rotation shape to world, then the translation (m).

    Raises:
        RuntimeError: this version of Pinocchio stores them otherwise.
    """

    def __init__(self, geometry: Any) -> None:
        self.data: Any = pin.GeometryData(geometry)
        self.placements = _placements(self.data.oMg)
        rng = np.random.default_rng(0)
        self.placements[:] = rng.uniform(-1.0, 1.0, self.placements.shape)
        if not _agree(self.data.oMg, self.placements):
            raise RuntimeError(f"Pinocchio {pin.__version__} stores shape placements in an unknown layout")


def _placements(places: Any) -> NDArray[np.float64]:
    return _view([p.rotation for p in places], _SE3_DOUBLES).reshape(-1, 4, 3)


def _agree(places: Any, placements: NDArray[np.float64]) -> bool:
    """Whether the bindings read the same from each placement as the array."""
    return all(
        np.array_equal(place.rotation.T, p[:3]) and np.array_equal(place.translation, p[3])
        for place, p in zip(places, placements, strict=True)
    )


def _view(firsts: list[Any], doubles: int) -> NDArray[np.float64]:
    """One row of doubles per element, given views on the beginning of each."""
    addresses = [int(f.__array_interface__["data"][0]) for f in firsts]
    step = doubles * ctypes.sizeof(ctypes.c_double)
    if any(b - a != step for a, b in pairwise(addresses)):
        raise RuntimeError(f"Pinocchio {pin.__version__} does not store joint data one behind the other")
    memory = (ctypes.c_double * (doubles * len(firsts))).from_address(addresses[0])
    return np.ctypeslib.as_array(memory).reshape(len(firsts), doubles)
