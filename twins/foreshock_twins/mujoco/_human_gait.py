"""Where feet and pelvis of a walking human are: a function of the way gone, in steps.

The cadence follows from the speed by the walk ratio, step length over steps a minute, 0.0065 m min (Sekiya and
Nagasaki, Gait & Posture 8, 1998), nearly the same for an adult at any speed. A foot is on the floor for 58% of a
stride, rolls from the heel to the toe, and does not slide. One step is one unit of phase; sides alternate.
Sagittal plane: x forward, z up, x = 0 where the human stood.
"""

from __future__ import annotations

import math

import numpy as np

__all__ = ["FIRST_PHASE", "Foot", "Gait", "smooth"]

WALK_RATIO_M_MIN = 0.0065
FIRST_PHASE = 0.35
"""Both feet stand side by side below the pelvis; the left one is on the ground and the right one steps next."""
_OVERLAP = 0.08
"""A contact lasts this much (steps) longer than a step, before and after: 58% of a stride is 1 + 2 x 0.08 steps."""
_STRIKE_RAD, _TOE_OFF_RAD = 0.30, -1.0
"""Pitch of the foot, toes up, where it lands and leaves, for a step of _LONG_STEP_M; less for a shorter one."""
_LONG_STEP_M = 0.75
_CLEARANCE_M = 0.03

Foot = tuple[float, float, float]
"""Ankle x, ankle z, pitch (rad, toes up)."""


def smooth(u: float) -> float:
    """From 0 to 1 with zero slope at both ends; u is clipped."""
    u = min(max(u, 0.0), 1.0)
    return u * u * (3.0 - 2.0 * u)


class Gait:
    """Feet and pelvis by phase.

    Args:
        speed_m_s: of the walk, above 0.
        hip_m: height of the hips over the floor, legs straight.
        ankle_m: height of the ankle.
        leg_m: hip to ankle at most; short of straight, so that the knee has a direction to bend to.
        heel_m: the middle of the foot's heel lies this far behind the ankle.
        toe_m: the middle of its tip lies this far ahead.
        foot_radius_m: half the height of the foot.
    """

    def __init__(
        self,
        speed_m_s: float,
        hip_m: float,
        ankle_m: float,
        leg_m: float,
        heel_m: float,
        toe_m: float,
        foot_radius_m: float,
    ) -> None:
        self.step_m = math.sqrt(60.0 * WALK_RATIO_M_MIN * speed_m_s)
        share = min(1.0, self.step_m / _LONG_STEP_M)
        self._strike, self._off = share * _STRIKE_RAD, share * _TOE_OFF_RAD
        self._ankle, self._heel, self._toe, self._radius = ankle_m, heel_m, toe_m, foot_radius_m
        self._standing = min(hip_m, ankle_m + leg_m)
        self._bob = 0.0
        self._bob = max(self._needed(phase, leg_m) for phase in np.arange(FIRST_PHASE, FIRST_PHASE + 4.0, 0.01))

    def _needed(self, phase: float, leg_m: float) -> float:
        """By how much the pelvis must go down at its lowest so that both legs reach their feet now."""
        x = self.pelvis(phase)[0]
        high = min(z + math.sqrt(leg_m**2 - (fx - x) ** 2) for fx, z, _ in (self.foot(0, phase), self.foot(1, phase)))
        part = self._lowered(phase)
        return (self._standing - high) / part if part > 0.05 else 0.0

    @staticmethod
    def _lowered(phase: float) -> float:
        """Share of the bob: lowest while both feet are on the ground, highest over the standing foot."""
        return smooth(2.0 * (phase - FIRST_PHASE)) * (0.8 + 0.2 * math.cos(2.0 * math.pi * phase))

    def pelvis(self, phase: float) -> tuple[float, float]:
        """Its x, and the height of the hips."""
        return (phase - FIRST_PHASE) * self.step_m, self._standing - self._bob * self._lowered(phase)

    def swing(self, phase: float) -> float:
        """How far the left leg is ahead, -1..1; the arms go the other way. It begins from 0."""
        return smooth(2.0 * (phase - FIRST_PHASE)) * math.cos(math.pi * (phase + 0.15))

    def foot(self, side: int, phase: float) -> Foot:
        """The left (0) or the right (1) foot."""
        k = side + 2.0 * math.floor((phase + _OVERLAP - side) / 2.0)
        gone = phase - k
        if gone <= 1.0 + _OVERLAP and k >= 0.0:
            share = (gone + _OVERLAP) / (1.0 + 2.0 * _OVERLAP)
            pitch = self._strike * (1.0 - smooth(share / 0.15)) + self._off * smooth((share - 0.5) / 0.5)
            if k == 0.0 and gone < 0.5:  # it has stood there before the walk began
                pitch = 0.0
            x, z = self._pivoted(k * self.step_m, pitch, 1.0 if pitch > 0.0 else 0.0)
            return x, z, pitch
        begin, first, off = 1.0 + _OVERLAP, k, self._off
        if k < 0.0:  # the first step of all, from where it stands
            begin, first, off = FIRST_PHASE - k, 0.0, 0.0
        u = (gone - begin) / (2.0 - _OVERLAP - begin)
        part = smooth(u)
        pitch = off + (self._strike - off) * part
        heel = smooth(pitch / self._strike + 0.5) if off else 1.0  # the toe is the lower end until the foot is level
        x, z = self._pivoted((first + (k + 2.0 - first) * part) * self.step_m, pitch, heel)
        return x, z + _CLEARANCE_M * math.sin(math.pi * u) ** 2, pitch

    def _pivoted(self, x: float, pitch: float, heel: float) -> tuple[float, float]:
        """The ankle of a foot that is turned about its toe (heel 0) or its heel (1); flat it would be at x."""
        c, s, up = math.cos(pitch), math.sin(pitch), self._ankle - self._radius
        toe = x + self._toe - c * self._toe - s * up, self._radius - s * self._toe + c * up
        back = x - self._heel + c * self._heel - s * up, self._radius + s * self._heel + c * up
        return toe[0] + heel * (back[0] - toe[0]), toe[1] + heel * (back[1] - toe[1])
