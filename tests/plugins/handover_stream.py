"""A handover as the robot's channels show it: straight reaches, pulls that rise by a time constant, slow drifts.

Not the plant that the detector was tuned on: no contact, no robot, a hand of constant speed, coloured noise.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from foreshock.messages import Capsule, HumanPose, Humans, TaskPhase, WrenchStamped
from foreshock.records import Sample

PERIOD_NS = 20_000_000
POINT = (0.1, 0.0, 1.0)


def person(hand_x: float) -> HumanPose:
    """A chest, and a hand on the line of the handover."""
    hand = Capsule("hand", (hand_x - 0.03, 0.0, 1.0), (hand_x + 0.03, 0.0, 1.0), 0.045)
    return HumanPose("human-1", (Capsule("chest", (0.8, 0.0, 1.1), (0.8, 0.0, 1.4), 0.15), hand))


class Handover:
    """One handover; times in s from the start, each of them may lie beyond the end: it does not happen.

    Args:
        transfer: from when the robot lets go.
        expected: when the pull is expected.
        give_up: from when the robot takes the object back.
        arrives: when the hand is at the object; it sets off 1 s before.
        pulls: when the pull begins.
        ends: when it ends.
        pull_n: the pull that is reached.
        rise_s: time constant of the pull.
    """

    def __init__(
        self, transfer: float = 3.0, expected: float = 3.4, give_up: float = 99.0, arrives: float = 3.2,
        pulls: float = 3.4, ends: float = 99.0, pull_n: float = 12.0, rise_s: float = 0.1,
    ) -> None:  # fmt: skip
        self.transfer, self.expected, self.give_up = transfer, expected, give_up
        self.arrives, self.pulls, self.ends, self.pull_n, self.rise_s = arrives, pulls, ends, pull_n, rise_s

    def plan(self, t: float) -> TaskPhase:
        """Presents, lets go when pulled, takes back."""
        if t < self.transfer:
            return TaskPhase(0, self.transfer - t)
        return TaskPhase(1, self.expected - t) if t < self.give_up else TaskPhase(3, 0.0)

    def force(self, t: float) -> float:
        """Pull without noise (N)."""
        if t < self.pulls:
            return 0.0
        risen = 1.0 - float(np.exp(-(min(t, self.ends) - self.pulls) / self.rise_s))
        return self.pull_n * risen * (1.0 if t < self.ends else float(np.exp(-(t - self.ends) / 0.1)))

    def samples(self, t_end: float, seed: int = 1, noise_n: float = 0.4, robot: str = "talos") -> Sequence[Sample]:
        """All three channels at 50 Hz, by time; noise on the wrench, half of it over 0.2 s, 1 mm on the hand."""
        rng, seen = np.random.default_rng(seed), np.random.default_rng((seed, 1))
        slow, out = 0.0, []
        for k in range(1, round(t_end * 50) + 1):
            t, stamp = k * 0.02, k * PERIOD_NS
            slow = 0.9 * slow + np.sqrt(1 - 0.81) * rng.normal()
            pull = self.force(t) + noise_n * (0.7 * slow + 0.7 * rng.normal())
            hand_x = POINT[0] + 0.6 * min(max(self.arrives - t, 0.0), 1.0) + 0.001 * seen.normal()
            wrench = WrenchStamped((float(pull), 0.0, -9.8), (0.0, 0.0, 0.0))
            named = (("plan/handover", self.plan(t)), ("right_wrist/wrench", wrench))
            out += [Sample(stamp, f"{robot}/{name}", value, k) for name, value in named]
            out.append(Sample(stamp, f"{robot}/humans/pose", Humans((person(float(hand_x)),)), k))
        return out
