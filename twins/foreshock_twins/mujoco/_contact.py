"""What the robot does to a human: contact forces by the body model of ISO/TS 15066.

Each capsule of the human is a region of Annex A: a free mass m behind a spring K (Table A.3). MuJoCo finds where and
how deep the robot's parts are in it and computes no force; with depth d, closing speed u, displacement x of the mass,

    F = max(0, K (d - x) + D (u - x'))        m x'' = F

acts on the robot at the contact, without friction, at every step of MuJoCo's. The human himself is not moved by it.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import mujoco
import numpy as np

__all__ = ["REGIONS", "HumanContacts", "Region", "Touch", "untouchable"]

_DAMPING = 100.0
"""N s/m, D."""


class Region(NamedTuple):
    """Limits and yield of a body region, ISO/TS 15066 Annex A as commonly cited.

    Attributes:
        limit: quasi-static force (N); transient holds the factor that a short contact may have of it.
        transient: 1 where none beyond it is permitted.
        stiffness: N/m.
        mass: kg, effective.
    """

    limit: float
    transient: float
    stiffness: float
    mass: float


REGIONS = {
    "face": Region(65.0, 1.0, 75000.0, 4.4),
    "chest": Region(140.0, 2.0, 25000.0, 40.0),
    "abdomen": Region(110.0, 2.0, 10000.0, 40.0),
    "pelvis": Region(180.0, 2.0, 25000.0, 40.0),
    "upper-arm": Region(150.0, 2.0, 30000.0, 3.0),
    "forearm": Region(160.0, 2.0, 40000.0, 2.0),
    "hand": Region(140.0, 2.0, 75000.0, 0.6),
    "thigh": Region(220.0, 2.0, 50000.0, 75.0),
    "lower-leg": Region(130.0, 2.0, 60000.0, 75.0),
}


class Touch(NamedTuple):
    """A contact force at one step: the robot's body (MuJoCo's id), the region that it touches, the force (N)."""

    body: int
    region: str
    force: float


def untouchable(geom: Any) -> None:
    """Let MuJoCo (4.0 on) find contacts of a geom and compute no force: none is deeper than its margin, 1 m."""
    geom.margin, geom.gap = -1.0, 1.0


class HumanContacts:
    """Applies the forces and remembers how far the regions have given way.

    Args:
        model: compiled, with the human.
        parts: of each of the human's capsules, name of its geom and region.
    """

    def __init__(self, model: Any, parts: list[tuple[str, str]]) -> None:
        self._regions = {int(model.geom(geom).id): region for geom, region in parts}
        self._first = min(self._regions, default=0)
        self._order = {geom: k for k, geom in enumerate(self._regions)}
        self.reset()

    def reset(self) -> None:
        """Nothing has touched anything yet."""
        self._given: dict[int, tuple[float, float]] = {}

    def apply(self, model: Any, data: Any, velocities: Any, dt: float) -> list[Touch]:
        """Put the forces of now into qfrc_applied, which the caller has cleared.

        Args:
            model: MuJoCo's model.
            data: after mj_step1.
            velocities: of the capsules' middles (m/s), in the order of parts.
            dt: step (s).
        """
        deepest: dict[tuple[int, int], int] = {}
        contact = data.contact
        excluded = contact.exclude  # from MuJoCo's solver: contacts with the human alone are
        if excluded.any():
            pairs, depths = contact.geom, contact.dist
            for k in np.flatnonzero(excluded).tolist():
                a, b = int(pairs[k, 0]), int(pairs[k, 1])
                human = a if a in self._regions else b if b in self._regions else -1
                if human >= 0:
                    pair = (human, b if human == a else a)
                    if pair not in deepest or depths[k] < depths[deepest[pair]]:
                        deepest[pair] = k
        touches = []
        pushed: dict[int, float] = {}
        for (human, other), k in deepest.items():
            touches.append(self._touch(model, data, human, other, k, velocities))
            pushed[human] = pushed.get(human, 0.0) + touches[-1].force
        if deepest or self._given:
            self._give_way({human for human, _ in deepest}, pushed, dt)
        return touches

    def _touch(self, model: Any, data: Any, human: int, other: int, k: int, velocities: Any) -> Touch:
        region = REGIONS[self._regions[human]]
        normal = data.contact.frame[k][:3] * (1.0 if data.contact.geom[k, 0] == human else -1.0)  # out of the human
        point = data.contact.pos[k]
        body = int(model.geom_bodyid[other])
        spatial = data.cvel[body]
        arm = point - data.subtree_com[int(model.body_rootid[body])]
        speed = spatial[3:] + np.cross(spatial[:3], arm) - velocities[self._order[human]]
        x, rate = self._given.get(human, (0.0, 0.0))
        depth, closing = -float(data.contact.dist[k]) - x, -float(speed @ normal) - rate
        force = max(0.0, region.stiffness * depth + _DAMPING * closing) if depth > 0.0 else 0.0
        mujoco.mj_applyFT(model, data, force * normal, np.zeros(3), point, body, data.qfrc_applied)
        return Touch(body, self._regions[human], force)

    def _give_way(self, touched: set[int], pushed: dict[int, float], dt: float) -> None:
        self._given = {k: v for k, v in self._given.items() if k in touched}
        for human in touched:
            x, rate = self._given.get(human, (0.0, 0.0))
            rate += dt * pushed.get(human, 0.0) / REGIONS[self._regions[human]].mass
            self._given[human] = (x + dt * rate, rate)
