"""Which stream may spend the time that there is for taking samples."""

from __future__ import annotations

from collections import deque
from itertools import repeat
from typing import Any, cast

from foreshock.live._intake import Intake
from foreshock.live._stream import Stream
from foreshock.messages import Scalar
from foreshock.records import Sample

MS = 1_000_000


class Waiting:
    """A stream in whose ring these payloads wait, by their length."""

    def __init__(self, name: str, sizes: Any) -> None:
        self.name, self._sizes, self.taken = name, iter(sizes), 0

    def take(self, now_ns: int) -> tuple[Sample | None, int] | None:
        size = next(self._sizes, None)
        if size is None:
            return None
        self.taken += 1
        return Sample(now_ns, self.name, Scalar(0.0), self.taken, now_ns), size


def intake(*streams: Waiting, period_ns: int = 5 * MS) -> Intake:
    return Intake(cast("list[Stream]", list(streams)), period_ns)


def test_everything_is_taken_where_there_is_time() -> None:
    streams = [Waiting(str(k), [100] * 5) for k in range(3)]
    assert len(intake(*streams, period_ns=1_000 * MS).drain(0)) == 15


def test_samples_of_a_stream_stay_in_order() -> None:
    found = intake(Waiting("a", [100] * 50), Waiting("b", repeat(1_000)), period_ns=100 * MS).drain(0)
    for name in ("a", "b"):
        numbers = [s.seq for s in found if s.channel == name]
        assert numbers == sorted(numbers)


def test_a_flood_leaves_the_others_theirs() -> None:
    """Each of the quiet ones brings a sample a tick, all are taken whatever the others send, within 5 ticks' delay."""
    for size in (100, 10_000, 250_000):
        flood = Waiting("flood", repeat(size))
        queues = [deque[int]() for _ in range(4)]
        streams = [Waiting(str(k), iter(lambda q=q: q.popleft() if q else None, 0)) for k, q in enumerate(queues)]
        taking = intake(flood, *streams)
        for tick in range(100):
            for q in queues:
                q.append(200)
            taking.drain(tick)
            assert all(tick + 1 - s.taken <= 5 for s in streams), size
        assert flood.taken > 0


def test_a_flood_of_large_samples_takes_its_time_from_later_ticks() -> None:
    """250 kB cost 5 ms by the rate that is reckoned with, 2.5 ms a tick are there: no more than one in two ticks."""
    flood = Waiting("flood", repeat(250_000))
    taking = intake(flood)
    for tick in range(100):
        taking.drain(tick)
    assert 10 <= flood.taken <= 51
