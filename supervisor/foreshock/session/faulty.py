"""A twin whose messages and actuators have faults.

The plant never knows: its draws, events and probes are those of the run without faults, but for what a supervisor
that is misled does differently.
"""

from __future__ import annotations

import heapq
from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase

import msgspec

from foreshock.clock import ns
from foreshock.errors import ConfigError, nearest
from foreshock.records import Intervention, Sample
from foreshock.session._fault_streams import happens, stream, stream_names
from foreshock.session._sensor_faults import OnChannel, matching, paths_of
from foreshock.session.faults import Fault, Ignored, Late, SensorFault
from foreshock.session.fields import Path
from foreshock.twin import Channel, Parameters, Twin, TwinEvent

__all__ = ["FaultyTwin"]


class FaultyTwin:
    """A twin with faults between it and its supervisor; implements foreshock.twin.Twin.

    Every fault draws from a stream of its own per channel, which follows from the seed: runs that are paired by seed
    share their noise, and one fault more leaves the others as they are.

    Args:
        twin: what has the faults; it is not closed but by close().
        faults: in the order in which they come over a message; a crash is not its business (Crashes).
        place: where they stand, for messages.

    Raises:
        ConfigError: a pattern matches no channel or action of the twin, or a field does not exist or has another unit.
    """

    def __init__(self, twin: Twin, faults: Sequence[Fault], place: str) -> None:
        self._twin, self._faults, self._names = twin, tuple(faults), stream_names(faults)
        self._paths: dict[tuple[int, str], list[Path]] = {}
        for k, fault in enumerate(faults):
            where = f"{place}: faults[{k}]"
            if isinstance(fault, SensorFault):
                for channel in matching(fault.channel, twin.channels, where):
                    self._paths[k, channel.name] = paths_of(fault, channel, where)
            elif isinstance(fault, Late | Ignored):
                for pattern in fault.actions:
                    if not any(fnmatchcase(a, pattern) for a in twin.actions):
                        hint = nearest(pattern, twin.actions)
                        raise ConfigError(f"{where}.actions", f"{pattern!r} matches no action of the twin", hint)
        self.reset_faults(0)

    @property
    def channels(self) -> Sequence[Channel]:
        """Those of the twin."""
        return self._twin.channels

    @property
    def period_ns(self) -> int:
        """That of the twin."""
        return self._twin.period_ns

    @property
    def stepped(self) -> bool:
        """As the twin."""
        return self._twin.stepped

    @property
    def actions(self) -> frozenset[str]:
        """What the twin says that it understands: nobody is told that an actuator does not obey."""
        return self._twin.actions

    def reset(self, parameters: Parameters, seed: int) -> None:
        """Reset the twin as without faults, and all that the faults remember."""
        self._twin.reset(parameters, seed)
        self.reset_faults(seed)

    def reset_faults(self, seed: int) -> None:
        """Back to time 0 with the draws of this seed."""
        self._now = 0
        self._active = [happens(f, seed, name) for f, name in zip(self._faults, self._names, strict=True)]
        self._on: dict[str, list[OnChannel]] = {}
        for (k, channel), paths in self._paths.items():
            fault = self._faults[k]
            if self._active[k] and isinstance(fault, SensorFault):
                draws = stream(seed, f"{self._names[k]} {channel}")
                self._on.setdefault(channel, []).append(OnChannel(fault, draws, paths))
        self._under_way: list[tuple[int, int, Sample]] = []
        self._commands: list[tuple[int, int, Intervention]] = []
        self._due: dict[str, int] = {}
        self._count = 0

    def advance(self, until_ns: int) -> Sequence[Sample]:
        """What arrives until then, by arrival."""
        samples: list[Sample] = []
        period = self._twin.period_ns
        while self._commands and (at := -(-self._commands[0][0] // period) * period) < until_ns:
            if at > self._now:
                samples += self._twin.advance(at)
                self._now = at
            self._twin.intervene(heapq.heappop(self._commands)[2])
        samples += self._twin.advance(until_ns)
        self._now = until_ns
        arrived = [s for sample in samples if (s := self._taken(sample)) is not None]
        late = False
        while self._under_way and self._under_way[0][0] <= until_ns:
            arrived.append(heapq.heappop(self._under_way)[2])
            late = True
        return sorted(arrived, key=_arrival_ns) if late else arrived

    def _taken(self, sample: Sample) -> Sample | None:
        """A sample after all faults on its channel; None if it is lost or still under way."""
        delay_ns = 0
        for fault in self._on.get(sample.channel.partition("/")[2], ()):
            after, by_ns = fault.take(sample)
            if after is None:
                return None
            sample, delay_ns = after, delay_ns + by_ns
        if not delay_ns:
            return sample
        arrival = _arrival_ns(sample) + delay_ns
        self._count += 1
        heapq.heappush(self._under_way, (arrival, self._count, msgspec.structs.replace(sample, received_ns=arrival)))
        return None

    def intervene(self, intervention: Intervention) -> None:
        """Hand a command on: now, later or never. No command overtakes an earlier one for the same action."""
        action, due = intervention.action, self._now
        for fault, active in zip(self._faults, self._active, strict=True):
            if active and isinstance(fault, Late | Ignored) and fault.holds(self._now):
                if not any(fnmatchcase(action, pattern) for pattern in fault.actions):
                    continue
                if isinstance(fault, Ignored):
                    return
                due += ns(fault.magnitude)
        due = self._due[action] = max(due, self._due.get(action, 0))
        if due <= self._now:
            self._twin.intervene(intervention)
            return
        self._count += 1
        heapq.heappush(self._commands, (due, self._count, intervention))

    def events(self) -> Sequence[TwinEvent]:
        """Those of the twin."""
        return self._twin.events()

    def probes(self) -> Mapping[str, float]:
        """Those of the twin: the ground truth has no faults."""
        return self._twin.probes()

    def close(self) -> None:
        """Close the twin."""
        self._twin.close()


def _arrival_ns(sample: Sample) -> int:
    return sample.received_ns if sample.received_ns >= 0 else sample.stamp_ns
