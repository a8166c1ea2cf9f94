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

from foreshock_detectors.proximity._segments import Array

__all__ = ["Topple"]


class Topple:
    """The robot at one instant: where it stands and how high it reaches.

    Args:
        start: one end of each capsule, shape (n, 3), m.
        along: from there to the other end, shape (n, 3), m.
        radius: shape (n,), m.
        support_m: capsules whose lowest point is within this of the lowest of all count as support.
    """

    def __init__(self, start: Array, along: Array, radius: Array, support_m: float) -> None:
        n = len(start)
        ends = np.empty((2 * n, 3))
        ends[:n] = start
        np.add(start, along, ends[n:])
        self._flat = ends[:, :2]
        self._radius = radius = np.concatenate((radius, radius))
        z = ends[:, 2]
        low = z - radius
        ground = low.min()
        self._height = z - ground
        self._support = (low <= ground + support_m).nonzero()[0]

    def edge_m(self, u: Array) -> float:
        """Where the support ends in the horizontal direction u, shape (2,): e in m from the origin."""
        feet = self._support
        return float((self._flat[feet] @ u + self._radius[feet]).max())

    def reach_m(self, u: Array, edge_m: float) -> float:
        """Rho (m): how far beyond the edge a fall in the direction u reaches."""
        x = self._flat @ u
        x -= edge_m
        np.hypot(x, self._height, x)
        x += self._radius
        return float(x.max())

    def clearance_m(self, start: Array, along: Array, radius: Array) -> float:
        """X - rho in m for one human; negative where the fall can hit.

        Args:
            start: one end of each of his capsules, shape (k, 3), m, in the frame of the robot's.
            along: from there to the other end, shape (k, 3), m.
            radius: shape (k,), m.
        """
        near, far = start[:, :2], start[:, :2] + along[:, :2]
        x, y = (near.sum(axis=0) + far.sum(axis=0)).tolist()
        away = math.hypot(x, y)
        if away < 1e-6:  # he stands where the robot's base is: any direction will do
            x, y, away = 1.0, 0.0, 1.0
        u = np.array((x / away, y / away))
        edge_m = self.edge_m(u)
        nearest_m = float((np.minimum(near @ u, far @ u) - radius).min())
        return nearest_m - edge_m - self.reach_m(u, edge_m)
