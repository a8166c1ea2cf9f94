"""What a live supervisor says of itself."""

from __future__ import annotations

from collections import deque

import msgspec

from foreshock.live._denied import Denied, Refused
from foreshock.live._stream import Stream, StreamCounts

__all__ = ["Status", "StreamStatus", "TickTimes", "stream_status"]


class StreamStatus(msgspec.Struct, frozen=True):
    """Of one stream.

    Attributes:
        key: of its samples.
        source_age_s: age of the newest sample by its own stamp; None: there is none yet.
        arrival_age_s: and by its arrival.
        clock_offset_s: of the source's clock, as estimated.
        delay_s: how much later samples come than at first, which counts as their age.
        counts: what it has seen.
    """

    key: str
    source_age_s: float | None
    arrival_age_s: float | None
    clock_offset_s: float | None
    delay_s: float
    counts: StreamCounts


class Status(msgspec.Struct, frozen=True):
    """Everything at a glance.

    Attributes:
        robot: its name.
        epoch: of this supervisor.
        uptime_s: since it began.
        tick: number of the last tick.
        tick_ms: median, 99th percentile and maximum of the last 1,000 ticks.
        overruns: ticks that came a period late or more.
        level: protection level.
        levels: per accident mode that is above normal.
        trust: overall.
        control_trust: overall.
        trust_by_mode: control-level trust per accident mode.
        motion_permitted: whether a lease is granted.
        withheld: why it is not, beside what the decision says; empty if nothing.
        leases: that were granted.
        guards: seconds since each guard was heard.
        unacknowledged: actions that no guard has taken over in time.
        unknown_actions: that guards do not understand, with their number.
        interventions: that hold now, with strength.
        precursors: present now, with subject.
        streams: by channel.
        health: of detectors and channels that are not ok, with the reason.
        peers: liveliness tokens that are up.
        links: processes that are connected: address, and the name in the certificate where there is one.
        denied: what peers tried and may not; empty without certificates.
        refused: connections that did not come about for want of a valid certificate.
        journal: file that is written, or empty.
    """

    robot: str
    epoch: int
    uptime_s: float
    tick: int
    tick_ms: tuple[float, float, float]
    overruns: int
    level: str
    levels: dict[str, str]
    trust: float
    control_trust: float
    trust_by_mode: dict[str, float]
    motion_permitted: bool
    withheld: str
    leases: int
    guards: dict[str, float]
    unacknowledged: tuple[str, ...]
    unknown_actions: dict[str, int]
    interventions: dict[str, float]
    precursors: tuple[str, ...]
    streams: dict[str, StreamStatus]
    health: dict[str, str]
    peers: tuple[str, ...]
    links: tuple[str, ...]
    denied: tuple[Denied, ...]
    refused: tuple[Refused, ...]
    journal: str


class TickTimes:
    """Durations of the last ticks."""

    def __init__(self) -> None:
        self._ns: deque[int] = deque(maxlen=1000)
        self.overruns = 0

    def add(self, took_ns: int) -> None:
        """A tick took so long."""
        self._ns.append(took_ns)

    def milliseconds(self) -> tuple[float, float, float]:
        """Median, 99th percentile, maximum."""
        if not self._ns:
            return (0.0, 0.0, 0.0)
        ordered = sorted(self._ns)
        n = len(ordered)
        return (ordered[n // 2] / 1e6, ordered[min(n - 1, (99 * n) // 100)] / 1e6, ordered[-1] / 1e6)


def stream_status(stream: Stream, now_ns: int) -> StreamStatus:
    """Of a stream, now."""
    heard = stream.arrived_ns >= 0
    return StreamStatus(
        stream.key,
        (now_ns - stream.newest_ns) / 1e9 if heard else None,
        (now_ns - stream.arrived_ns) / 1e9 if heard else None,
        None if stream.offset_ns is None else stream.offset_ns / 1e9,
        stream.delay_ns / 1e9,
        stream.counts,
    )
