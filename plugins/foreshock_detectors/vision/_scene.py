"""All tracks of one camera: which detection belongs to which, what has changed its id, what has vanished or left."""

from __future__ import annotations

import math

from foreshock.messages import Detection, Detections
from foreshock_detectors.vision._config import VisionConfig
from foreshock_detectors.vision._track import Track

__all__ = ["Scene"]

WALK_M_S = 1.6
"""Walking speed of ISO 13855: by so much an id may be off its predicted place per second in which it was not seen."""


class Scene:
    """Follows the tracks frame by frame.

    A detection belongs to the track of its id if it lies within the gate of where that is predicted, a gate that widens
    while the track is unseen: whoever steps out from behind a rack has changed course there. Another detection takes
    over the nearest track within the gate that has no detection of its own: the id has switched. What is left over
    begins a track.

    Attributes:
        tracks: those that are seen, or have vanished and are not given up.
        ready: a frame has been taken.
    """

    def __init__(self, config: VisionConfig) -> None:
        self._config = config
        self._lost_ns, self._forget_ns = round(config.lost_s * 1e9), round(config.forget_s * 1e9)
        self._switch_ns = round(config.switch_s * 1e9)
        self.tracks: list[Track] = []
        self.ready = False
        self.stamp_ns = -1

    def push(self, frame: Detections, stamp_ns: int) -> None:
        """Take a newer frame."""
        config = self._config
        self.ready, self.stamp_ns = True, stamp_ns
        found: dict[str, Detection] = {}
        for d in frame.detections:
            if not config.classes or d.class_id in config.classes:
                found.setdefault(d.id, d)
        unseen: list[Track] = []
        for track in self.tracks:
            own = found.get(track.id)
            gate = config.gate_m + WALK_M_S * 1e-9 * (stamp_ns - track.seen_ns)
            if own is not None and track.distance(own, stamp_ns) <= gate:
                del found[track.id]
                track.push(own, stamp_ns, config)
            else:
                unseen.append(track)
        for d in found.values():
            self._place(d, unseen, stamp_ns)
        self._drop(unseen, stamp_ns)
        self._cover(stamp_ns)

    def _place(self, found: Detection, unseen: list[Track], stamp_ns: int) -> None:
        """Give a detection of unknown id, or far from its track, to the track whose place it took, or to a new one."""
        config = self._config
        nearest, least = None, config.gate_m
        for track in unseen:
            distance = track.distance(found, stamp_ns)
            if distance <= least and stamp_ns - track.seen_ns <= self._switch_ns:
                nearest, least = track, distance
        if nearest is None:
            jumped = next((t for t in unseen if t.id == found.id), None)
            if jumped is not None:  # the same id at a place that it cannot have reached: nothing of its past is known
                unseen.remove(jumped)
                self.tracks.remove(jumped)
            self.tracks.append(Track(found, stamp_ns, config))
            return
        unseen.remove(nearest)
        if nearest.id != found.id and nearest.confirmed(config):
            nearest.switched.add(stamp_ns)
        nearest.push(found, stamp_ns, config)

    def _drop(self, unseen: list[Track], stamp_ns: int) -> None:
        """Give up tracks that left the view, were ghosts, or have been unseen for too long."""
        config = self._config
        for track in unseen:
            gone_ns = stamp_ns - track.seen_ns
            if gone_ns >= self._lost_ns and (
                gone_ns >= self._forget_ns
                or not track.confirmed(config)
                or track.left(config.view, config.view_margin_m, track.seen_ns + self._lost_ns)
            ):
                self.tracks.remove(track)

    def _cover(self, stamp_ns: int) -> None:
        """Mark what lies under a hand that is itself well seen."""
        config = self._config
        hands = [
            t
            for t in self.tracks
            if t.class_id in config.covering and t.seen_ns == stamp_ns and t.visible >= config.visible_least
        ]
        for track in self.tracks:
            track.covered = (
                bool(hands)
                and track.class_id not in config.covering
                and any(math.dist(hand.at, track.at) <= config.cover_m for hand in hands if hand is not track)
            )

    def visible(self, track: Track) -> float:
        """Visible share of a track now: 0 once it has vanished, 1 under a hand that covers it on purpose."""
        if track.covered:
            return 1.0
        return 0.0 if self.stamp_ns - track.seen_ns >= self._lost_ns else track.visible
