"""What joints do beyond their plan: speed of an arm's tip, rate of the trunk against the legs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from foreshock.messages import JointState

__all__ = ["beyond_plan", "tip_speed"]


def beyond_plan(measured: JointState, planned: JointState, joints: Iterable[str]) -> dict[str, float] | None:
    """Measured minus planned velocity of each joint (rad/s); None if one is missing from either."""
    if len(measured.velocity) != len(measured.name) or len(planned.velocity) != len(planned.name):
        return None
    is_, due = dict(zip(measured.name, measured.velocity)), dict(zip(planned.name, planned.velocity))  # noqa: B905  # lengths are checked above
    try:
        return {joint: is_[joint] - due[joint] for joint in joints}
    except KeyError:
        return None


def tip_speed(excess: Mapping[str, float], levers: Mapping[str, float]) -> float:
    """Bound of the fingertips' unplanned speed relative to the trunk (m/s): sum of lever times |rate|, stretched."""
    return sum([levers[joint] * abs(excess[joint]) for joint in levers])
