"""For each human the pair of capsules that decides: the one with the least d - S_p."""

from __future__ import annotations

import msgspec
import numpy as np

from foreshock.clock import NS_PER_S
from foreshock_detectors.proximity._config import ProximityConfig
from foreshock_detectors.proximity._fall import Topple
from foreshock_detectors.proximity._kinematics import CapsuleKinematics
from foreshock_detectors.proximity._pair import PlacedCapsule, checked_distance_m
from foreshock_detectors.proximity._people import Crowd, People
from foreshock_detectors.proximity._segments import Array, PairDistances
from foreshock_detectors.proximity._separation import ProtectiveSeparation, protective_separation

__all__ = ["Nearest", "NearestPairs"]


class Nearest(msgspec.Struct, frozen=True, gc=False):
    """How near one human is.

    Attributes:
        distance_m: d of the pair that is judged.
        closest_m: d of the closest pair; the same unless a faster part is nearer in time.
        robot_speed_m_s: v_r of the judged pair; negative where the robot's part withdraws.
        separation: S_p of the judged pair.
    """

    distance_m: float
    closest_m: float
    robot_speed_m_s: float
    separation: ProtectiveSeparation


class NearestPairs:
    """Finds it: all pairs by arrays, then python-fcl, checked, on the closest and on the first to be reached.

    In S_p only S_r and S_s = v_r (T_r + age + share T_s) differ between the pairs of one human, and S_h, which is not
    smaller for a nearer one. So the least d - S_p is at the closest pair or at the one with the least d - S_r - S_s.
    """

    def __init__(self, config: ProximityConfig) -> None:
        self._config = config
        self._brake_s = config.reaction_s + config.stopping_speed_ratio * config.stopping_s
        self._pairs = PairDistances(0, 0)
        self._size = (0, 0)

    def evaluate(
        self, body: CapsuleKinematics, body_age_s: float, people: People, crowd: Crowd, now_ns: int
    ) -> list[Nearest]:
        """One record per person of the crowd, at now_ns.

        Args:
            body: the robot.
            body_age_s: how old its state is.
            people: extrapolates.
            crowd: the people.
            now_ns: time of the answer.

        Raises:
            ValueError: a distance fails its check.
        """
        config = self._config
        size = len(body.start), len(crowd.radius)
        if self._size != size:
            self._pairs, self._size = PairDistances(*size), size
        starts = people.start(crowd, now_ns, body.origin)
        robot = (body.start, body.along, body.velocity, body.spin, body.radius)
        self._pairs.evaluate(robot, (starts, crowd.along, crowd.radius))
        gap, speed = self._pairs.gap, self._pairs.speed
        speed += body.speed[:, None]
        early = np.maximum(speed, 0.0)
        early *= -(self._brake_s + body_age_s)
        early += gap
        topple = Topple(body.start, body.along, body.radius, config.fall_support_m) if config.fall_reach else None
        found = []
        for person, first, last in zip(crowd.people, crowd.first, crowd.first[1:], strict=False):
            mine = slice(first, last)
            clearance_m = None
            if topple is not None:
                clearance_m = topple.clearance_m(starts[mine], crowd.along[mine], person.radius)
            rest_ns = people.ages_ns(person, now_ns)[1]
            candidates: list[Nearest] = []
            for i, j in {_least(gap[:, mine]): None, _least(early[:, mine]): None}:
                k = first + j
                distance_m = checked_distance_m(
                    _placed(body.start, body.along, body.radius, i),
                    _placed(starts, crowd.along, crowd.radius, k),
                    config.consistency_m,
                )
                robot_speed_m_s = float(speed[i, k])
                closest_m = candidates[0].distance_m if candidates else distance_m
                separation = protective_separation(
                    config,
                    distance_m=distance_m,
                    human_speed_m_s=person.speed_m_s,
                    human_age_s=rest_ns / NS_PER_S,
                    robot_speed_m_s=robot_speed_m_s,
                    robot_age_s=body_age_s,
                    uncertainty_m=person.uncertainty_m,
                    fall_clearance_m=clearance_m,
                )
                candidates.append(Nearest(distance_m, closest_m, robot_speed_m_s, separation))
            found.append(min(candidates, key=_margin_m))
        return found


def _margin_m(nearest: Nearest) -> float:
    return nearest.distance_m - nearest.separation.s_p_m


def _least(values: Array) -> tuple[int, int]:
    row, column = divmod(int(values.argmin()), int(values.shape[1]))
    return row, column


def _placed(start: Array, along: Array, radius: Array, k: int) -> PlacedCapsule:
    x, y, z = start[k].tolist()
    dx, dy, dz = along[k].tolist()
    return PlacedCapsule((x, y, z), (x + dx, y + dy, z + dz), float(radius[k]))
