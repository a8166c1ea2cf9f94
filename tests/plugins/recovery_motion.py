"""Streams of a robot whose arms and trunk move as told: sums of smooth pulses and coloured noise, no dynamics."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import msgspec
import numpy as np

from foreshock.detector import Inputs
from foreshock.messages import Capsule, HumanPose, Humans, Imu, JointState, Odometry
from foreshock.records import Sample

STEP_NS = 10_000_000
JOINTS = ("hip", "shoulder", "elbow")
Course = Callable[[float], float]
CHANNELS = {
    "joints": "joints/state", "plan": "joints/plan", "torso": "imu/torso", "humans": "humans/pose",
    "hand-arm": "arm/odometry",
}  # fmt: skip


def pulse(at: float, peak: float, width: float = 0.15) -> Course:
    """A Gaussian pulse of a velocity."""
    return lambda t: peak * math.exp(-0.5 * ((t - at) / width) ** 2)


def still(_: float) -> float:
    """Nothing."""
    return 0.0


def person(name: str, x: float) -> HumanPose:
    """One vertical capsule of a trunk at (x, 0)."""
    return HumanPose(name, (Capsule("chest", (x, 0.0, 0.9), (x, 0.0, 1.4), 0.15),), (0.0, 0.0, 0.0), 0.02)


class Motion:
    """Makes the inputs of a tick.

    Args:
        rates: velocity of each joint (rad/s) over time; what is missing stands still.
        plans: the same, planned.
        gyro: pitch rate of the trunk (rad/s).
        hand_speed: of the hand (m/s), upwards.
        people: who is there, over time.
        seed: of the noise: joint rates 0.05 rad/s, gyro 0.03 rad/s, hand 3 mm and 0.03 m/s, people 1 um.
    """

    def __init__(
        self,
        rates: Mapping[str, Course] | None = None,
        plans: Mapping[str, Course] | None = None,
        gyro: Course = still,
        hand_speed: Course = still,
        people: Callable[[float], tuple[HumanPose, ...]] = lambda _: (person("ann", 1.0),),
        seed: int = 0,
    ) -> None:
        self.rates, self.plans = rates or {}, plans or {}
        self.gyro, self.hand_speed, self.people = gyro, hand_speed, people
        self.rng, self.seen = np.random.default_rng(seed), np.random.default_rng((seed, 1))

    def shaken(self, human: HumanPose) -> HumanPose:
        """As a tracker sees them: never twice the same."""
        uncertainty = human.uncertainty + abs(1e-6 * self.seen.normal())
        return msgspec.structs.replace(human, uncertainty=uncertainty)

    def samples(self, k: int) -> dict[str, Sample]:
        """The k-th sample of each input, by its name."""
        t, stamp, z = k * 0.01, (k + 1) * STEP_NS, self.rng.standard_normal(9).tolist()
        rates = [self.rates.get(j, still)(t) + 0.05 * z[i] for i, j in enumerate(JOINTS)]
        plan = tuple(self.plans.get(j, still)(t) for j in JOINTS)
        hand = (0.4 + 0.003 * z[3], 0.0, 1.1)
        values = {
            "joints": JointState(JOINTS, (0.0, 0.0, 0.0), tuple(rates)),
            "plan": JointState(JOINTS, (0.0, 0.0, 0.0), plan),
            "torso": Imu((0.0, 0.0, 0.0, 1.0), (0.03 * z[4], self.gyro(t) + 0.03 * z[5], 0.0), (0.0, 0.0, 9.81)),
            "humans": Humans(tuple(map(self.shaken, self.people(t)))),
            "hand-arm": Odometry(
                hand,
                (0.0, 0.0, 0.0, 1.0),
                (0.03 * z[6], 0.03 * z[7], self.hand_speed(t) + 0.03 * z[8]),
                (0.0, 0.0, 0.0),
            ),
        }
        return {name: Sample(stamp, f"talos/{CHANNELS[name]}", value, k) for name, value in values.items()}

    def inputs(self, k: int, without: tuple[str, ...] = ()) -> tuple[int, Inputs]:
        """Time of the tick and what the detector gets."""
        latest = {name: s for name, s in self.samples(k).items() if name not in without}
        return (k + 1) * STEP_NS, Inputs(latest, {name: (s,) for name, s in latest.items()})
