"""The people detector: keeps the tracks, and says of each human what is present."""

from __future__ import annotations

import math
from collections.abc import Sequence

from foreshock.detector import Inputs
from foreshock.messages import Gaze, Humans, Odometry, Vec3
from foreshock.records import Indication, Sample, SampleRef
from foreshock_detectors._sequential import severity
from foreshock_detectors.people._attention import Attention
from foreshock_detectors.people._body import Body
from foreshock_detectors.people._config import PeopleConfig

__all__ = ["PeopleDetector"]

REACH_FULL, LOWER_FULL_M = 2.0, 0.8
"""Severity 1: a hand at twice the threshold (4 m/s, a fast punch); a head as low as that of one who kneels."""

DEPARTED_NS = 2_000_000_000
"""Somebody who has left is reported absent for so long: longer than the window of evidence."""


class PeopleDetector:
    """Implements foreshock.detector.Detector.

    Kinds of the gaze are said of configured humans only; a human in the shared space whose gaze is not measured leaves
    them out, except where another's is present, so that they count as unobserved. So does a human there of whom no hand
    is tracked, or one whose speed is not known yet (60 ms with the default window), with rapid-reach-in.
    """

    def __init__(self, config: PeopleConfig) -> None:
        self._config = config
        self.reset(0)

    def reset(self, seed: int) -> None:  # noqa: ARG002  # nothing here is random
        """Forget everything."""
        self._stamp_ns = -1
        self._channel = ""
        self._bodies: dict[str, Body] = {}
        self._left: dict[str, int] = {}
        self._attention = {human: Attention(self._config) for human in self._config.humans}

    def update(self, now_ns: int, inputs: Inputs) -> Sequence[Indication]:  # noqa: ARG002  # time is the samples' own
        """Four indications per human; one each without a subject while nobody is there."""
        centre = self._centre(inputs)
        poses = inputs.new.get("humans", ())
        if self._stamp_ns < 0 and not poses and "humans" in inputs.latest:
            poses = (inputs.latest["humans"],)  # it came before all inputs were there
        for sample in poses:
            if isinstance(sample.value, Humans) and sample.stamp_ns > self._stamp_ns:
                self._take(sample, sample.value, centre)
        if self._stamp_ns < 0:
            return ()
        found: list[Indication] = []
        for human, body in self._bodies.items():
            found += self._posture(human, body)
        configured = self._attention.keys()
        missing = any(
            body.distance_m <= self._config.shared_m for human, body in self._bodies.items() if human not in configured
        )
        for name, human in self._config.gazes:
            tracked = self._bodies.get(human)
            if tracked is None:
                continue
            attention = self._attention[human]
            if tracked.distance_m > self._config.shared_m:
                attention.outside()
            else:
                latest = inputs.latest.get(name)
                for sample in inputs.new.get(name) or ((latest,) if latest is not None else ()):
                    if isinstance(sample.value, Gaze):
                        attention.push(sample.stamp_ns, sample.value, tracked.head, centre)
                blind_ns = round(self._config.dropout_s * 1e9)
                if latest is None or attention.stamp_ns < 0 or latest.stamp_ns - attention.stamp_ns > blind_ns:
                    missing = True
                    continue
            found += self._gaze(human, tracked, attention, inputs.latest.get(name))
        for human in self._left:
            found += self._absent(human)
        if not self._bodies and not self._left:
            found += self._absent("")
        elif not any(human in self._bodies or human in self._left for human in self._config.humans):
            found += self._absent("")[2:]
        silent = {"gaze-diversion", "human-inattentiveness"} if missing else set()
        if any(b.distance_m <= self._config.shared_m and not b.hands_judged for b in self._bodies.values()):
            silent.add("rapid-reach-in")
        return [i for i in found if i.present or i.kind not in silent] if silent else found

    def _centre(self, inputs: Inputs) -> Vec3:
        """Of the workspace, in odom: turned about the vertical with the base where it moves with it."""
        c = self._config.workspace_m
        sample = inputs.latest.get("base")
        if sample is None or not isinstance(sample.value, Odometry):
            return c
        p, (x, y, z, w) = sample.value.position, sample.value.orientation
        yaw = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
        cos, sin = math.cos(yaw), math.sin(yaw)
        return (p[0] + cos * c[0] - sin * c[1], p[1] + sin * c[0] + cos * c[1], p[2] + c[2])

    def _take(self, sample: Sample, message: Humans, centre: Vec3) -> None:
        """The tracker's next message."""
        stamp_ns = self._stamp_ns = sample.stamp_ns
        self._channel = sample.channel
        for pose in message.humans:
            if pose.capsules:
                body = self._bodies.get(pose.id)
                if body is None:
                    body = self._bodies[pose.id] = Body(self._config)
                    self._left.pop(pose.id, None)
                body.push(stamp_ns, pose, centre)
        dropout_ns = round(self._config.dropout_s * 1e9)
        for human in [h for h, body in self._bodies.items() if stamp_ns - body.stamp_ns > dropout_ns]:
            del self._bodies[human]
            self._left[human] = stamp_ns
            if human in self._attention:
                self._attention[human] = Attention(self._config)
        if self._left:
            self._left = {h: t for h, t in self._left.items() if stamp_ns - t <= DEPARTED_NS}

    def _posture(self, human: str, body: Body) -> tuple[Indication, Indication]:
        """Reach-in and lowering."""
        config, stamp = self._config, body.stamp_ns
        seen = (SampleRef(self._channel, stamp),)
        fast, low = config.reach_m_s, config.lowering_m
        return (
            Indication(
                "rapid-reach-in", human, stamp, body.reaching, body.hand_m_s, fast, "m/s",
                severity(body.hand_m_s, fast, REACH_FULL * fast) if body.reaching else 0.0, seen,
            ),
            Indication(
                "posture-lowering", human, stamp, body.lowered, body.lowered_m, low, "m",
                severity(body.lowered_m, low, low + LOWER_FULL_M) if body.lowered else 0.0, seen,
            ),
        )  # fmt: skip

    def _gaze(
        self, human: str, body: Body, attention: Attention, latest: Sample | None
    ) -> tuple[Indication, Indication]:
        """Diversion and inattentiveness."""
        config = self._config
        stamp = attention.stamp_ns if attention.stamp_ns >= 0 else body.stamp_ns
        seen = [SampleRef(self._channel, body.stamp_ns)]
        if latest is not None and attention.stamp_ns >= 0:
            seen.append(SampleRef(latest.channel, attention.stamp_ns))
        limit, share = config.look_limit_rad, config.inattentive_share
        return (
            Indication(
                "gaze-diversion", human, stamp, attention.diverted, attention.angle_rad, limit, "rad",
                severity(attention.angle_rad, limit, math.pi) if attention.diverted else 0.0, tuple(seen),
            ),
            Indication(
                "human-inattentiveness", human, stamp, attention.inattentive, attention.share, share, "1",
                severity(attention.share, share, 1.0 + 1e-9) if attention.inattentive else 0.0, tuple(seen),
            ),
        )  # fmt: skip

    def _absent(self, human: str) -> list[Indication]:
        """Nobody, or somebody who has left."""
        config, seen = self._config, (SampleRef(self._channel, self._stamp_ns),)
        limits = (
            ("rapid-reach-in", config.reach_m_s, "m/s"),
            ("posture-lowering", config.lowering_m, "m"),
            ("gaze-diversion", config.look_limit_rad, "rad"),
            ("human-inattentiveness", config.inattentive_share, "1"),
        )
        return [Indication(k, human, self._stamp_ns, False, 0.0, limit, unit, 0.0, seen) for k, limit, unit in limits]
