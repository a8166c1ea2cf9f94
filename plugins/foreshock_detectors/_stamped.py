"""What of an input is new, and which command held when something was measured: measurements arrive later."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

from foreshock.detector import Inputs
from foreshock.messages import AnyMessage
from foreshock.records import Sample

__all__ = ["Stamped", "fresh"]


def fresh(inputs: Inputs, name: str) -> Sequence[Sample]:
    """What has arrived of an input; where nothing has, the newest, which may have come before the detector listened."""
    new = inputs.new.get(name, ())
    if new:
        return new
    sample = inputs.latest.get(name)
    return () if sample is None else (sample,)


class Stamped:
    """The last samples of a channel, to be asked for the one that held at a time.

    Args:
        most: how many are kept; at their rate they must reach back as far as measurements are late.
    """

    __slots__ = ("_kept",)

    def __init__(self, most: int = 64) -> None:
        self._kept: deque[tuple[int, AnyMessage]] = deque(maxlen=most)

    def push(self, sample: Sample) -> None:
        """Take the next sample; one that is not newer than the last is passed over."""
        if not self._kept or sample.stamp_ns > self._kept[-1][0]:
            self._kept.append((sample.stamp_ns, sample.value))

    def at(self, stamp_ns: int) -> AnyMessage | None:
        """The newest value that is not newer than stamp_ns, or the oldest kept; None if there is none."""
        kept = self._kept
        for stamp, value in reversed(kept):
            if stamp <= stamp_ns:
                return value
        return kept[0][1] if kept else None
