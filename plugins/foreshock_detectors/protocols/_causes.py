"""Which actions help against which first sign: A1 to A3, where what helps against one cause harms in another."""

from __future__ import annotations

from collections.abc import Mapping

import msgspec

__all__ = ["CAUSES", "Cause", "Causes"]

STEADY = ("step-suppression", "balance-lock", "compliance-tuning")
ARMS = ("soften-arms", "withdraw-arm")


class Cause(msgspec.Struct, frozen=True):
    """What is done when one of these kinds came first, and what suffices while the accident is farther than early_s."""

    kinds: tuple[str, ...]
    actions: tuple[str, ...]
    early: tuple[str, ...] = ()


class Causes(msgspec.Struct, frozen=True):
    """Of one accident mode.

    Attributes:
        causes: by first sign.
        predicted: actions where an accident is predicted before any precursor has come; none to wait for one.
        after: actions while the level stands although all evidence has left the window.
        early_s: with a predicted time of more than this, a cause's early actions are enough; no prediction is no time.
        mitigation: asked for as well while an accident is predicted; the arbiter takes it when nothing else helps.
    """

    causes: tuple[Cause, ...]
    predicted: tuple[str, ...]
    after: tuple[str, ...]
    early_s: float = 1.0
    mitigation: tuple[str, ...] = ()


CAUSES: Mapping[str, Causes] = {
    "A1": Causes(
        (
            # on a slippery floor, feedback and stiff legs push the feet away
            Cause(("foot-micro-slip",), ("step-suppression",)),
            Cause(("torso-angular-spike", "com-lateral-deviation", "sway-amplitude-increase"), STEADY),
        ),
        predicted=STEADY,
        after=("step-suppression",),
        mitigation=("impact-mitigation",),
    ),
    "A2": Causes(
        (
            Cause(("excessive-arm-velocity", "rapid-torso-recovery"), ARMS, early=("soften-arms",)),
            Cause(("human-proximity-breach",), ARMS),
        ),
        # whoever walks past is predicted to come near, seconds before
        predicted=(),
        after=("soften-arms",),
    ),
    "A3": Causes(
        (
            Cause(
                ("swing-leg-drift", "path-overlap", "narrow-shared-space"),
                ("step-suppression", "announce"),
                early=("shorten-step", "announce"),
            ),
        ),
        predicted=(),
        after=("shorten-step", "announce"),
    ),
}
"""A1 by a map of subsets of the four protocols against the disturbances of the twin ``mujoco``, seeds from 50000."""
