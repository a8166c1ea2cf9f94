"""The proximity detector keeps the contract of the port, on a human who walks up to a standing TALOS and away again."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from foreshock.messages import Capsule, HumanPose, Humans, JointState, Odometry
from foreshock.records import Sample
from foreshock.testing import DetectorConformance
from foreshock_detectors.proximity import SPEC, ProximityConfig
from foreshock_detectors.proximity._robot import Robot

PERIOD_NS = 10_000_000
SPEED_M_S = 1.2


def at_m(t: float) -> float:
    """Place of the human ahead of the robot: walks up from 4.5 m to 0.9 m, stands, and goes back."""
    return 4.5 - SPEED_M_S * min(max(t - 1.0, 0.0), 3.0) + SPEED_M_S * max(t - 4.5, 0.0)


class TestProximity(DetectorConformance):
    spec = SPEC
    omits: ClassVar = {"narrowing-clearance": "the closing speed of a human who has just been found is not known"}

    def recording(self) -> Sequence[Sample]:
        """Joints and odometry at 100 Hz, people at 20 Hz; noise of 0.1 mm on the base, of 20 mm on the human."""
        rng, robot = np.random.default_rng(5), Robot(ProximityConfig())
        names, q = tuple(robot.model.names)[2:], robot.reference
        out = []
        for k in range(700):
            stamp_ns, t = PERIOD_NS * (k + 1), 0.01 * (k + 1)
            joints = q[7:] + 1e-4 * rng.standard_normal(len(names))
            state = JointState(names, tuple(joints.tolist()), (0.0,) * len(names))
            out.append(Sample(stamp_ns, "talos/joints/state", state, k))
            place = q[:3] + 1e-4 * rng.standard_normal(3)
            base = Odometry(tuple(place.tolist()), tuple(q[3:7].tolist()), (0.0,) * 3, (0.0,) * 3)
            out.append(Sample(stamp_ns, "talos/base/odometry", base, k))
            if k % 5 == 0:
                x, y, _ = (np.array((at_m(t), 0.1, 0.0)) + 0.02 * rng.standard_normal(3)).tolist()
                trunk = Capsule("chest", (x, y, 0.9), (x, y, 1.5), 0.18)
                out.append(Sample(stamp_ns, "talos/humans/pose", Humans((HumanPose("h1", (trunk,)),)), k // 5))
        return out
