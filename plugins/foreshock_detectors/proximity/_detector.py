"""The proximity detector: samples in, two kinds of indication per human out."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from foreshock.clock import NS_PER_S
from foreshock.detector import Inputs
from foreshock.records import Indication, Sample, SampleRef
from foreshock_detectors.proximity._approach import Approach
from foreshock_detectors.proximity._config import ProximityConfig
from foreshock_detectors.proximity._kinematics import CapsuleKinematics
from foreshock_detectors.proximity._nearest import NearestPairs
from foreshock_detectors.proximity._people import People
from foreshock_detectors.proximity._robot import Robot
from foreshock_detectors.proximity._separation import protective_separation

__all__ = ["ProximityDetector"]

BREACH, NARROWING = "human-proximity-breach", "narrowing-clearance"


class ProximityDetector:
    """Reports human-proximity-breach and narrowing-clearance for every human, or for ``""`` while nobody is there.

    Every update moves the robot's capsules by its joint state and the human ones by their measured velocity, and
    compares the distance d of the closest pair with S_p. Malformed input raises ValueError or ConfigError. A human who
    has left a live stream is reported absent for a while.

    The closing speed of a human who has just been found is not known. Unless even the fastest approach could not reach
    S_p within the horizon, narrowing-clearance is then left out of the answer, hence unobserved; for the others too
    where it is absent, since absence would speak for all.
    """

    def __init__(self, config: ProximityConfig) -> None:
        self._config = config
        self._robot = Robot(config)
        self.reset(0)

    def reset(self, seed: int) -> None:  # noqa: ARG002  # part of the port; nothing here is random
        """Forget everything."""
        self._body = CapsuleKinematics(self._robot)
        self._body_ns = (-1, -1)
        self._people = People(self._config)
        self._nearest = NearestPairs(self._config, self._robot)
        self._approaches: dict[str, Approach] = {}

    def update(self, now_ns: int, inputs: Inputs) -> Sequence[Indication]:
        """Two indications per human, by id; none at all if an input is missing."""
        latest = inputs.latest
        joints, odometry, humans = latest.get("joints"), latest.get("odometry"), latest.get("humans")
        if joints is None or odometry is None or humans is None:
            return []
        self._move_body(joints, odometry, humans)
        people = self._people
        people.take(humans.stamp_ns, _value(humans))
        stamp_ns = max(joints.stamp_ns, odometry.stamp_ns, humans.stamp_ns)
        evidence = tuple([SampleRef(s.channel, s.stamp_ns) for s in (joints, odometry, humans)])
        breaches, narrowings, unknown = self._judge(now_ns, stamp_ns, evidence)
        left = people.left(now_ns)
        if not people.present and "" not in left:
            left.insert(0, "")
        for subject in left:
            breaches.append(self._no_breach(subject, stamp_ns, evidence))
            narrowings.append(self._no_narrowing(subject, stamp_ns, evidence))
        if unknown:
            narrowings = [i for i in narrowings if i.present]
        return breaches + narrowings

    def _move_body(self, joints: Sample, odometry: Sample, humans: Sample) -> None:
        pose, people = _value(odometry), _value(humans)
        if people.frame_id != pose.frame_id:
            problem = f"humans/pose is in frame {people.frame_id!r}, base/odometry in {pose.frame_id!r}"
            raise ValueError(f"{problem}; expected the same")
        stamps = (joints.stamp_ns, odometry.stamp_ns)
        if stamps != self._body_ns and joints.stamp_ns >= self._body_ns[0]:
            self._body.evaluate(_value(joints), pose, joints.stamp_ns - odometry.stamp_ns)
            self._body_ns = stamps

    def _judge(
        self, now_ns: int, stamp_ns: int, evidence: tuple[SampleRef, ...]
    ) -> tuple[list[Indication], list[Indication], bool]:
        """Breaches and narrowings of those who are there, and whether anyone's narrowing is not known."""
        people, approaches = self._people, self._approaches
        if len(approaches) > len(people.present):
            there = {p.id for p in people.present}
            for name in [a for a in approaches if a not in there]:
                del approaches[name]
        age_s = max(now_ns - self._body_ns[0], 0) / NS_PER_S
        found = self._nearest.evaluate(self._body, age_s, people, now_ns)
        breaches, narrowings, unknown = [], [], False
        for person, nearest in zip(people.present, found, strict=True):
            approach = approaches.get(person.id)
            if approach is None:
                approach = approaches[person.id] = Approach(self._config)
            at_ns = person.stamp_ns + people.ages_ns(person, now_ns)[0]
            approach.take(person.stamp_ns, at_ns, nearest, person.speed_m_s)
            breaches.append(approach.breach(BREACH, person.id, stamp_ns, evidence))
            narrowing = approach.narrowing(NARROWING, person.id, stamp_ns, evidence)
            if narrowing is None:
                unknown = True
            else:
                narrowings.append(narrowing)
        return breaches, narrowings, unknown

    def _no_breach(self, subject: str, stamp_ns: int, evidence: tuple[SampleRef, ...]) -> Indication:
        """Nobody within the sensor's range: what S_p would be at its end, with a robot that does not approach."""
        separation = protective_separation(
            self._config,
            distance_m=self._config.sensor_range_m,
            human_speed_m_s=None,
            human_age_s=0.0,
            robot_speed_m_s=0.0,
            robot_age_s=0.0,
            uncertainty_m=0.0,
            fall_clearance_m=None,
        )
        distance_m, s_p_m = self._config.sensor_range_m, separation.s_p_m
        return Indication(BREACH, subject, stamp_ns, False, distance_m, s_p_m, "m", 0.0, evidence)

    def _no_narrowing(self, subject: str, stamp_ns: int, evidence: tuple[SampleRef, ...]) -> Indication:
        closing_m_s = self._config.closing_m_s
        return Indication(NARROWING, subject, stamp_ns, False, 0.0, closing_m_s, "m/s", 0.0, evidence)


def _value(sample: Sample) -> Any:
    """The message; its type is what the spec declares for the input, which the core checks."""
    return sample.value
