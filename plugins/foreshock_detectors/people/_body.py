"""What the pose of one human says: how fast a hand goes towards the workspace, how far the head has come down."""

from __future__ import annotations

import math
from collections import deque

from foreshock.messages import Capsule, HumanPose, Vec3
from foreshock_detectors._sequential import Hysteresis
from foreshock_detectors.people._config import PeopleConfig

__all__ = ["Body"]

LEAST_RELEASE = 0.75
"""A reach-in is over below this share of its threshold."""

LEAST_SPAN = 0.6
"""A slope needs samples over at least this share of its window: fewer would be all noise."""


class Body:
    """Follows one human pose by pose.

    Attributes:
        stamp_ns: of the last pose.
        head: middle of the head, or of all capsules if no head is tracked (m).
        distance_m: horizontal, trunk to the workspace's centre.
        hand_m_s: speed of the faster hand towards the workspace, 0 beyond reach.
        hands_judged: whether that speed is known of every hand that is tracked, of one at least.
        lowered_m: head below its standing height.
        reaching: verdict.
        lowered: verdict.
    """

    def __init__(self, config: PeopleConfig) -> None:
        self._config = config
        hold_ns = round(config.hold_s * 1e9)
        self._reach = Hysteresis(config.reach_m_s, LEAST_RELEASE * config.reach_m_s, hold_ns)
        self._lower = Hysteresis(config.lowering_m, config.lowering_release_m, hold_ns, round(config.lowering_s * 1e9))
        self._hands: list[tuple[Vec3, deque[tuple[float, float]]]] = []
        self._window_s = config.reach_window_s + 1e-6
        self._stature_m = math.nan
        self._before_m = self._last_m = math.nan
        self.stamp_ns = -1
        self.head: Vec3 = (0.0, 0.0, 0.0)
        self.distance_m, self.hand_m_s, self.lowered_m = math.inf, 0.0, 0.0
        self.reaching = self.lowered = self.hands_judged = False

    def push(self, stamp_ns: int, pose: HumanPose, centre: Vec3) -> None:
        """The next pose; centre of the workspace in the pose's frame."""
        dt_s = (stamp_ns - self.stamp_ns) * 1e-9 if self.stamp_ns >= 0 else 0.0
        self.stamp_ns = stamp_ns
        if dt_s > self._config.dropout_s:
            self._hands = []
        heads = [c for c in pose.capsules if c.region == "face"] or list(pose.capsules)
        hands = [c for c in pose.capsules if c.region == "hand"]
        self.head = _middle(heads)
        self.distance_m = math.hypot(self.head[0] - centre[0], self.head[1] - centre[1])
        self.hand_m_s = self._hand_speed(stamp_ns * 1e-9, hands, centre)
        self.reaching = self._reach.push(self.hand_m_s, stamp_ns)
        self.lowered_m = self._lowering(max(max(c.a[2], c.b[2]) for c in heads), dt_s)
        self.lowered = self._lower.push(self.lowered_m, stamp_ns)

    def _hand_speed(self, t_s: float, hands: list[Capsule], centre: Vec3) -> float:
        """Least squares slope of the distance to the workspace, the fastest hand within reach of it.

        A hand is the nearest of those before. Where another number of hands is tracked, nobody knows which one is new,
        and all slopes begin anew.
        """
        config, fastest = self._config, 0.0
        self._hands = _followed(self._hands, [_middle([hand]) for hand in hands])
        self.hands_judged = bool(hands)
        for place, track in self._hands:
            track.append((t_s, math.dist(place, centre)))
            while track[0][0] < t_s - self._window_s:
                track.popleft()
            if len(track) < 3 or t_s - track[0][0] < LEAST_SPAN * config.reach_window_s:
                self.hands_judged = False
            elif track[-1][1] - config.workspace_radius_m <= config.reach_within_m:
                speed = -_slope(track)
                if speed > fastest:
                    fastest = speed
        return fastest

    def _lowering(self, top_m: float, dt_s: float) -> float:
        """Head below standing height: an upper envelope of the median of three heights, which forgets slowly."""
        a, b = self._before_m, self._last_m
        self._before_m, self._last_m = b, top_m
        if a != a:
            if self._stature_m != self._stature_m or top_m > self._stature_m:
                self._stature_m = top_m
            return self._stature_m - top_m
        middle = sorted((a, b, top_m))[1]
        if middle > self._stature_m:
            self._stature_m += (middle - self._stature_m) * min(1.0, dt_s)  # 1 s: noise alone does not lift it
        else:
            self._stature_m += (middle - self._stature_m) * min(1.0, dt_s / self._config.stature_time_s)
        return self._stature_m - middle


def _followed(
    before: list[tuple[Vec3, deque[tuple[float, float]]]], places: list[Vec3]
) -> list[tuple[Vec3, deque[tuple[float, float]]]]:
    """Each place with the track of the hand that was nearest, nearest pair first; new tracks if the numbers differ."""
    if len(before) != len(places):
        return [(place, deque()) for place in places]
    old, new = list(before), list(places)
    found = []
    while new:
        _, i, k = min([(math.dist(place, old[k][0]), i, k) for i, place in enumerate(new) for k in range(len(old))])
        found.append((new.pop(i), old.pop(k)[1]))
    return found


def _middle(capsules: list[Capsule]) -> Vec3:
    n = 2.0 * len(capsules)
    ends = [end for c in capsules for end in (c.a, c.b)]
    return (sum([e[0] for e in ends]) / n, sum([e[1] for e in ends]) / n, sum([e[2] for e in ends]) / n)


def _slope(track: deque[tuple[float, float]]) -> float:
    """Least squares slope of (t, x) pairs."""
    t0, n = track[0][0], len(track)
    st = sx = stt = stx = 0.0
    for t, x in track:
        u = t - t0
        st += u
        sx += x
        stt += u * u
        stx += u * x
    return (n * stx - st * sx) / (n * stt - st * st)
