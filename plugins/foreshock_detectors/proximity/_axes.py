"""Where coal's capsules lie, for the ends of their segments."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

__all__ = ["Array", "capsule_placements"]

Array: TypeAlias = NDArray[np.float64]


def capsule_placements(ends: Array) -> tuple[Array, Array]:
    """Placements of capsules that are centred along their z axis, and half their lengths.

    With u the unit vector along the segment, either way round so that u_z >= 0, the shortest turn of z to u has the
    columns

        (1 - u_x^2 / k, -u_x u_y / k, -u_x),   (-u_x u_y / k, 1 - u_y^2 / k, -u_y),   u,   with k = 1 + u_z

    Args:
        ends: shape (n, 2, 3), m. A ball, both of whose ends are the same point, is not turned.

    Returns:
        Shape (n, 4, 3): the columns of the rotation, then the middle (m); and shape (n,): m.
    """
    along = ends[:, 1] - ends[:, 0]
    length = np.sqrt((along * along).sum(axis=1))
    along[length == 0.0] = (0.0, 0.0, 1.0)
    u = along / np.where(length > 0.0, length, 1.0)[:, None]
    u[u[:, 2] < 0.0] *= -1.0
    x, y, k = u[:, 0], u[:, 1], 1.0 + u[:, 2]
    places = np.empty((len(ends), 4, 3))
    places[:, 0, 0], places[:, 1, 1] = 1.0 - x * x / k, 1.0 - y * y / k
    places[:, 0, 1] = places[:, 1, 0] = -x * y / k
    places[:, 0, 2], places[:, 1, 2] = -x, -y
    places[:, 2] = u
    places[:, 3] = 0.5 * (ends[:, 0] + ends[:, 1])
    return places, 0.5 * length
