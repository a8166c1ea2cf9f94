"""One tracked thing: where it is, how sure the detector network is of it, what it is taken for."""

from __future__ import annotations

import math

from foreshock.messages import Detection
from foreshock_detectors._sequential import EventWindow, Hysteresis
from foreshock_detectors.vision._confidence import Confidence
from foreshock_detectors.vision._config import Box, VisionConfig

__all__ = ["Track"]

POSITION_GAIN, VELOCITY_GAIN = 0.5, 0.1
"""Of the alpha-beta filter: beta = alpha^2 / (2 - alpha) rounded down (Benedict and Bordner, 1962)."""

MEMORY_S = 10.0
"""So much time of another class overturns what a track has been taken for."""


class Track:
    """Follows one id, frame by frame.

    Attributes:
        id: of the tracker; it changes when the thing is found again under another.
        class_id: its class in the last frame.
        seen_ns: stamp of the last frame in which it was.
        visible: share of it that was visible, median of the last three frames.
        confidence: of the network that it is there.
        occlusion: the verdict on its visibility.
        covered: a tracked hand lies over it.
        flips: frames in which it was taken for the wrong sort of thing.
        switched: its changes of id.
    """

    __slots__ = (
        "_before", "_last", "_limb_s", "_since_ns", "_velocity", "at", "class_id", "confidence", "covered",
        "flips", "id", "occlusion", "seen_ns", "switched", "visible",
    )  # fmt: skip

    def __init__(self, found: Detection, stamp_ns: int, config: VisionConfig) -> None:
        self.id, self.class_id, self.at = found.id, found.class_id, found.center
        self._velocity = (0.0, 0.0, 0.0)
        self._since_ns = self.seen_ns = stamp_ns
        self.visible = self._before = self._last = found.visible
        self.covered = False
        self.confidence = Confidence(config, found.confidence)
        hold_ns = round(config.hold_s * 1e9)
        self.occlusion = Hysteresis(1.0 - config.visible_least, 1.0 - config.visible_release, hold_ns)
        self.flips, self.switched = EventWindow(round(config.flips_window_s * 1e9)), EventWindow(1_000_000_000)
        self._limb_s = 0.0
        self._classify(config, 1e-3, stamp_ns)

    def predicted(self, stamp_ns: int) -> tuple[float, float, float]:
        """Where it is, if it goes on as it did (m)."""
        dt = (stamp_ns - self.seen_ns) * 1e-9
        x, y, z = self.at
        vx, vy, vz = self._velocity
        return (x + vx * dt, y + vy * dt, z + vz * dt)

    def distance(self, found: Detection, stamp_ns: int) -> float:
        """From its predicted place to a detection (m)."""
        return math.dist(self.predicted(stamp_ns), found.center)

    def push(self, found: Detection, stamp_ns: int, config: VisionConfig) -> None:
        """Take what was seen of it in a newer frame."""
        dt = (stamp_ns - self.seen_ns) * 1e-9
        at = self.predicted(stamp_ns)
        rest = tuple(c - p for c, p in zip(found.center, at, strict=True))
        self.at = (at[0] + POSITION_GAIN * rest[0], at[1] + POSITION_GAIN * rest[1], at[2] + POSITION_GAIN * rest[2])
        g = VELOCITY_GAIN / dt
        vx, vy, vz = self._velocity
        self._velocity = (vx + g * rest[0], vy + g * rest[1], vz + g * rest[2])
        self.id, self.class_id, self.seen_ns = found.id, found.class_id, stamp_ns
        a, b, c = self._before, self._last, found.visible
        self._before, self._last = b, c
        if a > b:
            a, b = b, a
        self.visible = a if c < a else b if c > b else c
        self.confidence.push(found.confidence, dt)
        self._classify(config, dt, stamp_ns)

    def _classify(self, config: VisionConfig, dt: float, stamp_ns: int) -> None:
        """Weigh what it has been taken for; a frame against the weight is a flip."""
        if self.class_id in config.limb_classes:
            limb = 1.0
        elif self.class_id in config.tool_classes:
            limb = -1.0
        else:
            return
        if limb * self._limb_s < 0.0:
            self.flips.add(stamp_ns)
        weight = self._limb_s + limb * (dt if dt < 0.1 else 0.1)
        self._limb_s = MEMORY_S if weight > MEMORY_S else -MEMORY_S if weight < -MEMORY_S else weight

    def confirmed(self, config: VisionConfig) -> bool:
        """Whether it has been seen for long enough to be more than a ghost."""
        return (self.seen_ns - self._since_ns) * 1e-9 >= config.confirm_s

    def left(self, view: Box | None, margin_m: float, stamp_ns: int) -> bool:
        """Whether by stamp_ns it had gone, or was about to go, out of view."""
        if view is None:
            return False
        at = self.predicted(stamp_ns)
        return any(not (view[i] + margin_m < at[i] < view[i + 3] - margin_m) for i in range(2))

    def inside(self, box: Box | None) -> bool:
        """Whether it was last seen inside a box; anywhere without one."""
        return box is None or all(box[i] <= self.at[i] <= box[i + 3] for i in range(3))
