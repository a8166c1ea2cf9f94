"""Tracked people: from the tracker's messages to capsules at any instant, with who is carried on and who has left."""

from __future__ import annotations

import math

import msgspec
import numpy as np

from foreshock.clock import NS_PER_S, ns
from foreshock.messages import HumanPose, Humans, Vec3
from foreshock_detectors.proximity._config import ProximityConfig
from foreshock_detectors.proximity._kinematics import Array

__all__ = ["People", "Person"]


class Person(msgspec.Struct, frozen=True):
    """One person as measured last.

    Attributes:
        id: of the track.
        stamp_ns: when he was measured.
        ends: both ends of each of his k capsules relative to his centre, shape (k, 2, 3), m.
        radius: shape (k,), m.
        end_radius: the same for each end, shape (2 k,), m.
        half_m: half the length of each segment (m).
        segments: the ends once more, as numbers of Python.
        centre: mean of the ends, in odom (m).
        velocity: of his trunk (m/s), None if it is not measured.
        speed_m_s: its magnitude.
        uncertainty_m: Z_d as stated.
    """

    id: str
    stamp_ns: int
    ends: Array
    radius: Array
    end_radius: Array
    half_m: tuple[float, ...]
    segments: list[tuple[Vec3, Vec3]]
    centre: Vec3
    velocity: Vec3 | None
    speed_m_s: float | None
    uncertainty_m: float


class People:
    """Keeps the tracks. A track that is missing from a newer message is carried on for a while, then has left."""

    def __init__(self, config: ProximityConfig) -> None:
        self._extrapolation_ns = ns(config.extrapolation_s)
        self._dropout_ns, self._departed_ns = ns(config.human_dropout_s), ns(config.human_departed_s)
        self._stamp_ns = -1
        self._known: dict[str, Person] = {}
        self._left: dict[str, int] = {}
        self.present: tuple[Person, ...] = ()
        """Everybody who is there, by id."""

    def take(self, stamp_ns: int, message: Humans) -> None:
        """The tracker's message; one that is not newer than the last changes nothing.

        Raises:
            ValueError: an id is doubled, or a person has no capsules or one that is not a capsule.
        """
        if stamp_ns <= self._stamp_ns:
            return
        seen: dict[str, Person] = {}
        for pose in message.humans:
            if pose.id in seen:
                raise ValueError(f"humans/pose: two humans have the id {pose.id!r}")
            seen[pose.id] = _person(pose, stamp_ns)
        self._stamp_ns = stamp_ns
        for name, person in self._known.items():
            if name not in seen:
                if stamp_ns - person.stamp_ns <= self._dropout_ns:
                    seen[name] = person
                else:
                    self._left[name] = stamp_ns
        for name in seen:
            self._left.pop(name, None)
        self._known = seen
        self.present = tuple([seen[name] for name in sorted(seen)])

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

    def centre(self, person: Person, now_ns: int, origin: Vec3) -> Vec3:
        """His centre at now_ns, relative to the origin (m)."""
        x, y, z = person.centre
        if person.velocity is not None:
            dt_s = self.ages_ns(person, now_ns)[0] / NS_PER_S
            vx, vy, vz = person.velocity
            x, y, z = x + vx * dt_s, y + vy * dt_s, z + vz * dt_s
        return x - origin[0], y - origin[1], z - origin[2]


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
    ends = np.array([(c.a, c.b) for c in pose.capsules])
    centre = ends.mean(axis=(0, 1))
    x, y, z = centre.tolist()
    speed = None if velocity is None else math.hypot(*velocity)
    radius = np.array([c.radius for c in pose.capsules])
    ends -= centre
    return Person(
        id=pose.id,
        stamp_ns=stamp_ns,
        ends=ends,
        radius=radius,
        end_radius=radius.repeat(2),
        half_m=tuple([0.5 * math.dist(c.a, c.b) for c in pose.capsules]),
        segments=ends.tolist(),
        centre=(x, y, z),
        velocity=velocity,
        speed_m_s=speed,
        uncertainty_m=pose.uncertainty,
    )
