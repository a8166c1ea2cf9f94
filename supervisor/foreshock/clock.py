"""The one module that reads clocks; everything else takes ``now_ns``."""

from __future__ import annotations

import datetime
import time

__all__ = [
    "NS_PER_S",
    "cpu_ns",
    "give_way",
    "monotonic_ns",
    "ns",
    "seconds",
    "sleep_until",
    "thread_cpu_ns",
    "today",
    "wall_ns",
]

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


def wall_ns() -> int:
    """Nanoseconds since 1970, UTC: to name things by, never to measure with."""
    return time.time_ns()


def sleep_until(monotonic: int) -> None:
    """Sleep until this time of the monotonic clock; at once if it has passed."""
    left_ns = monotonic - time.monotonic_ns()
    if left_ns > 0:
        time.sleep(left_ns / NS_PER_S)


def give_way() -> None:
    """Let other threads of this process run before this one goes on, for some 0.1 ms."""
    time.sleep(5e-5)


def cpu_ns() -> int:
    """CPU time of this process in nanoseconds."""
    return time.process_time_ns()


def thread_cpu_ns() -> int:
    """CPU time of this thread in nanoseconds."""
    return time.thread_time_ns()


def today() -> str:
    """The date, UTC, as in ISO 8601; for provenance, never for a decision."""
    return datetime.datetime.now(datetime.UTC).date().isoformat()
