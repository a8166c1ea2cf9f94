"""Events of a run: seen by the referee, never by detectors."""

from __future__ import annotations

from collections.abc import Sequence

import msgspec

from foreshock.twin import TwinEvent
from foreshock_twins.fmi._binding import EventBinding
from foreshock_twins.fmi._layout import Layout, Values

__all__ = ["Referee"]


class Referee:
    """Judges each step against the events of a binding.

    An event happens once, at the first step where all its conditions hold. From then on its value is the running
    maximum of its variable: an impact is worst some milliseconds after the first touch.
    """

    def __init__(self, bindings: Sequence[EventBinding], layout: Layout) -> None:
        self._rules = [
            (b, layout.index(b.value), [(layout.index(c.variable), c.side == "above", c.bound) for c in b.when])
            for b in bindings
        ]
        self._found: dict[int, TwinEvent] = {}
        self._worst: dict[int, float] = {}

    def reset(self) -> None:
        """Forget the run."""
        self._found, self._worst = {}, {}

    def see(self, values: Values, now_ns: int) -> None:
        """Judge the values of one step."""
        for i, (binding, index, conditions) in enumerate(self._rules):
            value = values[index]
            if i in self._found:
                if value > self._worst[i]:
                    self._worst[i] = value
            elif all(values[j] > bound if above else values[j] < bound for j, above, bound in conditions):
                self._found[i] = TwinEvent(now_ns, binding.id, binding.mode, value, binding.limit, binding.unit)
                self._worst[i] = value

    def events(self) -> Sequence[TwinEvent]:
        """All events so far, by time."""
        found = [msgspec.structs.replace(event, value=self._worst[i]) for i, event in self._found.items()]
        return sorted(found, key=lambda event: (event.stamp_ns, event.id))
