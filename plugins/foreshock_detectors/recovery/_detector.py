"""The recovery detector: one verdict per arm, one of the trunk, one per human."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import cast

from foreshock.detector import Inputs
from foreshock.messages import HumanPose, Humans, Imu, JointState, Odometry
from foreshock.records import Indication, Sample, SampleRef
from foreshock_detectors._sequential import Hysteresis, severity
from foreshock_detectors.recovery._config import RecoveryConfig
from foreshock_detectors.recovery._joints import beyond_plan, tip_speed
from foreshock_detectors.recovery._separation import distance_to, protective_separation

__all__ = ["RecoveryDetector"]


class RecoveryDetector:
    """Implements foreshock.detector.Detector.

    excessive-arm-velocity: an arm's tip moves faster against the trunk than its plan, by ``arm_speed_m_s``. A fast
    motion that is planned is none, nor is a body that topples with its arms still.
    rapid-torso-recovery: the trunk turns in space, by its gyroscope, and against the legs, by the hips, both faster
    than ``torso_rate_rad_s`` beyond the plan. Toppling (hips still) is none, nor are legs that swing below a trunk that
    stays.
    human-proximity-breach: a hand is nearer to a human than S_p.

    False alarms: with rate noise s per joint the first two statistics lie 0.8 / (1.1 s) and 0.8 / s standard
    deviations below their thresholds: at s = 0.05 rad/s 14 and 16. A hand at rest
    breaches only within Z_d + Z_r of a human.
    """

    def __init__(self, config: RecoveryConfig) -> None:
        self._config = config
        self._joints = {joint for levers in config.arms.values() for joint in levers} | set(config.hips)
        self.reset(0)

    def reset(self, seed: int) -> None:  # noqa: ARG002  # nothing here is random
        """Forget everything."""
        config = self._config
        hold_ns, ratio = round(config.hold_s * 1e9), config.release_ratio
        arm, torso = config.arm_speed_m_s, config.torso_rate_rad_s
        self._arms = {name: Hysteresis(arm, ratio * arm, hold_ns) for name in config.arms}
        self._torso = Hysteresis(torso, ratio * torso, hold_ns)
        self._hold_ns = hold_ns
        self._near: dict[str, Hysteresis] = {}
        self._gone: dict[str, int] = {}

    def update(self, now_ns: int, inputs: Inputs) -> Sequence[Indication]:
        """What is observed of the three kinds."""
        found: list[Indication] = []
        latest = inputs.latest
        joints, plan = latest.get("joints"), latest.get("plan")
        excess = None
        if joints is not None and plan is not None:
            excess = beyond_plan(cast(JointState, joints.value), cast(JointState, plan.value), self._joints)
        if joints is not None and excess is not None:
            seen = (SampleRef(joints.channel, joints.stamp_ns),)
            self._judge_arms(found, excess, joints.stamp_ns, seen)
            torso = latest.get("torso")
            if torso is not None:
                gx, gy, _ = cast(Imu, torso.value).angular_velocity
                hips = sum([excess[joint] for joint in self._config.hips])
                rate = min(math.hypot(gx, gy), abs(hips))
                self._judge_torso(found, rate, torso.stamp_ns, (*seen, SampleRef(torso.channel, torso.stamp_ns)))
        self._judge_people(found, now_ns, inputs)
        return found

    def _judge_arms(
        self, found: list[Indication], excess: dict[str, float], stamp_ns: int, seen: tuple[SampleRef, ...]
    ) -> None:
        config = self._config
        least, full = config.arm_speed_m_s, config.arm_speed_full_m_s
        for arm, levers in config.arms.items():
            speed = tip_speed(excess, levers)
            present = self._arms[arm].push(speed, stamp_ns)
            grave = severity(speed, least, full) if present else 0.0
            found.append(
                Indication(
                    "excessive-arm-velocity",
                    arm,
                    stamp_ns,
                    present,
                    speed,
                    least,
                    "m/s",
                    grave,
                    seen if present else (),
                )
            )

    def _judge_torso(self, found: list[Indication], rate: float, stamp_ns: int, seen: tuple[SampleRef, ...]) -> None:
        config = self._config
        least = config.torso_rate_rad_s
        present = self._torso.push(rate, stamp_ns)
        grave = severity(rate, least, config.torso_rate_full_rad_s) if present else 0.0
        found.append(
            Indication(
                "rapid-torso-recovery", "", stamp_ns, present, rate, least, "rad/s", grave, seen if present else ()
            )
        )

    def _judge_people(self, found: list[Indication], now_ns: int, inputs: Inputs) -> None:
        """The worst pair of hand and human, per human; unobserved while a hand or the humans are not seen.

        So it is while a human has no body.
        """
        config, latest = self._config, inputs.latest
        people = latest.get("humans")
        hands = [sample for arm in config.arms if (sample := latest.get(f"hand-{arm}")) is not None]
        if people is None or len(hands) < len(config.arms):
            return
        humans = cast(Humans, people.value).humans
        if not all(human.capsules for human in humans):
            return  # somebody without a body is nowhere, not far away
        for human in humans:
            gap, separation, needed, hand = self._worst(hands, human)
            near = self._near.get(human.id)
            if near is None:
                near = self._near[human.id] = Hysteresis(0.0, -config.hysteresis_m, self._hold_ns)
            self._gone.pop(human.id, None)
            present = near.push(gap, hand.stamp_ns)
            speed = math.hypot(*cast(Odometry, hand.value).linear)
            grave = severity(speed, 0.0, config.severe_closing_m_s) if present else 0.0
            seen = (SampleRef(hand.channel, hand.stamp_ns), SampleRef(people.channel, people.stamp_ns))
            found.append(
                Indication(
                    "human-proximity-breach", human.id, hand.stamp_ns, present, separation, needed, "m", grave,
                    seen if present else (), None, {"hand_speed_m_s": speed},
                )
            )  # fmt: skip
        if len(self._near) != len(humans):
            self._depart(found, now_ns, {human.id for human in humans}, people.stamp_ns)
        elif not humans:
            found.append(_nobody("", people.stamp_ns))

    def _worst(self, hands: Sequence[Sample], human: HumanPose) -> tuple[float, float, float, Sample]:
        """By how much S_p exceeds the separation, both, and the hand, for the hand where that is most."""
        pairs = []
        for hand in hands:
            odometry = cast(Odometry, hand.value)
            separation = min(distance_to(odometry.position, human), FAR_M)
            needed = protective_separation(self._config, odometry, human)
            pairs.append((needed - separation, separation, needed, hand))
        return pairs[0] if len(pairs) == 1 else max(pairs, key=lambda pair: pair[0])

    def _depart(self, found: list[Indication], now_ns: int, here: set[str], stamp_ns: int) -> None:
        """A human whom perception no longer lists is absent for GONE_NS; then forgotten."""
        for name in [n for n in self._near if n not in here]:
            self._near[name].restart()
            if now_ns - self._gone.setdefault(name, now_ns) > GONE_NS:
                del self._near[name], self._gone[name]
            found.append(_nobody(name, stamp_ns))


FAR_M = 10.0
"""Distance stated for nobody."""

GONE_NS = 3_000_000_000
"""Longer than the evidence window."""


def _nobody(name: str, stamp_ns: int) -> Indication:
    return Indication("human-proximity-breach", name, stamp_ns, False, FAR_M, 0.0, "m", 0.0)
