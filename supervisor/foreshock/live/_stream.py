"""One stream of samples over Zenoh: taken from a ring at each tick, so that no peer can make another wait."""

from __future__ import annotations

from typing import Any

import msgspec

from foreshock.clock import monotonic_ns
from foreshock.errors import WireError
from foreshock.live._clock import ClockOffset
from foreshock.messages import is_finite
from foreshock.records import Sample
from foreshock.wire import MAX_BYTES, ROS_NAMES, Codec, Keys, unpack_attachment

__all__ = ["Stream", "StreamCounts"]

RING = 256
"""Of a stream that floods, the oldest samples are lost, and none of another stream."""
MOST_GAPS = 1 << 53
MOST_NS = 1 << 61
"""Stamps beyond (73 years from either epoch) are no times, and sums of them would leave 64 bits."""
NO_NUMBER = -(1 << 63) - 1
"""Before the first sample: below every number that an attachment can hold."""
SILENT_NS = 1_000_000_000
"""Another sender is believed when the first has been silent for so long."""


class StreamCounts(msgspec.Struct):
    """What a stream has seen.

    Attributes:
        samples: that were taken.
        gaps: sequence numbers that never came.
        repeated: samples with the number of the one before; with its stamp as well, they are dropped.
        disordered: samples with a lower number than one before.
        backwards: samples older than one before.
        not_finite: samples with a NaN or an infinity, which detectors never see.
        garbage: payloads or attachments that could not be read.
        mistyped: samples on a key of another type or hash, where keys name them.
        foreign: samples of a second sender, while the first still sends.
        unbelieved: samples whose clock had just jumped.
        jumps: of the source's clock.
        last_fault: what was wrong last, in words.
    """

    samples: int = 0
    gaps: int = 0
    repeated: int = 0
    disordered: int = 0
    backwards: int = 0
    not_finite: int = 0
    garbage: int = 0
    mistyped: int = 0
    foreign: int = 0
    unbelieved: int = 0
    jumps: int = 0
    last_fault: str = ""


class Stream:
    """Subscribes to one channel.

    Args:
        session: open Zenoh session.
        keys: of the robot.
        channel: ``<robot>/<subject>/<quantity>``.
        cls: message class that it must carry.
        codec: that knows the layouts.
        max_skew_s: see ClockOffset.

    Attributes:
        offset_ns: of the source's clock; None before the first sample.
        delay_ns: how much later samples come than its drift explains; see ClockOffset.
        doubted: the source's clock has just jumped, and is not believed yet.
    """

    def __init__(self, session: Any, keys: Keys, channel: str, cls: type, codec: Codec, max_skew_s: float) -> None:
        import zenoh

        self.channel, self._cls, self._codec, self._skew_s = channel, cls, codec, max_skew_s
        self._skew_ns = round(max_skew_s * 1e9)
        self.key = keys.stream(channel, ROS_NAMES[cls])
        every = keys.every_type(channel)
        self._typed = every != self.key
        self._subscriber = session.declare_subscriber(every, zenoh.handlers.RingChannel(RING))
        self.counts = StreamCounts()
        self.offset_ns: int | None = None
        self.delay_ns = 0
        self.doubted = False
        self.newest_ns = -1
        self.arrived_ns = -1
        self._clock = ClockOffset(max_skew_s)
        self._gid = b""
        self._sequence = NO_NUMBER
        self._stamp_ns = self._numbered_ns = -MOST_NS

    def take(self, now_ns: int) -> tuple[Sample | None, int] | None:
        """The oldest that waits and its length in bytes; no sample if it is none that counts, None if nothing waits.

        Args:
            now_ns: time of the tick.
        """
        raw = self._subscriber.try_recv()
        if raw is None:
            return None
        arrival_ns = monotonic_ns()
        try:
            return self._read(raw, now_ns, arrival_ns), min(len(raw.payload), MAX_BYTES)
        except WireError as e:
            self.counts.garbage += 1
            self.counts.last_fault = str(e)
            return None, 0

    def _read(self, raw: Any, now_ns: int, arrival_ns: int) -> Sample | None:
        counts = self.counts
        if self._typed and str(raw.key_expr) != self.key:
            counts.mistyped += 1
            counts.last_fault = f"a sample came on {raw.key_expr!s:.300}, {self.key} is read"
            return None
        if raw.attachment is None:
            raise WireError("attachment", "missing")
        attachment = unpack_attachment(raw.attachment.to_bytes())
        if not self._belongs(attachment.gid, now_ns):
            counts.foreign += 1
            counts.last_fault = f"a second sender, {attachment.gid.hex()}, while {self._gid.hex()} sends"
            return None
        if len(raw.payload) > MAX_BYTES:
            raise WireError(self.channel, f"{len(raw.payload)} bytes, at most {MAX_BYTES} are read")
        message, header_ns = self._codec.decode(self._cls, raw.payload.to_bytes())
        stamp_ns = attachment.stamp_ns if header_ns is None else header_ns
        if not -MOST_NS < stamp_ns < MOST_NS:
            raise WireError(self.channel, f"a stamp of {stamp_ns} ns is no time")
        sequence = attachment.sequence
        if sequence == self._sequence:
            counts.repeated += 1
            counts.last_fault = f"the number {sequence} came twice"
            if stamp_ns == self._numbered_ns:
                return None
        elif sequence < self._sequence:
            counts.disordered += 1
            counts.last_fault = f"the number {sequence} came after {self._sequence}"
        elif self._sequence >= 0:
            counts.gaps = min(counts.gaps + sequence - self._sequence - 1, MOST_GAPS)
        if sequence >= self._sequence:
            self._sequence, self._numbered_ns = sequence, stamp_ns
        if stamp_ns < self._stamp_ns:
            counts.backwards += 1
            counts.last_fault = f"a stamp {(self._stamp_ns - stamp_ns) / 1e6:.1f} ms before the one before it"
        self._stamp_ns = max(stamp_ns, self._stamp_ns)
        at_ns = self._clock.take(stamp_ns, arrival_ns)
        clock = self._clock
        counts.jumps, self.offset_ns, self.delay_ns = clock.jumps, clock.offset_ns, clock.delay_ns
        self.doubted = at_ns is None
        if at_ns is None:
            counts.unbelieved += 1
            counts.last_fault = f"a stamp that its clock's offset does not explain by more than {self._skew_s:g} s"
            return None
        if not is_finite(message):
            counts.not_finite += 1
            counts.last_fault = f"a {self._cls.__name__} with a number that is not finite"
        counts.samples += 1
        self.newest_ns, self.arrived_ns = max(at_ns, self.newest_ns), now_ns
        return Sample(at_ns, self.channel, message, sequence, now_ns)

    @property
    def fault(self) -> str:
        """What is wrong with the stream, in words; empty if nothing is."""
        if self.delay_ns <= self._skew_ns:
            return self.counts.last_fault
        late = f"samples come {self.delay_ns / 1e9:.2f} s later than at first, which counts as their age"
        return f"{late}: a delay has grown, or the sender's clock was set back; when it begins again, it is met anew"

    def _belongs(self, gid: bytes, now_ns: int) -> bool:
        """Whether the sample is of the stream's sender; another one takes over when that is silent."""
        if gid != self._gid:
            if self._gid and now_ns - self.arrived_ns < SILENT_NS:
                return False
            self._gid, self._sequence, self._stamp_ns = gid, NO_NUMBER, -MOST_NS
            self._clock = ClockOffset(self._skew_s)
        return True
