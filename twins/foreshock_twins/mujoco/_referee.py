"""Which accidents have happened, by contact: the ids of the FMU plants, so that results can be set side by side."""

from __future__ import annotations

import math
from collections.abc import Sequence

import msgspec

from foreshock.twin import TwinEvent
from foreshock_twins.mujoco._contact import REGIONS, Touch

__all__ = ["Referee"]

_TILT = 0.5
"""rad of the torso off the vertical; beyond, balance is lost."""
_SUNK = 0.8
"""Share of the centre of mass's height; below, balance is lost."""
_BEYOND_M = 0.15
"""Capture point outside the rectangle about both soles; farther out no ankle and no hip brings it back."""
_TOUCH_N = 1.0
_TRANSIENT_S = 0.5
"""ISO/TS 15066: a longer contact is quasi-static."""


class Referee:
    """Sees the truth, and keeps one event per id with the worst value so far.

    Attributes:
        lost: balance is lost.
        fallen: the robot's body is on the floor.
        force: on the human now, the largest (N).
        peak: the largest so far (N).
        floor_peak: largest force of the floor on anything but the soles so far (N).

    Args:
        com_height_m: nominal.
        legs: MuJoCo's ids of the bodies of both legs.
    """

    def __init__(self, com_height_m: float, legs: frozenset[int]) -> None:
        self._height, self._legs = com_height_m, legs
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self._events: dict[str, TwinEvent] = {}
        self.lost = self.fallen = False
        self.force = self.peak = self.floor_peak = 0.0
        self._since: dict[tuple[str, bool], int] = {}
        self._held_since: dict[str, int] = {}

    def events(self) -> Sequence[TwinEvent]:
        """All so far, by time."""
        return sorted(self._events.values(), key=lambda e: (e.stamp_ns, e.id))

    def balance(self, now_ns: int, tilt: float, com_z: float, beyond: float) -> None:
        """Judge the posture.

        Args:
            now_ns: when.
            tilt: the torso's angle to the vertical (rad).
            com_z: height of the centre of mass (m).
            beyond: how far the capture point is outside the rectangle about both soles (m).
        """
        if beyond > _BEYOND_M:
            self.lost = True
            self._note(now_ns, "balance-lost", "", beyond, _BEYOND_M, "m")
        elif tilt > _TILT or com_z < _SUNK * self._height:
            self.lost = True
            self._note(now_ns, "balance-lost", "", tilt, _TILT, "rad")

    def floor(self, now_ns: int, force: float) -> None:
        """Judge the force (N) of the floor on all but the soles."""
        if force > _TOUCH_N:
            self.fallen = self.lost = True
            self.floor_peak = max(self.floor_peak, force)
            self._note(now_ns, "fall", "", force, _TOUCH_N, "N")

    def touches(self, now_ns: int, found: Sequence[Touch]) -> None:
        """Judge the contacts with the human at one step."""
        strong = [t for t in found if t.force > _TOUCH_N]
        if not (strong or self._since):
            self.force = 0.0
            return
        self.force = max((t.force for t in strong), default=0.0)
        self.peak = max(self.peak, self.force)
        kinds = {(t.region, t.body in self._legs) for t in strong}
        self._since = {kind: self._since.get(kind, now_ns) for kind in kinds}
        held = {t.region for t in strong if t.body in self._legs and t.force > REGIONS[t.region].limit}
        self._held_since = {region: self._held_since.get(region, now_ns) for region in held}
        for since in self._held_since.values():
            held_s = (now_ns - since) * 1e-9
            if held_s > _TRANSIENT_S and not self.lost:
                self._note(now_ns, "leg-held", "A3", held_s, _TRANSIENT_S, "s")
        for touch in strong:
            self._touch(now_ns, touch)

    def _touch(self, now_ns: int, touch: Touch) -> None:
        region, by_leg = REGIONS[touch.region], touch.body in self._legs
        self._note(now_ns, "touch", "", touch.force, _TOUCH_N, "N")
        short = (now_ns - self._since[touch.region, by_leg]) * 1e-9 <= _TRANSIENT_S
        transient = region.limit * region.transient
        limit = transient if short else region.limit
        if self.lost:
            self._note(now_ns, "fall-onto-human", "A1", touch.force, transient, "N")
        elif by_leg:
            if touch.force > transient:
                self._note(now_ns, "leg-swing-contact", "A3", touch.force, transient, "N")
        elif touch.force > limit:
            self._note(now_ns, "arm-strike", "A2", touch.force / limit, 1.0, "1")

    def _note(self, now_ns: int, id_: str, mode: str, value: float, limit: float, unit: str) -> None:
        known = self._events.get(id_)
        if known is None:
            self._events[id_] = TwinEvent(now_ns, id_, mode, value, limit, unit)
        elif not math.isnan(value) and value / limit > known.value / known.limit:
            self._events[id_] = msgspec.structs.replace(known, value=value, limit=limit, unit=unit)
