"""What stands in the template where an event was drawn or simulated, not seen; all but the platforms is invented."""

from __future__ import annotations

from collections.abc import Iterable

from foreshock.events.schema import DEVIATIONS
from foreshock.taxonomy import Taxonomy

__all__ = ["ENVIRONMENTS", "PLATFORMS", "TASKS_OF", "deviation_of", "relation_of", "tasks_of"]

PLATFORMS = ("Atlas", "Digit", "Apollo", "HRP-5P", "TALOS")
"""Section 3.1."""

ENVIRONMENTS = ("assembly line", "logistics zone", "maintenance bay", "laboratory")

TASKS_OF = {
    "A1": ("balance-recovery", "navigation", "assembly"),
    "A2": ("assembly", "fastening", "maintenance"),
    "A3": ("navigation", "balance-recovery", "logistics"),
    "A4": ("handover",),
    "A5": ("handover", "maintenance", "logistics"),
    "A6": ("navigation", "logistics", "inspection"),
    "A7": ("handover", "inspection", "assembly"),
    "A8": ("inspection", "assembly", "logistics"),
    "A9": ("maintenance", "inspection", "fastening"),
    "A10": ("fastening", "assembly", "maintenance"),
    "A11": ("co-carrying",),
    "A12": ("assembly", "logistics", "co-carrying"),
}
"""Tasks in which an accident mode is plausible, the most plausible first."""

_RELATION_OF = {
    "balance-recovery": "within reach",
    "navigation": "crossing paths",
    "handover": "face to face, hand to hand",
    "co-carrying": "face to face, one load",
}

_DEVIATION_OF = {"perceptual": "perceptual", "human-behavioral": "human-behavioural"}
"""Deviation by precursor class; every other class is kinematic."""


def tasks_of(mode: str) -> tuple[str, ...]:
    """Plausible tasks of an accident mode, or of none."""
    return TASKS_OF.get(mode, ("assembly", "navigation", "handover"))


def relation_of(task: str) -> str:
    """Where human and robot stand to each other in a task."""
    return _RELATION_OF.get(task, "side by side")


def deviation_of(kinds: Iterable[str], taxonomy: Taxonomy) -> tuple[str, ...]:
    """Deviation characteristics of kinds, by their class."""
    found = {_DEVIATION_OF.get(taxonomy.class_of(kind), "kinematic") for kind in kinds}
    return tuple(name for name in DEVIATIONS if name in found)
