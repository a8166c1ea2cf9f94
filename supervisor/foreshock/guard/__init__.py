"""The robot's side: the motion lease (rule 5: a dead supervisor is safe) and the interventions."""

from foreshock.guard._client import Guard, GuardCounts
from foreshock.guard._motion import MotionGuard

__all__ = ["Guard", "GuardCounts", "MotionGuard"]
