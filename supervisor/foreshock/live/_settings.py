"""Settings of a live supervisor: the tables [live] and [journal]."""

from __future__ import annotations

import msgspec

from foreshock._strict import within
from foreshock.errors import ConfigError, nearest
from foreshock.wire import ROS_NAMES

__all__ = ["JournalSettings", "LiveSettings"]

MESSAGES = tuple(cls.__name__ for cls in ROS_NAMES)


class LiveSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """How a live supervisor runs.

    Attributes:
        ttl_s: time to live of the motion lease.
        ack_s: an intervention that no guard has acknowledged by then ends the lease.
        resend_s: an unacknowledged intervention is sent again after this time.
        decision_hz: decisions are published so often, and whenever a level changes.
        history_s: how much of the recent past a late joiner can ask for.
        streams: further channels to take, by name below the robot's, with their message type; detectors that read
            every channel see them.
        max_skew_s: a source clock that jumps by more than this is not believed until it has been steady again.
    """

    ttl_s: float = 0.1
    ack_s: float = 0.1
    resend_s: float = 0.03
    decision_hz: float = 20.0
    history_s: float = 10.0
    streams: dict[str, str] = {}
    max_skew_s: float = 0.1

    def __post_init__(self) -> None:
        within("live.ttl_s", self.ttl_s, 0.0, 1.0, above=True)
        within("live.ack_s", self.ack_s, 0.0, 10.0, above=True)
        within("live.resend_s", self.resend_s, 0.001, 10.0)
        within("live.decision_hz", self.decision_hz, 0.0, above=True)
        within("live.history_s", self.history_s, 0.0, 600.0)
        within("live.max_skew_s", self.max_skew_s, 0.0, above=True)
        for name, kind in self.streams.items():
            if kind not in MESSAGES:
                raise ConfigError(f"live.streams.{name}", f"there is no message {kind!r}", nearest(kind, MESSAGES))


class JournalSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Where a live supervisor keeps its journal, and for how long.

    Attributes:
        folder: of the files, relative to the configuration; empty: no journal.
        segment_s: a new file begins after this time. The first replays exactly; a later one begins in the middle, and
            can be read but not compared.
        max_bytes: the oldest files are removed when all of them are larger than this.
        max_age_s: and when they are older.
    """

    folder: str = ""
    segment_s: float = 3600.0
    max_bytes: int = 10_000_000_000
    max_age_s: float = 30 * 86400.0

    def __post_init__(self) -> None:
        within("journal.segment_s", self.segment_s, 1.0)
        within("journal.max_age_s", self.max_age_s, 1.0)
        if self.max_bytes < 1_000_000:
            raise ConfigError("journal.max_bytes", f"{self.max_bytes} is less than 1 MB")
