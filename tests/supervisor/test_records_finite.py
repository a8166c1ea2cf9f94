"""NaN anywhere in a message is found, in whatever container it hides."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from foreshock.messages import (
    Capsule,
    Detection,
    Detections,
    HumanPose,
    Humans,
    JointState,
    Message,
    MotionPlan,
    Scalar,
    WrenchStamped,
    is_finite,
)

NAN, INF = math.nan, math.inf

GOOD: list[Message] = [
    Scalar(0.0),
    Scalar(1e308),
    JointState((), ()),
    JointState(("a", "b"), (1.0, -2.0)),
    Humans(()),
    Humans((HumanPose("h", (Capsule("chest", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 0.1),)),)),
    Detections((Detection("1", "cup", 0.5, (0.0, 0.0, 0.0)),)),
    MotionPlan((0.0, 0.0, 0.8), ("left",)),
]

BAD: list[Message] = [
    Scalar(NAN),
    Scalar(-INF),
    JointState(("a", "b"), (1.0, NAN)),
    JointState(("a", "b"), (INF, -INF)),
    JointState(("a",), (1.0,), (), (NAN,)),
    WrenchStamped((0.0, NAN, 0.0), (0.0, 0.0, 0.0)),
    Humans((HumanPose("h", (Capsule("chest", (0.0, 0.0, 0.0), (0.0, 0.0, NAN), 0.1),)),)),
    Humans((HumanPose("h", (), (0.0, NAN, 0.0)),)),
    Humans((HumanPose("h", (), None, INF),)),
    Detections((Detection("1", "cup", NAN, (0.0, 0.0, 0.0)),)),
]


@pytest.mark.parametrize("message", GOOD, ids=repr)
def test_finite(message: Message) -> None:
    assert is_finite(message)


@pytest.mark.parametrize("message", BAD, ids=repr)
def test_not_finite(message: Message) -> None:
    assert not is_finite(message)


UNTYPED: list[Any] = [
    Scalar(np.float32("nan")),
    Scalar(np.float64("nan")),
    Scalar(None),
    Scalar("1.0"),
    JointState(("a",), [NAN]),
    JointState(("a",), np.array([NAN])),
    JointState(("a", "b"), (1, NAN)),
]


@pytest.mark.parametrize("message", UNTYPED, ids=repr)
def test_what_is_not_of_the_declared_type_is_not_taken_for_finite(message: Any) -> None:
    """A twin in process is not decoded, so that nobody has checked the types of its fields."""
    assert not is_finite(message)
