"""One fault on one channel: what becomes of its samples."""

from __future__ import annotations

from collections.abc import Sequence
from fnmatch import fnmatchcase

import msgspec
import numpy as np

from foreshock.clock import ns
from foreshock.errors import ConfigError, nearest
from foreshock.records import Sample
from foreshock.session.faults import Bias, Delay, Dropout, Freeze, Loss, Noise, NotANumber, SensorFault
from foreshock.session.fields import Path, changed, message_type, not_a_number, path_in
from foreshock.twin import Channel

__all__ = ["OnChannel", "matching", "paths_of"]


class OnChannel:
    """One fault on one channel in one run. Whatever it draws, it draws for every message, in its time or not."""

    def __init__(self, fault: SensorFault, rng: np.random.Generator, paths: Sequence[Path]) -> None:
        self._fault, self._rng, self._paths = fault, rng, paths
        self._held: Sample | None = None
        self._missing = 0

    def take(self, sample: Sample) -> tuple[Sample | None, int]:
        """What becomes of a sample (None: nothing), and by how much later it arrives in ns."""
        fault, holds = self._fault, self._fault.holds(sample.stamp_ns)
        replace = msgspec.structs.replace
        if isinstance(fault, Dropout):
            if holds:
                self._missing += 1
                return None, 0
            if self._missing and sample.seq >= 0:
                sample = replace(sample, seq=sample.seq - self._missing)
        elif isinstance(fault, Loss):
            drawn = self._rng.random()
            if holds and drawn < fault.probability:
                return None, 0
        elif isinstance(fault, Freeze):
            if not holds or self._held is None:
                self._held = sample
            sample = replace(sample, value=self._held.value)
        elif isinstance(fault, NotANumber) and holds:
            value = not_a_number(sample.value)
            return (None if value == sample.value else replace(sample, value=value)), 0
        elif isinstance(fault, Bias | Noise):
            value = sample.value
            for path in self._paths:
                value = changed(value, path, self._added)
            sample = replace(sample, value=value) if holds else sample
        elif isinstance(fault, Delay) and holds:
            return sample, ns(fault.magnitude)
        return sample, 0

    def _added(self, x: float) -> float:
        fault = self._fault
        if isinstance(fault, Noise):
            return x + fault.magnitude * float(self._rng.standard_normal())
        return x + fault.magnitude if isinstance(fault, Bias) else x


def matching(pattern: str, channels: Sequence[Channel], where: str) -> list[Channel]:
    """The channels that a pattern matches; none is an error at where."""
    found = [c for c in channels if fnmatchcase(c.name, pattern)]
    if not found:
        hint = nearest(pattern, [c.name for c in channels])
        raise ConfigError(f"{where}.channel", f"{pattern!r} matches no channel of the twin", hint)
    return found


def paths_of(fault: SensorFault, channel: Channel, where: str) -> list[Path]:
    """Paths of the numbers that a fault changes in the messages of a channel."""
    if not isinstance(fault, Bias | Noise):
        return []
    type_ = message_type(channel.type)
    if type_ is None:
        raise ConfigError(f"{where}.fields", f"{channel.name} carries {channel.type}, which is no message of ours")
    return [path_in(type_, text, fault.unit, f"{where}.fields") for text in fault.fields]
