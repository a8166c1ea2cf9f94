"""Which command held when something was measured: commands are told at once, measurements arrive later."""

from __future__ import annotations

from collections import deque

from foreshock.messages import AnyMessage
from foreshock.records import Sample

__all__ = ["Stamped"]


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
