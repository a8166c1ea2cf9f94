"""One human and the verdicts on him."""

from __future__ import annotations

import math
from collections.abc import Mapping

from foreshock.messages import HumanPose, PlannedPath
from foreshock.records import Indication, SampleRef
from foreshock_detectors._sequential import Hysteresis, severity
from foreshock_detectors.navigation._approach import Approach
from foreshock_detectors.navigation._config import NavigationConfig
from foreshock_detectors.navigation._convergence import Convergence
from foreshock_detectors.navigation._encounter import encounter
from foreshock_detectors.navigation._motion import Disc, Mover, discs
from foreshock_detectors.navigation._overlap import least_gap_s
from foreshock_detectors.navigation._space import path_clearance_m, path_extent_m, wall_gap_m

__all__ = ["Person"]


class Person:
    """Follows one track.

    Where he is, is known with his first sample, and so is how he moves if the tracker reports it. If it does not, his
    velocity takes two time constants of its filter (0.4 s by default), and what rests on it is not judged before. That
    is longer than trust.grace_s (0.3 s by default): somebody new brings the minimal risk condition, which an operator
    has to reset. To avoid it, report HumanPose.velocity, or allow a longer grace time.

    Attributes:
        id: of the track.
        ref: his newest sample.
    """

    def __init__(self, name: str, config: NavigationConfig) -> None:
        self.id, self._config = name, config
        self.mover = Mover(config.velocity_time_s)
        self._discs: tuple[Disc, ...] = ()
        self._radius = 0.0
        hold = round(config.hold_s * 1e9)
        self._convergence, self._approach = Convergence(config), Approach(config)
        self._overlap = Hysteresis(0.0, -0.3 * config.gap_s, hold, round(config.overlap_dwell_s * 1e9))
        self._narrow = Hysteresis(0.0, -0.1 * config.free_least_m, hold, round(0.1e9))
        self._gap_s, self._path_m = math.inf, math.inf
        self.ref = SampleRef("", -1)

    def take(self, pose: HumanPose, ref: SampleRef) -> None:
        """A newer measurement of him."""
        x, y, self._radius, self._discs = discs(pose, self._config.regions)
        v = pose.velocity
        sure = self._config.uncertainty_m
        weight = 1.0 if pose.uncertainty <= sure else (sure / pose.uncertainty) ** 2
        self.mover.push(ref.stamp_ns, x, y, None if v is None else (v[0], v[1]), weight)
        self.ref = ref

    def foresee(self, path: PlannedPath, path_ns: int, now_ns: int) -> None:
        """Judge his predicted path against the robot's; as often as either is new."""
        config, mover = self._config, self.mover
        x, y = mover.at(now_ns)
        age_s = (now_ns - path_ns) * 1e-9
        moving = path_extent_m(path, config.horizon_s) > 0.05
        if not moving:
            self._gap_s = self._path_m = math.inf
            return
        walks = math.hypot(mover.vx, mover.vy) >= config.walks_m_s
        vx, vy = (mover.vx, mover.vy) if walks else (0.0, 0.0)
        radius = config.robot_radius_m
        self._gap_s = least_gap_s(
            path, age_s, x, y, vx, vy, self._discs, radius + config.overlap_margin_m, config.horizon_s
        )
        self._path_m = path_clearance_m(path, age_s, x, y, self._discs, radius, config.lookahead_s)

    def judge(
        self, base: Mover, limbs: Mapping[str, Mover], refs: tuple[SampleRef, ...], now_ns: int
    ) -> tuple[Indication, ...]:
        """The indications now: narrow-shared-space, and the other three once his velocity is known."""
        config, mover = self._config, self.mover
        (x, y), (rx, ry) = mover.at(now_ns), base.at(now_ns)
        meeting = encounter(
            x - rx, y - ry, mover.vx - base.vx, mover.vy - base.vy, self._radius + config.robot_radius_m
        )  # fmt: skip
        gap_m, free_m = self._room(x, y, rx, ry, limbs, now_ns)
        lack_m = max(config.free_least_m - gap_m, config.walled_least_m - free_m)
        narrow = self._narrow.push(max(lack_m, -10.0), now_ns)
        stamp, evidence = max(r.stamp_ns for r in (self.ref, *refs)), (self.ref, *refs)
        full = config.free_least_m
        room = Indication(
            "narrow-shared-space", self.id, stamp, narrow, max(lack_m, -10.0), 0.0, "m",
            severity(lack_m, 0.0, full) if narrow else 0.0, evidence,
        )  # fmt: skip
        if not mover.known():
            return (room,)
        c, a = self._convergence, self._approach
        c.push(meeting, now_ns)
        a.push(meeting, now_ns)
        gap_s, least = min(self._gap_s, 10.0), config.gap_s
        overlapping = self._overlap.push(least - gap_s, now_ns)
        measures = {
            "miss_m": meeting.miss_m, "time_s": meeting.time_s, "gap_m": meeting.gap_m,
            "closing_m_s": meeting.closing_m_s,
        }  # fmt: skip
        return (
            Indication(
                "path-convergence", self.id, stamp, c.present, c.statistic, 1.0, "1",
                severity(c.statistic, 0.5, 1.5) if c.present else 0.0, evidence, None, measures,
            ),
            Indication(
                "path-overlap", self.id, stamp, overlapping, gap_s, least, "s",
                severity(-gap_s, -least, 0.0) if overlapping else 0.0, evidence,
            ),
            Indication(
                "high-approach-speed", self.id, stamp, a.present, a.speed_m_s, a.allowed_m_s, "m/s",
                severity(a.speed_m_s, a.allowed_m_s, 2.0 * a.allowed_m_s) if a.present else 0.0, evidence,
            ),
            room,
        )  # fmt: skip

    def _room(
        self, x: float, y: float, rx: float, ry: float, limbs: Mapping[str, Mover], now_ns: int
    ) -> tuple[float, float]:
        """Free width towards the robot on its way (m), and that together with the one towards a wall behind him."""
        config = self._config
        gap_m = self._path_m
        if math.isinf(gap_m):
            return gap_m, gap_m
        for name, limb in limbs.items():
            lx, ly = limb.at(now_ns)
            for ox, oy, r in self._discs:
                gap_m = min(gap_m, math.hypot(x + ox - lx, y + oy - ly) - r - config.limbs[name])
        wall_m = wall_gap_m(config.walls, rx, ry, x, y, self._radius) if config.walls else math.inf
        return gap_m, gap_m + max(0.0, wall_m)
