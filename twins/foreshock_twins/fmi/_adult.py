"""A standing adult of 1.75 m as 14 capsules, one body region of ISO/TS 15066 Annex A each.

Heights and lengths are fractions of the stature H after Drillis and Contini, Body Segment Parameters, 1966, as
printed in Winter, Biomechanics and Motor Control of Human Movement, fig. 4.1: ankle 0.039, knee 0.285, hip 0.530,
fingertip 0.377, wrist 0.485, elbow 0.630, shoulder 0.818 H above the floor; half-breadth of the shoulders 0.129 H, of
the hips 0.0955 H. They give no girths: radii are circumference / (2 pi) of the limbs, and half the larger of breadth
and depth of trunk and head, rounded from male means of the 2012 Anthropometric Survey of U.S. Army Personnel (Gordon
et al., NATICK/TR-15/007), whose mean stature is 1.756 m. The template stands in for perception; it is no one person.

The head is one capsule and counts as face, the region of it that withstands least (65 N); it reaches down over the
neck. Arms hang at the sides. Frame: origin on the floor between the feet, x forward, y left, z up.
"""

from __future__ import annotations

import math

from foreshock.messages import Capsule, Vec3

__all__ = ["STANDING_ADULT", "STATURE_M", "placed"]

STATURE_M = 1.75

_ANKLE, _KNEE, _HIP, _FINGERTIP, _WRIST = 0.039, 0.285, 0.530, 0.377, 0.485
_ELBOW, _SHOULDER = 0.630, 0.818
_SHOULDER_HALF, _HIP_HALF = 0.129, 0.0955
_HEAD_R, _CHEST_R, _ABDOMEN_R, _PELVIS_R = 0.100, 0.150, 0.165, 0.175
_UPPER_ARM_R, _FOREARM_R, _HAND_R, _THIGH_R, _LOWER_LEG_R = 0.057, 0.050, 0.045, 0.100, 0.063


def _column(region: str, y_m: float, low_m: float, high_m: float, radius_m: float) -> Capsule:
    """A vertical capsule whose surface reaches from low to high; a ball of the given radius if they are too close."""
    a, b = low_m + radius_m, high_m - radius_m
    if a > b:
        a = b = (a + b) / 2.0
    return Capsule(region, (0.0, y_m, a), (0.0, y_m, b), radius_m)


def _limb(region: str, y_m: float, low_m: float, high_m: float, radius_m: float) -> Capsule:
    """A vertical capsule whose axis reaches from joint to joint."""
    return Capsule(region, (0.0, y_m, low_m), (0.0, y_m, high_m), radius_m)


def _standing(h: float) -> tuple[Capsule, ...]:
    trunk = (
        _column("face", 0.0, _SHOULDER * h, h, _HEAD_R),
        _column("chest", 0.0, _ELBOW * h, _SHOULDER * h, _CHEST_R),
        _column("abdomen", 0.0, _HIP * h, 0.72 * h, _ABDOMEN_R),
        _column("pelvis", 0.0, _WRIST * h, _ELBOW * h, _PELVIS_R),
    )
    limbs = []
    for side in (1.0, -1.0):
        arm_y, leg_y = side * _SHOULDER_HALF * h, side * _HIP_HALF * h
        # The shoulder half-breadth ends at the acromion; the arm's axis hangs from there, some 2 cm too far out.
        limbs += [
            _limb("upper-arm", arm_y, _ELBOW * h, _SHOULDER * h - _UPPER_ARM_R, _UPPER_ARM_R),
            _limb("forearm", arm_y, _WRIST * h, _ELBOW * h, _FOREARM_R),
            _limb("hand", arm_y, _FINGERTIP * h + _HAND_R, _WRIST * h, _HAND_R),
            _limb("thigh", leg_y, _KNEE * h, _HIP * h, _THIGH_R),
            _limb("lower-leg", leg_y, max(_ANKLE * h, _LOWER_LEG_R), _KNEE * h, _LOWER_LEG_R),
        ]
    return (*trunk, *limbs)


STANDING_ADULT: tuple[Capsule, ...] = _standing(STATURE_M)


def placed(
    x_m: float, y_m: float, z_m: float, yaw_rad: float, lowered_m: float = 0.0, hand: tuple[float, ...] = ()
) -> tuple[Capsule, ...]:
    """The standing adult with its feet at (x, y, z), facing yaw about the vertical (rad, from the x axis).

    Args:
        x_m: where the feet are.
        y_m: where the feet are.
        z_m: where the feet are.
        yaw_rad: where it faces.
        lowered_m: hips, trunk, head and arms are lower by this: a crouch. The knees stay where they are.
        hand: middle of the right hand, in the same frame as the feet; the arm is stretched from the shoulder to it.
            Empty: the arm hangs.
    """
    c, s = math.cos(yaw_rad), math.sin(yaw_rad)
    knee_m = _KNEE * STATURE_M

    def move(p: Vec3) -> Vec3:
        z = p[2] if p[2] <= knee_m else max(knee_m, p[2] - lowered_m)
        return (x_m + c * p[0] - s * p[1], y_m + s * p[0] + c * p[1], z_m + z)

    body = [Capsule(k.region, move(k.a), move(k.b), k.radius) for k in STANDING_ADULT]
    if hand:
        body[_RIGHT_ARM : _RIGHT_ARM + 3] = _stretched(body[_RIGHT_ARM].b, (hand[0], hand[1], hand[2]))
    return tuple(body)


_RIGHT_ARM = 9
"""Where upper arm, forearm and hand of the right side begin in the template."""


def _stretched(shoulder: Vec3, hand: Vec3) -> list[Capsule]:
    """Upper arm, forearm and hand on the line from the shoulder to the hand, in the template's proportions."""

    def at(share: float) -> Vec3:
        return (
            shoulder[0] + share * (hand[0] - shoulder[0]),
            shoulder[1] + share * (hand[1] - shoulder[1]),
            shoulder[2] + share * (hand[2] - shoulder[2]),
        )

    reach = _SHOULDER - 0.5 * (_FINGERTIP + _WRIST)
    elbow, wrist = (_SHOULDER - _ELBOW) / reach, (_SHOULDER - _WRIST) / reach
    return [
        Capsule("upper-arm", at(elbow), shoulder, _UPPER_ARM_R),
        Capsule("forearm", at(wrist), at(elbow), _FOREARM_R),
        Capsule("hand", hand, at(wrist), _HAND_R),
    ]
