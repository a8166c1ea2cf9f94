"""The proximity detector: samples in, two kinds of indication per human out."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from foreshock.clock import NS_PER_S
from foreshock.detector import Inputs
from foreshock.records import Indication, Sample, SampleRef
from foreshock_detectors.proximity._closing import ClosingSpeed
from foreshock_detectors.proximity._config import ProximityConfig
from foreshock_detectors.proximity._fall import Topple
from foreshock_detectors.proximity._kinematics import CapsuleKinematics
from foreshock_detectors.proximity._pair import PlacedCapsule, checked_distance_m
from foreshock_detectors.proximity._people import Crowd, People, Person
from foreshock_detectors.proximity._robot import Robot
from foreshock_detectors.proximity._segments import Array, PairDistances
from foreshock_detectors.proximity._separation import ProtectiveSeparation, protective_separation

__all__ = ["ProximityDetector"]

BREACH, NARROWING = "human-proximity-breach", "narrowing-clearance"

_HORIZON_RELEASE = 1.25
"""narrowing-clearance is withdrawn only when S_p is farther off than this many horizons."""


class _Nearest(NamedTuple):
    """The pair of capsules that is judged for one human, and the distance of the closest pair (m)."""

    distance_m: float
    robot_speed_m_s: float
    separation: ProtectiveSeparation
    closest_m: float


class _Subject:
    """What is remembered of one human: verdicts and how fast he comes nearer."""

    def __init__(self, config: ProximityConfig) -> None:
        self.closing = ClosingSpeed(config.closing_window_s)
        self.measured_ns = -1
        self.breach = False
        self.narrowing = False


class ProximityDetector:
    """Reports human-proximity-breach and narrowing-clearance for every human, or for ``""`` while nobody is there.

    Every update moves the robot's capsules by its joint state and the human ones by their measured velocity, takes the distances
    of all pairs, and reports the pair with the least d - S_p (the closest one, unless a faster part is nearer in time), by
    python-fcl and checked. Malformed input raises ValueError or ConfigError.

    The closing speed of a human who has just been found is not known. narrowing-clearance is then left out of the answer
    where it is not present, unless even the fastest approach could not reach S_p within the horizon.
    """

    def __init__(self, config: ProximityConfig) -> None:
        self._config = config
        self._robot = Robot(config)
        self._brake_s = config.reaction_s + config.stopping_speed_ratio * config.stopping_s
        self.reset(0)

    def reset(self, seed: int) -> None:  # noqa: ARG002  # part of the port; nothing here is random
        """Forget everything."""
        self._body = CapsuleKinematics(self._robot)
        self._people = People(self._config)
        self._pairs: PairDistances | None = None
        self._subjects: dict[str, _Subject] = {}
        self._robot_ns = (-1, -1)
        self._topple: Topple | None = None

    def update(self, now_ns: int, inputs: Inputs) -> Sequence[Indication]:
        """Two indications per human; none at all if an input is missing."""
        latest = inputs.latest
        joints, odometry, humans = latest.get("joints"), latest.get("odometry"), latest.get("humans")
        if joints is None or odometry is None or humans is None:
            return []
        self._move_robot(joints, odometry, humans)
        self._people.take(humans.stamp_ns, _value(humans))
        evidence = tuple([SampleRef(s.channel, s.stamp_ns) for s in (joints, odometry, humans)])
        stamp_ns = max(joints.stamp_ns, odometry.stamp_ns, humans.stamp_ns)
        crowd = self._people.crowd
        answer: list[Indication] = []
        absent = self._people.left(now_ns)
        if crowd is None:
            self._subjects.clear()
            absent.insert(0, "")
        else:
            answer = self._judge(crowd, now_ns, stamp_ns, evidence)
        narrowing_known = crowd is None or any(i.kind == NARROWING and not i.present for i in answer)
        for subject in absent:
            if crowd is not None and subject in self._subjects:
                continue
            answer.append(self._absent(BREACH, subject, stamp_ns, evidence))
            if narrowing_known:
                answer.append(self._absent(NARROWING, subject, stamp_ns, evidence))
        return answer

    def _move_robot(self, joints: Sample, odometry: Sample, humans: Sample) -> None:
        pose, people = _value(odometry), _value(humans)
        if people.frame_id != pose.frame_id:
            problem = f"humans/pose is in frame {people.frame_id!r}, base/odometry in {pose.frame_id!r}"
            raise ValueError(f"{problem}; expected the same")
        stamps = (joints.stamp_ns, odometry.stamp_ns)
        if stamps == self._robot_ns or joints.stamp_ns < self._robot_ns[0]:
            return
        self._body.evaluate(_value(joints), pose, joints.stamp_ns - odometry.stamp_ns)
        self._robot_ns = stamps
        self._topple = None
        if self._config.fall_reach:
            body = self._body
            self._topple = Topple(body.start, body.along, body.radius, self._config.fall_support_m)
