"""A load between two carriers as the robot's channels show it, put together from sums of sines.

Not the plant that the detector was tuned on: no mechanics, swings with a second harmonic, coloured noise.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from foreshock.messages import GripState, Odometry, Scalar, WrenchStamped
from foreshock.records import Sample

G = 9.80665
PERIOD_NS = 20_000_000
HALF_M = 0.8
Curve = Callable[[float], float]


class Carried:
    """What happens, as functions of the time (s).

    Args:
        share: of 20 kg that the robot carries.
        agreed: what the plan says of it.
        lag: phase of the partner's end ahead of the robot's (rad).
        grip_lag: phase of the grip force ahead of the load (rad).
        swing: amplitude of both ends' velocity (m/s), and 100 times it of the load (N).
        hz: of the steps.
        common: velocity of both ends beside the steps (m/s).
        partner: amplitude of the partner's end over the robot's.
    """

    def __init__(
        self, share: Curve = lambda t: 0.5, agreed: Curve = lambda t: 0.5, lag: Curve = lambda t: 0.1,
        grip_lag: Curve = lambda t: 0.1, swing: Curve = lambda t: 0.18, hz: float = 1.7,
        common: Curve = lambda t: 0.0, partner: float = 1.3,
    ) -> None:  # fmt: skip
        self.share, self.agreed, self.lag, self.grip_lag = share, agreed, lag, grip_lag
        self.swing, self.hz, self.common, self.partner = swing, hz, common, partner

    def samples(self, t_end: float, seed: int = 1, robot: str = "talos") -> Sequence[Sample]:
        """All four channels at 50 Hz, by time."""
        rng, slow, out = np.random.default_rng(seed), np.zeros(4), []
        for k in range(1, round(t_end * 50) + 1):
            t, stamp = k * 0.02, k * PERIOD_NS
            slow = 0.9 * slow + math.sqrt(1 - 0.81) * rng.normal(size=4)
            noise = (0.7 * slow + 0.7 * rng.normal(size=4)).tolist()
            phase, swing = 2 * math.pi * self.hz * t, self.swing(t)

            def wave(angle: float) -> float:
                return math.sin(angle) + 0.2 * math.sin(2 * angle + 0.5)

            low = self.common(t) + swing * wave(phase) + 0.01 * noise[0]
            high = self.common(t) + self.partner * swing * wave(phase + self.lag(t)) + 0.01 * noise[1]
            carried = 20 * G * self.share(t) + 100 * swing * wave(phase)
            grip = 1.5 * (20 * G * self.share(t) + 100 * swing * wave(phase + self.grip_lag(t))) + noise[2]
            middle, turning = 0.5 * (low + high), 0.5 * (high - low) / HALF_M
            load = Odometry((t, 0.0, 0.9), (0.0, 0.0, 0.0, 1.0), (0.7, 0.0, middle), (0.0, -turning, 0.0))
            state = GripState(True, grip, carried + noise[3], 0.04, grip)
            wrench = WrenchStamped((0.0, 0.0, -carried + noise[3]), (0.0, 0.0, 0.0))
            named = {
                "wrist/wrench": wrench, "plan/share": Scalar(self.agreed(t)), "load/odometry": load,
                "gripper/state": state,
            }  # fmt: skip
            out += [Sample(stamp, f"{robot}/{name}", value, k) for name, value in named.items()]
        return out
