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


class Topple:
    """The robot at one instant: where it stands and how high it reaches.

    Args:
        ends: both ends of each capsule, shape (n, 2, 3), m.
        radius: shape (n,), m.
        support_m: capsules whose lowest point is within this of the lowest of all count as support.
    """

    def __init__(self, ends: Array, radius: Array, support_m: float) -> None:
        self._ends, self._radius = ends, radius[:, None]
        z = ends[:, :, 2]
        low = z - self._radius
        ground = low.min()
        self._height = z - ground
        self._support = low <= ground + support_m

    def edge_m(self, u: Vec3) -> float:
        """Where the support ends in the horizontal direction u: e in m from the origin."""
        return self._reaches(u)[0]

    def reach_m(self, u: Vec3) -> float:
        """Rho (m): how far beyond the edge a fall in the direction u reaches."""
        return self._reaches(u)[1]

    def _reaches(self, u: Vec3) -> tuple[float, float]:
        x = self._ends @ u
        edge_m = float((x + self._radius)[self._support].max())
        x -= edge_m
        np.hypot(x, self._height, x)
        x += self._radius
        return edge_m, float(x.max())

    def clearance_m(self, centre: Vec3, ends: Array, radius: Array) -> float:
        """X - rho in m for one human; negative where the fall can hit.

        Args:
            centre: his (m), in the frame of the robot's ends; the direction of the fall is from its origin to there.
            ends: both ends of each of his capsules relative to his centre, shape (k, 2, 3), m.
            radius: shape (k,), m.
        """
        away = math.hypot(centre[0], centre[1])
        # where he stands in the robot itself, any direction will do
        u = (centre[0] / away, centre[1] / away, 0.0) if away > 1e-6 else (1.0, 0.0, 0.0)
        edge_m, reach_m = self._reaches(u)
        nearest_m = float((ends @ u - radius[:, None]).min()) + centre[0] * u[0] + centre[1] * u[1]
        return nearest_m - edge_m - reach_m
