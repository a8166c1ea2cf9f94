"""Interventions that nobody decides: those of a supervised run at another moment, or held from the start.

They tell whether the moment of an intervention matters, or only that something is done.
"""

from __future__ import annotations

from collections.abc import Sequence

import msgspec
import numpy as np

from foreshock.clock import ns
from foreshock.records import Intervention

__all__ = ["held", "moved"]


def moved(changes: Sequence[Intervention], duration_s: float, seed: int) -> tuple[Intervention, ...]:
    """The interventions of a supervised run, all moved so that the first comes at a random time of the scenario.

    Args:
        changes: of the supervised run, by time.
        duration_s: of the scenario; the time is uniform over it.
        seed: of the run; its stream is separate from those of plant and sensors.
    """
    if not changes:
        return ()
    at_s = np.random.default_rng([0x7265, seed]).uniform(0.0, duration_s)
    by_ns = ns(at_s) - changes[0].stamp_ns
    return tuple(msgspec.structs.replace(i, stamp_ns=i.stamp_ns + by_ns) for i in changes)


def held(changes: Sequence[Intervention]) -> tuple[Intervention, ...]:
    """Every action of a supervised run, from the start, as strong as it became."""
    most: dict[str, Intervention] = {}
    for i in changes:
        if i.action not in most or i.strength > most[i.action].strength:
            most[i.action] = i
    return tuple(msgspec.structs.replace(i, stamp_ns=0) for i in most.values())
