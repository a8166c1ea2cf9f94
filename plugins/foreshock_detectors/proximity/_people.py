"""Tracked people: from the tracker's messages to capsules at any instant, with who is carried on and who has left."""

from __future__ import annotations

import math
from collections.abc import Mapping

import msgspec
import numpy as np
from numpy.typing import NDArray

from foreshock.clock import NS_PER_S, ns
from foreshock.messages import HumanPose, Humans, Vec3
from foreshock_detectors.proximity._config import ProximityConfig
from foreshock_detectors.proximity._segments import Array

__all__ = ["Crowd", "People", "Person"]


class Person(msgspec.Struct, frozen=True):
    """One person as measured last.

    Attributes:
        id: of the track.
        stamp_ns: when he was measured.
        start: one end of each of his k capsules, shape (k, 3), m, in odom.
        along: from there to the other end, shape (k, 3), m.
        radius: shape (k,), m.
        velocity: of his trunk (m/s), None if it is not measured.
        speed_m_s: its magnitude.
        uncertainty_m: Z_d as stated.
    """

    id: str
    stamp_ns: int
    start: Array
    along: Array
    radius: Array
    velocity: Vec3 | None
    speed_m_s: float | None
    uncertainty_m: float


class Crowd(msgspec.Struct, frozen=True):
    """The capsules of all people behind each other.

    Attributes:
        people: sorted by id.
        first: index of the first capsule of each, and the number of all.
        owner: index of the person that each capsule belongs to, shape (m,).
        start: shape (m, 3), m, in odom as measured.
        along: shape (m, 3), m.
        radius: shape (m,), m.
    """

    people: tuple[Person, ...]
    first: tuple[int, ...]
    owner: NDArray[np.intp]
    start: Array
    along: Array
    radius: Array


class People:
    """Keeps the tracks. A track that is missing from a newer message is carried on for a while, then has left."""

    def __init__(self, config: ProximityConfig) -> None:
        self._extrapolation_ns = ns(config.extrapolation_s)
        self._dropout_ns, self._departed_ns = ns(config.human_dropout_s), ns(config.human_departed_s)
        self.stamp_ns = -1
        self._known: dict[str, Person] = {}
        self._left: dict[str, int] = {}
        self.crowd: Crowd | None = None
        """Everybody who is there; None if nobody is."""

    def take(self, stamp_ns: int, message: Humans) -> None:
        """The tracker's message; one that is not newer than the last changes nothing.

        Raises:
            ValueError: an id is doubled, or a person has no capsules or one that is not a capsule.
        """
        if stamp_ns <= self.stamp_ns:
            return
        seen: dict[str, Person] = {}
        for pose in message.humans:
            if pose.id in seen:
                raise ValueError(f"humans/pose: two humans have the id {pose.id!r}")
            seen[pose.id] = _person(pose, stamp_ns)
        self.stamp_ns = stamp_ns
        for name, person in self._known.items():
            if name not in seen:
                if stamp_ns - person.stamp_ns <= self._dropout_ns:
                    seen[name] = person
                else:
                    self._left[name] = stamp_ns
        for name in seen:
            self._left.pop(name, None)
        self._known = seen
        self.crowd = _crowd(seen) if seen else None

    def left(self, now_ns: int) -> list[str]:
        """Ids of those who have left not long ago, sorted."""
        if self._left:
            self._left = {i: t for i, t in self._left.items() if now_ns - t <= self._departed_ns}
        return sorted(self._left)

    def ages_ns(self, person: Person, now_ns: int) -> tuple[int, int]:
        """Over how much of its age a position is extrapolated, and how much is left."""
        age = max(now_ns - person.stamp_ns, 0)
        used = min(age, self._extrapolation_ns) if person.velocity is not None else 0
        return used, age - used

    def start(self, crowd: Crowd, now_ns: int, origin: Vec3) -> Array:
        """Starts of all capsules at now_ns, relative to the origin, shape (m, 3), m."""
        shift = [self.shift(p, now_ns, origin) for p in crowd.people]
        if len(shift) == 1:
            return np.asarray(crowd.start + shift[0], dtype=np.float64)
        return np.asarray(crowd.start + np.array(shift)[crowd.owner], dtype=np.float64)

    def shift(self, person: Person, now_ns: int, origin: Vec3) -> Vec3:
        """From a position as measured to the one at now_ns, relative to the origin (m)."""
        x, y, z = origin
        if person.velocity is None:
            return -x, -y, -z
        dt_s = self.ages_ns(person, now_ns)[0] / NS_PER_S
        vx, vy, vz = person.velocity
        return vx * dt_s - x, vy * dt_s - y, vz * dt_s - z


def _person(pose: HumanPose, stamp_ns: int) -> Person:
    place = f"humans/pose: human {pose.id!r}"
    if not pose.capsules:
        raise ValueError(f"{place} has no capsules; expected at least one")
    for capsule in pose.capsules:
        if not math.isfinite(sum(capsule.a) + sum(capsule.b)) or not 0.0 < capsule.radius < math.inf:
            raise ValueError(f"{place}: not a capsule: {capsule}")
    velocity = pose.velocity
    if velocity is not None and not math.isfinite(sum(velocity)):
        raise ValueError(f"{place}: velocity is not finite: {velocity}")
    if not 0.0 <= pose.uncertainty < math.inf:
        raise ValueError(f"{place}: uncertainty {pose.uncertainty} is not a length")
    start, end = np.array([c.a for c in pose.capsules]), np.array([c.b for c in pose.capsules])
    speed = None if velocity is None else math.hypot(*velocity)
    radius = np.array([c.radius for c in pose.capsules])
    return Person(pose.id, stamp_ns, start, end - start, radius, velocity, speed, pose.uncertainty)


def _crowd(known: Mapping[str, Person]) -> Crowd:
    people = tuple(known[i] for i in sorted(known))
    sizes = [len(p.radius) for p in people]
    first = tuple(np.cumsum([0, *sizes]).tolist())
    start, along = np.vstack([p.start for p in people]), np.vstack([p.along for p in people])
    owner = np.repeat(np.arange(len(people)), sizes)
    return Crowd(people, first, owner, start, along, np.concatenate([p.radius for p in people]))
