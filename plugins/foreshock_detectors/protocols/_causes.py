"""Which actions help against which first sign: A1 to A3, where what helps against one cause harms in another."""

from __future__ import annotations

from collections.abc import Mapping

import msgspec

__all__ = ["CAUSES", "Cause", "Causes"]

STEADY = ("step-suppression", "balance-lock")


class Cause(msgspec.Struct, frozen=True):
    """What is done when one of these kinds came first, and what when the accident is nearer than urgent_s."""

    kinds: tuple[str, ...]
    actions: tuple[str, ...]
    urgent: tuple[str, ...] = ()


class Causes(msgspec.Struct, frozen=True):
    """Of one accident mode.

    Attributes:
        causes: by first sign.
        predicted: actions where an accident is predicted before any precursor has come.
        after: actions while the level stands although all evidence has left the window.
        urgent_s: with less time than this left, a cause's urgent actions replace its others.
        mitigation: asked for as well while an accident is predicted; the arbiter takes it when nothing else helps.
    """

    causes: tuple[Cause, ...]
    predicted: tuple[str, ...]
    after: tuple[str, ...]
    urgent_s: float = 0.0
    mitigation: tuple[str, ...] = ()


CAUSES: Mapping[str, Causes] = {
    "A1": Causes(
        (
            # on a slippery floor, feedback and stiff legs push the feet away
            Cause(("foot-micro-slip",), ("step-suppression",)),
            Cause(("com-lateral-deviation", "sway-amplitude-increase"), STEADY),
            Cause(("torso-angular-spike",), (*STEADY, "compliance-tuning")),
        ),
        predicted=(*STEADY, "compliance-tuning"),
        after=("step-suppression",),
        mitigation=("impact-mitigation",),
    ),
    "A2": Causes(
        (
            Cause(
                ("excessive-arm-velocity", "rapid-torso-recovery"), ("soften-arms",), ("soften-arms", "withdraw-arm")
            ),
            Cause(("human-proximity-breach",), ("soften-arms", "withdraw-arm")),
        ),
        predicted=("soften-arms", "withdraw-arm"),
        after=("soften-arms",),
        urgent_s=1.0,
    ),
    "A3": Causes(
        (
            Cause(
                ("swing-leg-drift", "path-overlap", "narrow-shared-space"),
                ("shorten-step", "announce"),
                ("step-suppression", "announce"),
            ),
        ),
        predicted=("step-suppression", "announce"),
        after=("shorten-step", "announce"),
        urgent_s=1.0,
    ),
}
"""A1 by a map of subsets of the four protocols against the disturbances of the twin ``mujoco``, seeds from 50000."""
