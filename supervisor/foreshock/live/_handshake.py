"""A twin that streams declares what it is when it joins; one that means something else is refused by name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import msgspec

from foreshock.detector import Input
from foreshock.errors import WireError
from foreshock.wire import ROS_NAMES, Hello, Keys, Request, check_hello

__all__ = ["Handshakes"]

MOST = 64
MOST_BYTES = 100_000
PATIENCE_NS = 5_000_000_000


class Handshakes:
    """Asks every twin that appears, and keeps what is wrong with it.

    Args:
        session: open Zenoh session.
        keys: of the robot.
        inputs: that detectors read, for the rates that they need.
        channels: that are read, with the message class of each.

    Attributes:
        refused: why, by twin.
    """

    def __init__(self, session: Any, keys: Keys, inputs: Sequence[Input], channels: Mapping[str, type]) -> None:
        import zenoh

        self._session, self._keys, self._fifo = session, keys, zenoh.handlers.FifoChannel
        self._rates = {i.channel: i.min_rate_hz for i in inputs if i.min_rate_hz > 0.0}
        self._types = {channel: ROS_NAMES[cls] for channel, cls in channels.items()}
        self._asked: dict[str, Any] = {}
        self._since: dict[str, int] = {}
        self.refused: dict[str, str] = {}

    @property
    def waiting(self) -> list[str]:
        """Twins of which nothing is known yet: they may mean anything."""
        return [twin for twin in self._asked if twin not in self.refused]

    def update(self, peers: Sequence[str], now_ns: int) -> None:
        """Ask new twins, take answers, forget those that left.

        Args:
            peers: tokens that are up, ``<role>/<name>``.
            now_ns: on the supervisor's timeline.
        """
        twins = [p for p in peers if p.startswith("twin/")]
        for twin in [t for t in {*self._since, *self.refused} if t not in twins]:
            self._since.pop(twin, None)
            self._asked.pop(twin, None)
            self.refused.pop(twin, None)
        for twin in twins:
            if twin not in self._since and len(self._since) >= MOST:
                self.refused[twin] = f"there are more than {MOST} twins"
                continue
            if twin not in self._since:
                self._since[twin] = now_ns
                self._ask(twin)
            elif twin in self._asked:
                self._take(twin, now_ns)

    def _ask(self, twin: str) -> None:
        payload = msgspec.json.encode(Request("hello"))
        self._asked[twin] = self._session.get(self._keys.service(twin), self._fifo(4), payload=payload, timeout=1.0)

    def _take(self, twin: str, now_ns: int) -> None:
        """The answer, if it is there; one that did not come is asked for again, and missed after a while."""
        try:
            reply = self._asked[twin].try_recv()
        except Exception:  # noqa: BLE001 # the query has ended without a reply: zenoh has one error for everything
            self._ask(twin)
            reply = None
        if reply is not None:
            del self._asked[twin]
            self._judge(twin, reply)
        elif now_ns - self._since[twin] > PATIENCE_NS:
            self.refused[twin] = f"{twin}: does not say what it is"

    def _judge(self, twin: str, reply: Any) -> None:
        self.refused.pop(twin, None)
        try:
            if reply.ok is None:
                raise WireError(twin, f"answers: {reply.err.payload.to_string()}")
            if len(reply.ok.payload) > MOST_BYTES:
                raise WireError(twin, f"{len(reply.ok.payload)} bytes, at most {MOST_BYTES} are read")
            hello = msgspec.json.decode(reply.ok.payload.to_bytes(), type=Hello)
            check_hello(hello, twin, stepped=False)
            check_streams(hello, twin, self._keys.robot, self._types)
            check_rates(hello, twin, self._rates)
        except (WireError, ValueError, OverflowError) as e:  # no JSON, no UTF-8, a number beyond any
            self.refused[twin] = f"{e!s:.500}"


def check_streams(hello: Hello, place: str, robot: str, read: Mapping[str, str]) -> None:
    """Refuse a twin of another robot, or one that sends another type than is read.

    Args:
        hello: what it declares.
        place: who it is, for the error.
        robot: that is supervised.
        read: ROS 2 type, by full channel.

    Raises:
        WireError: names what differs.
    """
    if hello.robot != robot:
        raise WireError(f"{place}: robot", f"{hello.robot!r}, {robot!r} is expected")
    for c in hello.channels:
        wanted = read.get(f"{robot}/{c.name}", c.type)
        if c.type != wanted:
            raise WireError(f"{place}: {c.name}", f"{c.type!r}, {wanted!r} is read there")


def check_rates(hello: Hello, place: str, needed: Mapping[str, float]) -> None:
    """Refuse a stream that is slower than a detector needs.

    Raises:
        WireError: names channel and rates.
    """
    for c in hello.channels:
        wanted = needed.get(f"{hello.robot}/{c.name}", 0.0)
        hz = 1e9 / c.period_ns if c.period_ns > 0 else 0.0
        if hz < wanted:
            raise WireError(f"{place}: {c.name}", f"{hz:g} samples a second, a detector needs {wanted:g}")
