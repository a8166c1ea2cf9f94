"""Random streams of faults: one for each, apart from those of plant and sensors."""

from __future__ import annotations

import zlib
from collections.abc import Sequence

import numpy as np

from foreshock.session.faults import Crash, Fault, Loss, SensorFault, kind_of

__all__ = ["happens", "stream", "stream_names"]

_FAULTS = 0x66


def stream_names(faults: Sequence[Fault]) -> list[str]:
    """A name per fault that another fault beside it does not change: what it is, and which of several such."""
    names: list[str] = []
    for f in faults:
        base = f"{kind_of(f)} {f.channel if isinstance(f, SensorFault) else f.detector if isinstance(f, Crash) else ''}"
        names.append(f"{base} {sum(n.startswith(f'{base} ') for n in names)}")
    return names


def stream(seed: int, name: str) -> np.random.Generator:
    """The stream of a name in the run of this seed."""
    return np.random.default_rng([_FAULTS, seed, zlib.crc32(name.encode())])


def happens(fault: Fault, seed: int, name: str) -> bool:
    """Whether it happens in the run of this seed; what happens at one probability happens at every higher one."""
    return isinstance(fault, Loss) or bool(stream(seed, name).random() < fault.probability)
