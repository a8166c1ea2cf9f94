"""The navigation detector: keeps base, limbs, plan and people, and asks for the verdicts on each human."""

from __future__ import annotations

from collections.abc import Sequence
from typing import cast

from foreshock.detector import Inputs
from foreshock.messages import Humans, Odometry, PlannedPath
from foreshock.records import Indication, Sample, SampleRef
from foreshock_detectors._stamped import fresh
from foreshock_detectors.navigation._config import NavigationConfig
from foreshock_detectors.navigation._motion import Mover, place
from foreshock_detectors.navigation._person import Person

__all__ = ["NavigationDetector"]

KINDS = (
    ("path-convergence", 1.0, "1"),
    ("path-overlap", 0.0, "s"),
    ("high-approach-speed", 0.0, "m/s"),
    ("narrow-shared-space", 0.0, "m"),
)


class NavigationDetector:
    """Implements foreshock.detector.Detector.

    Somebody who is out of sight is predicted on for a while: who walked behind a rack is still there. While somebody's
    velocity is not known yet, the kinds that rest on it are left out, except where another's is present, so that they
    count as unobserved.
    """

    def __init__(self, config: NavigationConfig) -> None:
        self._config = config
        self._coast_ns, self._departed_ns = round(config.coast_s * 1e9), round(config.departed_s * 1e9)
        self.reset(0)

    def reset(self, seed: int) -> None:  # noqa: ARG002  # nothing here is random
        """Forget everything."""
        config = self._config
        self._base = Mover(config.velocity_time_s)
        self._limbs = {name: Mover(config.velocity_time_s) for name in config.limbs}
        self._people: dict[str, Person] = {}
        self._left: dict[str, int] = {}
        self._humans_ns = self._path_ns = -1

    def update(self, now_ns: int, inputs: Inputs) -> Sequence[Indication]:
        """Four indications per human whose velocity is known; about ``""`` while nobody is there."""
        latest = inputs.latest
        own, people, path = latest.get("odometry"), latest.get("humans"), latest.get("path")
        if own is None or people is None or path is None:
            return ()
        for name, mover in (("odometry", self._base), *self._limbs.items()):
            for sample in fresh(inputs, name):
                mover.push(sample.stamp_ns, *_split(cast(Odometry, sample.value)))
            if mover.stamp_ns < 0:
                return ()
        plan = cast(PlannedPath, path.value)
        if not plan.x or not len(plan.x) == len(plan.y) == len(plan.time_from_start):
            raise ValueError("plan/path: x, y and time_from_start must have one length, at least 1")
        news = path.stamp_ns != self._path_ns
        self._path_ns = path.stamp_ns
        for sample in fresh(inputs, "humans"):
            news = self._take(sample) or news
        self._depart(now_ns)
        refs = (SampleRef(own.channel, own.stamp_ns), SampleRef(path.channel, path.stamp_ns))
        said: list[Indication] = []
        for name in sorted(self._people):
            person = self._people[name]
            if news:
                person.foresee(plan, path.stamp_ns, now_ns)
            said += person.judge(self._base, self._limbs, refs, now_ns)
        absent = sorted(self._left)
        if not self._people and not absent:
            absent = [""]
        stamp = max(own.stamp_ns, people.stamp_ns)
        seen = (SampleRef(people.channel, people.stamp_ns),)
        for name in absent:
            said += [Indication(kind, name, stamp, False, 0.0, limit, unit, 0.0, seen) for kind, limit, unit in KINDS]
        if not all(person.mover.known() for person in self._people.values()):
            said = [i for i in said if i.present or i.kind == "narrow-shared-space"]
        return said

    def _take(self, sample: Sample) -> bool:
        """People as seen; whether the message is newer than the last."""
        if sample.stamp_ns <= self._humans_ns:
            return False
        self._humans_ns = sample.stamp_ns
        ref = SampleRef(sample.channel, sample.stamp_ns)
        names = set()
        for pose in cast(Humans, sample.value).humans:
            if pose.id in names:
                raise ValueError(f"humans/pose: two humans have the id {pose.id!r}")
            names.add(pose.id)
            self._left.pop(pose.id, None)
            if pose.id not in self._people:
                self._people[pose.id] = Person(pose.id, self._config)
            self._people[pose.id].take(pose, ref)
        return True

    def _depart(self, now_ns: int) -> None:
        """Those who have been out of sight for too long have left."""
        for name, person in list(self._people.items()):
            if self._humans_ns - person.ref.stamp_ns > self._coast_ns:
                del self._people[name]
                self._left[name] = now_ns
        if self._left:
            self._left = {name: at for name, at in self._left.items() if now_ns - at <= self._departed_ns}


def _split(message: Odometry) -> tuple[float, float, tuple[float, float]]:
    x, y, vx, vy = place(message)
    return x, y, (vx, vy)
