"""Capsules around the collision shapes of a robot: one per moving joint, then the cheapest neighbours merged.

Merging joint c into its parent replaces c's points by all places that they take over c's range, seen from the parent. A
turning point of radius p about the joint's axis is replaced by the corners of a circumscribed polyline, p / cos(step /
2) at sampled angles, and its two end positions: their hull encloses the whole arc, so that the merged capsule still
bounds.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import msgspec
import numpy as np
import pinocchio as pin

from foreshock.errors import ConfigError
from foreshock_detectors.proximity._fit import Points, bounding_capsule, hull_vertices, quick_capsule
from foreshock_detectors.proximity._shapes import shape_points

__all__ = ["RANGE_MARGIN", "BodyCapsule", "Swept", "body_capsules", "body_points"]

RANGE_MARGIN = 0.02
"""Each merged joint's range is widened by this much (rad or m) at both ends: calibration and noise of its encoder."""

_STEP_RAD = math.radians(15.0)
"""Angle between samples of an arc; the circumscribed polyline is 0.9 % wider."""


class Swept(msgspec.Struct, frozen=True):
    """A joint that no longer moves a capsule of its own.

    Attributes:
        joint: its name.
        lower: least position that the merged capsule covers (rad or m); None is unlimited.
        upper: greatest position.
        reach: largest distance of its points from its axis (m), so that one radian beyond the range moves them at most
            so far; 1 for a sliding joint.
    """

    joint: str
    lower: float | None
    upper: float | None
    reach: float


class BodyCapsule(msgspec.Struct, frozen=True):
    """A capsule fixed to the frame of a joint.

    Attributes:
        joint: name of the joint; the free-flyer's for the base.
        a: one end of the segment in that frame (m).
        b: the other end.
        radius: in m.
        swept: joints whose shapes it covers over their whole range.
    """

    joint: str
    a: tuple[float, float, float]
    b: tuple[float, float, float]
    radius: float
    swept: tuple[Swept, ...] = ()


def body_points(model: Any, geometry: Any) -> dict[int, Points]:
    """Hull vertices (m) of all collision shapes, by joint id, in the joint's frame.

    Raises:
        ConfigError: there is no collision geometry, or a shape cannot be bounded.
    """
    groups: dict[int, list[Points]] = {}
    for shape in geometry.geometryObjects:
        points = shape_points(shape.name, shape.geometry)
        placed = points @ shape.placement.rotation.T + shape.placement.translation
        groups.setdefault(int(shape.parentJoint), []).append(placed)
    if not groups:
        raise ConfigError("proximity.urdf", f"{model.name} has no collision geometry to put capsules around")
    return {joint: hull_vertices(np.vstack(parts)) for joint, parts in sorted(groups.items())}


def body_capsules(model: Any, geometry: Any, count: int) -> tuple[BodyCapsule, ...]:
    """At most count capsules if enough joints can be merged; 0 merges none. Sorted by joint id.

    The pair whose merging adds least volume goes first.
    """
    points = body_points(model, geometry)
    swept: dict[int, dict[str, Swept]] = {j: {} for j in points}
    offers: dict[int, _Offer] = {}
    while 0 < count < len(points):
        for child in points:
            if child not in offers and (offer := _offer(model, points, child)) is not None:
                offers[child] = offer
        if not offers:
            break
        child = min(offers, key=lambda c: (offers[c].growth_m3, c))
        offer = offers[child]
        points[offer.parent] = offer.points
        del points[child]
        for gone in (*swept.pop(child).values(), *offer.swept):
            known = swept[offer.parent].get(gone.joint)
            if known is None or known.reach < gone.reach:
                swept[offer.parent][gone.joint] = gone
        touched = {child, offer.parent}
        offers = {c: o for c, o in offers.items() if c not in touched and o.parent not in touched}
    return tuple(_fitted(str(model.names[j]), points[j], tuple(swept[j].values())) for j in sorted(points))


class _Offer(NamedTuple):
    """What merging would give: the joint to merge into, the volume it adds, the points there, the joints swept over."""

    parent: int
    growth_m3: float
    points: Points
    swept: tuple[Swept, ...]


def _fitted(joint: str, points: Points, swept: tuple[Swept, ...]) -> BodyCapsule:
    capsule = bounding_capsule(points)
    return BodyCapsule(joint, capsule.a, capsule.b, capsule.radius, swept)


def _offer(model: Any, points: dict[int, Points], child: int) -> _Offer | None:
    """Merging child into the nearest joint above it that has points; None if that cannot be."""
    joint, moved, swept = child, points[child], []
    while joint > 0 and (joint == child or joint not in points):
        if model.joints[joint].nv != 1:
            return None
        lower, upper = _range(model, joint)
        moved, reach = _sweep(model, joint, moved)
        swept.append(Swept(str(model.names[joint]), _or_none(lower), _or_none(upper), reach))
        joint = int(model.parents[joint])
    if joint == 0:
        return None
    merged = hull_vertices(np.vstack([points[joint], moved]))
    before = quick_capsule(points[joint]).volume_m3 + quick_capsule(points[child]).volume_m3
    return _Offer(joint, quick_capsule(merged).volume_m3 - before, merged, tuple(swept))


def _sweep(model: Any, child: int, points: Points) -> tuple[Points, float]:
    """The points at all positions of the joint, in the parent's frame, and their reach."""
    lower, upper = _range(model, child)
    data, q = model.createData(), pin.neutral(model)
    motion = _subspace(model, data, q, child)
    sliding = bool(np.abs(motion[3:]).max() == 0.0)
    if sliding:
        if not (math.isfinite(lower) and math.isfinite(upper)):
            problem = f"joint {model.names[child]!r} slides without limits and cannot be merged"
            raise ConfigError("proximity.capsules", problem, "; expected 0, or limits in the URDF")
        return np.vstack([_placed(model, data, q, child, x, points) for x in (lower, upper)]), 1.0
    u = motion[3:] / math.sqrt(float(motion[3:] @ motion[3:]))
    across = points - np.outer(points @ u, u)
    reach = float(np.linalg.norm(across, axis=1).max())
    if not upper - lower < 2.0 * math.pi:
        lower, upper = -math.pi, math.pi
    steps = max(1, math.ceil((upper - lower) / _STEP_RAD))
    wide = points + across * (1.0 / math.cos((upper - lower) / steps / 2.0) - 1.0)
    parts = [_placed(model, data, q, child, x, wide) for x in np.linspace(lower, upper, steps + 1)]
    parts += [_placed(model, data, q, child, x, points) for x in (lower, upper)]
    return hull_vertices(np.vstack(parts)), reach


def _placed(model: Any, data: Any, q: Any, child: int, position: float, points: Points) -> Points:
    joint = model.joints[child]
    if joint.nq == 2:
        q[joint.idx_q], q[joint.idx_q + 1] = math.cos(position), math.sin(position)
    else:
        q[joint.idx_q] = position
    pin.forwardKinematics(model, data, q)
    place = data.liMi[child]
    return np.asarray(points @ place.rotation.T + place.translation, dtype=np.float64)


def _subspace(model: Any, data: Any, q: Any, child: int) -> Points:
    """Motion of the joint at unit speed in its own frame: linear, then angular."""
    v = np.zeros(model.nv)
    v[model.joints[child].idx_v] = 1.0
    pin.forwardKinematics(model, data, q, v)
    parent = data.liMi[child].actInv(data.v[int(model.parents[child])])
    return np.asarray((data.v[child] - parent).vector, dtype=np.float64)


def _range(model: Any, child: int) -> tuple[float, float]:
    """Positions that a merged capsule must cover."""
    joint = model.joints[child]
    if joint.nq != 1:
        return -math.inf, math.inf
    lower, upper = float(model.lowerPositionLimit[joint.idx_q]), float(model.upperPositionLimit[joint.idx_q])
    if not lower <= upper:
        place = f"joint {model.names[child]!r} has limits {lower}..{upper}"
        raise ConfigError("proximity.urdf", place, "; expected lower <= upper")
    return lower - RANGE_MARGIN, upper + RANGE_MARGIN


def _or_none(value: float) -> float | None:
    return value if math.isfinite(value) and abs(value) < 1e6 else None
