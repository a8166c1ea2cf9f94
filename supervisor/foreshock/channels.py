"""What arrives: whether a sample is sound, and the newest of each channel. A malformed sample never raises."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

from foreshock.clock import ns
from foreshock.detector import Input
from foreshock.messages import is_finite, stands_still
from foreshock.records import Sample

__all__ = ["AHEAD_NS", "ChannelView", "unread"]

AHEAD_NS = 10_000_000
"""A stamp further ahead of the tick than this is malformed; less is the skew of two synchronised clocks."""
EARLIEST_NS = -(1 << 63)
"""A stamp before this does not fit the 64 bits of a journal."""


def _is_finite(value: object) -> bool:
    """Whether every number in what should be a message is finite, whatever it is."""
    try:
        return is_finite(value)  # type: ignore[arg-type]  # judged here
    except (AttributeError, ArithmeticError):  # a None among the detections, an int beyond float
        return False


def _is_numbered(sample: Sample) -> bool:
    """Whether stamp, sequence number and arrival are ints that a journal can write."""
    stamp_ns, seq, received_ns = sample.stamp_ns, sample.seq, sample.received_ns
    if not (type(stamp_ns) is type(seq) is type(received_ns) is int):
        return False
    return (
        EARLIEST_NS <= stamp_ns < -EARLIEST_NS
        and EARLIEST_NS <= seq < -EARLIEST_NS
        and EARLIEST_NS <= received_ns < -EARLIEST_NS
    )


def _misnumbered(sample: Sample) -> str:
    """What is wrong with stamp, sequence number or arrival."""
    for name, value in (("stamp", sample.stamp_ns), ("seq", sample.seq), ("received_ns", sample.received_ns)):
        if type(value) is not int:
            shown = repr(value) if type(value) in (float, str, bool, type(None)) else f"of type {type(value).__name__}"
            return f"{sample.channel} has the {name} {shown:.80}, an int is expected"
        if not EARLIEST_NS <= value < -EARLIEST_NS:
            return f"{sample.channel} has a {name} beyond 64 bits"
    return ""


def unread(sample: object) -> tuple[str, str]:
    """Where and why a sample on a channel that no input names is malformed; an empty reason if it is sound.

    Such samples reach the readers of ``*`` only. The place is the channel, or ``samples`` if that is no proper name.
    """
    if type(sample) is not Sample:
        return "samples", f"a {type(sample).__name__} came where a Sample is expected"
    channel = sample.channel
    if type(channel) is not str:
        return "samples", f"a sample has a channel of type {type(channel).__name__}, a str is expected"
    if not channel.isprintable():
        return "samples", f"a sample has the channel {channel!r:.80}, which cannot be printed"
    # without a slash it could be the name of a detector, whose health it must not overwrite
    place = channel if "/" in channel else "samples"
    if not _is_numbered(sample):
        return place, _misnumbered(sample)
    if not _is_finite(sample.value):
        return place, f"{channel} carries {type(sample.value).__name__} with a number that is not finite, or no message"
    return place, ""


class ChannelView:
    """Newest valid sample of a channel, whether one was malformed or all are frozen, and its arrivals within a second.

    Args:
        needs: the inputs that read this channel.
        queues: where each of them waits for new samples.
    """

    __slots__ = (
        "_longest_ns", "_moved_ns", "_queues", "_rated", "_type", "_types", "arrivals", "fault", "fault_ns", "latest",
        "still_ns",
    )  # fmt: skip

    def __init__(self, needs: Sequence[Input], queues: Sequence[list[Sample]]) -> None:
        self._types = tuple({need.type: None for need in needs})
        self._type = self._types[0] if len(self._types) == 1 else None
        self._rated = any(need.min_rate_hz > 0 for need in needs)
        self._longest_ns = min([ns(need.max_standstill_s) for need in needs if need.max_standstill_s > 0.0], default=0)
        self._queues = tuple(queues)
        self.reset()

    def reset(self) -> None:
        """Forget what was seen."""
        self.latest: Sample | None = None
        self.fault = ""
        self.fault_ns = -1
        self._moved_ns = 0
        self.still_ns = 0
        self.arrivals: deque[int] = deque()

    def take(self, sample: Sample, now_ns: int) -> bool:
        """Give a sample to those who read the channel, if it is valid; a malformed one marks the channel.

        A valid sample clears a fault of an earlier tick only: of two in one tick the malformed one is still a gap.
        """
        stamp_ns, value = sample.stamp_ns, sample.value
        sound = _is_numbered(sample) and stamp_ns <= now_ns + AHEAD_NS and type(value) is self._type
        fault = "" if sound and _is_finite(value) else self._fault_of(sample, now_ns)
        if fault:
            self.fault, self.fault_ns = fault, now_ns
            return False
        if self.fault and self.fault_ns < now_ns:
            self.fault = ""
        before = self.latest
        if before is None or stamp_ns >= before.stamp_ns:
            self.latest = sample
            if self._longest_ns:
                if before is not None and stands_still(before.value, value):
                    self.still_ns = stamp_ns - self._moved_ns
                else:
                    self._moved_ns, self.still_ns = stamp_ns, 0
        if self._rated:
            self.arrivals.append(now_ns)
        for queue in self._queues:
            queue.append(sample)
        return True

    def _fault_of(self, sample: Sample, now_ns: int) -> str:
        if not _is_numbered(sample):
            return _misnumbered(sample)
        for wanted in self._types:
            if not isinstance(sample.value, wanted):
                return f"{sample.channel} carries {type(sample.value).__name__}, {wanted.__name__} is expected"
        if not _is_finite(sample.value):
            return f"{sample.channel} carries a number that is not finite"
        if sample.stamp_ns > now_ns + AHEAD_NS:
            return f"{sample.channel} is stamped {(sample.stamp_ns - now_ns) / 1e6:.0f} ms ahead of the supervisor"
        return ""

    def frozen(self, max_standstill_ns: int = 0) -> str:
        """Why the channel is frozen: the same values for longer than this, or than its strictest reader allows."""
        allowed = max_standstill_ns or self._longest_ns
        if self.latest is None or self.still_ns <= allowed:
            return ""
        lasts = f"the same values for {self.still_ns / 1e6:.0f} ms, at most {allowed / 1e6:.0f} ms is allowed"
        return f"{self.latest.channel} is frozen: {lasts}"

    def lacks(self, need: Input, max_age_ns: int, max_standstill_ns: int, now_ns: int, since_ns: int) -> str:
        """Why the channel does not serve this input now; empty if it does."""
        if self.fault:
            return self.fault
        if self.latest is None:
            return f"no {need.type.__name__} on {need.channel} since reset"
        age = now_ns - self.latest.stamp_ns
        if age > max_age_ns:
            return f"{need.channel} is {age / 1e6:.0f} ms old, at most {need.max_age_s * 1e3:.0f} ms is allowed"
        if 0 < max_standstill_ns < self.still_ns:
            return self.frozen(max_standstill_ns)
        if need.min_rate_hz > 0.0 and now_ns - since_ns >= 1_000_000_000:
            while self.arrivals and self.arrivals[0] <= now_ns - 1_000_000_000:
                self.arrivals.popleft()
            if len(self.arrivals) < need.min_rate_hz:
                return f"{need.channel} has {len(self.arrivals)} samples/s, {need.min_rate_hz:g} are needed"
        return ""
