"""The one module that reads clocks; everything else takes ``now_ns``."""

from __future__ import annotations

import datetime
import time

__all__ = ["NS_PER_S", "cpu_ns", "monotonic_ns", "ns", "seconds", "today"]

NS_PER_S = 1_000_000_000


def ns(seconds_: float) -> int:
    """Seconds as integer nanoseconds, rounded to the nearest."""
    return round(seconds_ * NS_PER_S)


def seconds(nanoseconds: int) -> float:
    """Integer nanoseconds as seconds."""
    return nanoseconds / NS_PER_S


def monotonic_ns() -> int:
    """The local monotonic clock in nanoseconds."""
    return time.monotonic_ns()


def cpu_ns() -> int:
    """CPU time of this process in nanoseconds."""
    return time.process_time_ns()


def today() -> str:
    """The date, UTC, as in ISO 8601; for provenance, never for a decision."""
    return datetime.datetime.now(datetime.UTC).date().isoformat()
