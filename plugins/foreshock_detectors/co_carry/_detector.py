"""The co-carry detector: share, lag of the ends, lag of the grip."""

from __future__ import annotations

import math
from collections.abc import Sequence

from foreshock.detector import Inputs
from foreshock.messages import GripState, Odometry, Scalar, WrenchStamped
from foreshock.records import Indication, Sample, SampleRef
from foreshock_detectors._quaternion import unit
from foreshock_detectors._sequential import Hysteresis, severity
from foreshock_detectors.co_carry._config import CoCarryConfig
from foreshock_detectors.co_carry._lag import Lag
from foreshock_detectors.co_carry._share import Share

__all__ = ["CoCarryDetector"]

RELEASE = 0.8
"""A verdict is given up below this share of its threshold."""

Triple = tuple[float, float, float]


def _unit(v: Triple) -> Triple:
    length = math.hypot(*v)
    return (v[0] / length, v[1] / length, v[2] / length)


class CoCarryDetector:
    """Implements foreshock.detector.Detector. A kind whose channels are missing or have not settled is left out.

    So is phase-mismatch while the load's orientation is no rotation.
    """

    def __init__(self, config: CoCarryConfig) -> None:
        self._config = config
        self._down, self._axis = _unit(config.down), _unit(config.axis)
        self.reset(0)

    def reset(self, seed: int) -> None:  # noqa: ARG002  # nothing here is random
        """Forget everything."""
        c = self._config
        hold, confirm = round(c.hold_s * 1e9), round(c.confirm_s * 1e9)
        self._share, self._ends, self._grip = Share(c), Lag(c), Lag(c)
        self._uneven = Hysteresis(c.share_error, RELEASE * c.share_error, hold)
        self._mismatched = Hysteresis(c.phase_error_rad, RELEASE * c.phase_error_rad, hold, confirm)
        self._desynced = Hysteresis(c.desync_rad, RELEASE * c.desync_rad, hold, confirm)
        self._end_lag = self._grip_lag = 0.0
        self._turned = True

    def update(self, now_ns: int, inputs: Inputs) -> Sequence[Indication]:  # noqa: ARG002  # time is the samples' own
        """One indication per kind that can be judged."""
        latest, new = inputs.latest, inputs.new
        wrench, share, load, grip = (latest.get(name) for name in ("wrench", "share", "load", "grip"))
        found = []
        if share is not None and isinstance(share.value, Scalar):
            for sample in new.get("wrench", ()):
                self._weigh(sample, share.value.data)
            if wrench is not None and self._share.observed:
                found.append(self._shared(wrench, share))
        for sample in new.get("load", ()):
            self._swing(sample)
        if load is not None and self._turned and self._ends.observed:
            found.append(self._lagging("phase-mismatch", load, self._ends, self._mismatched, self._end_lag, "m_s"))
        for sample in new.get("grip", ()):
            self._squeeze(sample)
        if grip is not None and self._grip.observed:
            found.append(self._lagging("grip-desync", grip, self._grip, self._desynced, self._grip_lag, "n"))
        return found

    def _weigh(self, sample: Sample, agreed: float) -> None:
        if isinstance(sample.value, WrenchStamped):
            (fx, fy, fz), (dx, dy, dz) = sample.value.force, self._down
            self._share.push(sample.stamp_ns, fx * dx + fy * dy + fz * dz, agreed)
            self._uneven.push(abs(self._share.deviation), sample.stamp_ns)

    def _swing(self, sample: Sample) -> None:
        """Vertical velocities of both ends: that of the middle, and the cross product of turning and lever."""
        value = sample.value
        if not isinstance(value, Odometry):
            return
        orientation = unit(value.orientation)
        self._turned = orientation is not None
        if orientation is None:
            return
        x, y, z, w = orientation
        up = (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y))  # in the load's frame
        (vx, vy, vz), (rx, ry, rz), (ax, ay, az) = value.linear, value.angular, self._axis
        middle = up[0] * vx + up[1] * vy + up[2] * vz
        turning = up[0] * (ry * az - rz * ay) + up[1] * (rz * ax - rx * az) + up[2] * (rx * ay - ry * ax)
        turning *= self._config.half_length_m
        lag = self._ends
        lag.push(sample.stamp_ns, middle - turning, middle + turning)
        self._end_lag = self._judged(lag, self._config.least_swing_m_s)
        self._mismatched.push(self._end_lag, sample.stamp_ns)

    def _squeeze(self, sample: Sample) -> None:
        value = sample.value
        if not isinstance(value, GripState):
            return
        lag = self._grip
        held = value.grasping
        lag.push(sample.stamp_ns, value.tangential_force if held else 0.0, value.normal_force if held else 0.0)
        self._grip_lag = self._judged(lag, self._config.least_swing_n) if held else 0.0
        self._desynced.push(self._grip_lag, sample.stamp_ns)

    def _judged(self, lag: Lag, least: float) -> float:
        """|lag| (rad) where both swing and belong together, else 0: what is at rest is not out of step."""
        swings = lag.swing_a >= least and lag.swing_b >= least
        return abs(lag.angle_rad) if swings and lag.coherence >= self._config.least_coherence else 0.0

    def _shared(self, wrench: Sample, share: Sample) -> Indication:
        c, s, present = self._config, self._share, self._uneven.present
        off = abs(s.deviation)
        return Indication(
            "uneven-load-sharing", c.subject, wrench.stamp_ns, present, off, c.share_error, "1",
            severity(off, c.share_error, c.share_full) if present else 0.0,
            (SampleRef(wrench.channel, wrench.stamp_ns), SampleRef(share.channel, share.stamp_ns)), None,
            {"share": s.value, "deviation": s.deviation},
        )  # fmt: skip

    def _lagging(self, kind: str, sample: Sample, lag: Lag, verdict: Hysteresis, off: float, unit: str) -> Indication:
        present = verdict.present
        measures = {
            "lag_rad": lag.angle_rad,
            "coherence": lag.coherence,
            f"swing_a_{unit}": lag.swing_a,
            f"swing_b_{unit}": lag.swing_b,
        }
        return Indication(
            kind, self._config.subject, sample.stamp_ns, present, off, verdict.on, "rad",
            severity(off, verdict.on, math.pi) if present else 0.0,
            (SampleRef(sample.channel, sample.stamp_ns),), None, measures,
        )  # fmt: skip
