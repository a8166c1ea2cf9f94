"""How near to a human a toppling robot can come.

A biped falls as a rigid body about the edge of its support that is nearest to the human, in the posture of this
instant. With u the horizontal direction to the human, e = max u.p + r over the supporting capsules (the edge), and x =
u.p - e, h the height above the ground of a capsule's end p of radius r, the fall reaches as far as

    rho = max (sqrt(x^2 + h^2) + r)      over all capsule ends

beyond the edge: each end moves on a circle about it, and a capsule lies within the hull of its end balls. The nearest
part of the human along u is X = min (u.p - r) - e over his capsules. The fall clearance is X - rho, and S_f = d - (X -
rho).

For people and robots that stand upright d is the horizontal gap X - max(x + r), so that S_f = rho - max(x + r): the
robot's reach lying down minus its reach now. Where the closest points are not level, d is longer than the horizontal
gap, and S_f grows by the difference. Arms thrown out while falling are not in it.
"""

from __future__ import annotations

import math

import numpy as np

from foreshock.messages import Vec3
from foreshock_detectors.proximity._kinematics import Array

__all__ = ["Topple"]

_NOWHERE = np.array(-math.inf)  # as an array, which numpy need not convert at every call


class Topple:
    """The robot at one instant: where it stands and how high it reaches.

    Args:
        ends: both ends of each capsule, shape (n, 2, 3), m.
        radius: shape (n,), m.
        support_m: capsules whose lowest point is within this of the lowest of all count as support.
    """

    def __init__(self, ends: Array, radius: Array, support_m: float) -> None:
        self._ends = ends.reshape(-1, 3)
        self._radius = radius.repeat(2)
        z = self._ends[:, 2]
        low = z - self._radius
        ground = low.item(low.argmin())
        self._height = z - ground
        # what does not support the robot reaches nowhere
        self._support = np.where(low <= ground + support_m, self._radius, _NOWHERE)

    def reaches_m(self, u: Array) -> tuple[float, float]:
        """(e, rho) of a fall in the horizontal direction u, shape (3,).

        e: where the support ends (m), from the origin of the robot's ends; rho: how far beyond it a fall reaches (m).
        """
        # item of argmax is max, at a third of its cost
        x = self._ends.dot(u)
        edges = x + self._support
        edge_m = edges.item(edges.argmax())
        x -= edge_m
        np.hypot(x, self._height, x)
        x += self._radius
        return edge_m, x.item(x.argmax())

    def clearance_m(self, centre: Vec3, ends: Array, radius: Array) -> float:
        """X - rho in m for one human; negative where the fall can hit.

        Args:
            centre: his (m), in the frame of the robot's ends; the direction of the fall is from its origin to there.
            ends: both ends of each of his capsules relative to his centre, shape (k, 2, 3), m.
            radius: of each end, shape (2 k,), m.
        """
        x, y, _ = centre
        away = math.hypot(x, y)
        # where he stands in the robot itself, any direction will do
        u = np.array((x / away, y / away, 0.0) if away > 1e-6 else (1.0, 0.0, 0.0))
        edge_m, reach_m = self.reaches_m(u)
        near = ends.reshape(-1, 3).dot(u) - radius
        nearest_m: float = near.item(near.argmin()) + (away if away > 1e-6 else x)
        return nearest_m - edge_m - reach_m
