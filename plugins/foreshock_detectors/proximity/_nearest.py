"""How near each human is, and how large S_p is for him."""

from __future__ import annotations

import math

import msgspec
import numpy as np

from foreshock.clock import NS_PER_S
from foreshock.messages import Vec3
from foreshock_detectors.proximity._closed_form import segment_distance_m
from foreshock_detectors.proximity._config import ProximityConfig
from foreshock_detectors.proximity._fall import Topple
from foreshock_detectors.proximity._kinematics import Array, CapsuleKinematics
from foreshock_detectors.proximity._pair import Gauge, PlacedCapsule, checked_distance_m
from foreshock_detectors.proximity._people import People, Person
from foreshock_detectors.proximity._robot import Robot
from foreshock_detectors.proximity._scene import Scene
from foreshock_detectors.proximity._separation import ProtectiveSeparation, protective_separation

__all__ = ["Nearest", "NearestPairs", "approach_speeds"]

_SUM = np.ones(3)
# as arrays, which numpy need not convert at every call
_ZERO, _ONE, _TINY = np.array(0.0), np.array(1.0), np.array(1e-12)


class Nearest(msgspec.Struct, frozen=True, gc=False):
    """How near one human is.

    Attributes:
        distance_m: d, between the closest capsules.
        part_speed_m_s: speed of the robot's closest capsule towards the closest point of him; negative if it withdraws.
        robot_speed_m_s: v_r, the greatest such speed of all the robot's capsules.
        separation: S_p.
    """

    distance_m: float
    part_speed_m_s: float
    robot_speed_m_s: float
    separation: ProtectiveSeparation


class NearestPairs:
    """coal finds the closest pair, python-fcl measures it, the closed form checks that.

    Each time one other pair, by turns, is checked not to be closer: in n k updates all n k pairs of a human.

    v_r is not that of the closest part alone: a faster part behind it may arrive first.
    """

    def __init__(self, config: ProximityConfig, robot: Robot) -> None:
        self._config, self._robot = config, robot
        self._scenes: dict[str, Scene] = {}
        self._gauge = Gauge()
        self._turn = 0

    def evaluate(self, body: CapsuleKinematics, body_age_s: float, people: People, now_ns: int) -> list[Nearest]:
        """One record per person who is there, at now_ns.

        Args:
            body: the robot.
            body_age_s: how old its state is.
            people: with those who are there.
            now_ns: time of the answer.

        Raises:
            ValueError: a distance fails its check.
        """
        config, present = self._config, people.present
        self._turn += 1
        if len(self._scenes) > len(present):
            self._scenes = {p.id: self._scenes[p.id] for p in present if p.id in self._scenes}
        topple = Topple(body.ends, body.radius, config.fall_support_m) if present and config.fall_reach else None
        found = []
        for person in present:
            centre = people.centre(person, now_ns, body.origin)
            there = np.array(centre)
            i, j, point = self._scene(person).closest(body, there)
            distance_m = checked_distance_m(
                _robot_capsule(body, i), _human_capsule(person, j, centre), config.consistency_m, self._gauge
            )
            self._audit(body, person, centre, distance_m)
            speeds = approach_speeds(body.axes, body.velocities, body.length2, point)
            speeds += body.speed
            robot_speed_m_s = speeds.item(speeds.argmax())
            clearance_m = None if topple is None else topple.clearance_m(centre, person.ends, person.end_radius)
            separation = protective_separation(
                config,
                distance_m=distance_m,
                human_speed_m_s=person.speed_m_s,
                human_age_s=people.ages_ns(person, now_ns)[1] / NS_PER_S,
                robot_speed_m_s=robot_speed_m_s,
                robot_age_s=body_age_s,
                uncertainty_m=person.uncertainty_m,
                fall_clearance_m=clearance_m,
            )
            found.append(Nearest(distance_m, speeds.item(i), robot_speed_m_s, separation))
        return found

    def _audit(self, body: CapsuleKinematics, person: Person, centre: Vec3, distance_m: float) -> None:
        """Refuse the closest pair if the pair whose turn it is is closer."""
        k = len(person.half_m)
        i, j = divmod(self._turn % (len(body.half_m) * k), k)
        (a, b, robot_m), (c, d, human_m) = _robot_capsule(body, i), _human_capsule(person, j, centre)
        radii_m = robot_m + human_m
        # the balls around both are closer than the capsules themselves: mostly that is answer enough
        middles_m = 0.5 * math.hypot(a[0] + b[0] - c[0] - d[0], a[1] + b[1] - c[1] - d[1], a[2] + b[2] - c[2] - d[2])
        if middles_m - body.half_m[i] - person.half_m[j] - radii_m >= distance_m:
            return
        other_m = segment_distance_m(a, b, c, d) - radii_m
        if not other_m >= distance_m - self._config.consistency_m:
            raise ValueError(
                f"capsules {i} and {j} are {other_m:.6f} m apart, the closest are said to be {distance_m:.6f} m"
            )

    def _scene(self, person: Person) -> Scene:
        scene = self._scenes.get(person.id)
        if scene is None or not scene.fits(person):
            scene = self._scenes[person.id] = Scene(self._robot, person)
        scene.measure(person)
        return scene


def approach_speeds(ends: Array, velocities: Array, length2: Array, point: Array) -> Array:
    """Greatest speed (m/s) of each of n capsules' axes along the line from its closest point to a point; shape (n,).

    Args:
        ends: both ends of each, shape (n, 2, 3), m.
        velocities: theirs, shape (n, 2, 3), m/s. In between they are linear, so that the greatest is at an end.
        length2: squared length of each, shape (n,), m^2, above 0.
        point: shape (3,), m.
    """
    start = ends[:, 0]
    along = ends[:, 1] - start
    rest = point - start
    t = (rest * along).dot(_SUM)
    t /= length2
    np.minimum(np.maximum(t, _ZERO, out=t), _ONE, out=t)
    rest -= along * t[:, None]
    distance = np.sqrt((rest * rest).dot(_SUM))
    speeds = np.maximum((velocities[:, 0] * rest).dot(_SUM), (velocities[:, 1] * rest).dot(_SUM))
    # a point on the axis lies in no direction; then the quotient is bounded by the speed itself
    speeds /= np.maximum(distance, _TINY)
    return np.asarray(speeds, dtype=np.float64)


def _robot_capsule(body: CapsuleKinematics, i: int) -> PlacedCapsule:
    a, b = body.ends[i].tolist()
    return PlacedCapsule(a, b, body.radius.item(i))


def _human_capsule(person: Person, j: int, centre: Vec3) -> PlacedCapsule:
    x, y, z = centre
    (ax, ay, az), (bx, by, bz) = person.segments[j]
    return PlacedCapsule((ax + x, ay + y, az + z), (bx + x, by + y, bz + z), person.radius.item(j))
