"""Hosts a twin behind Zenoh: stepped by query, or free-running with streams, interventions and the lease."""

from __future__ import annotations

import threading
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import msgspec

from foreshock.clock import NS_PER_S, monotonic_ns, sleep_until, wall_ns
from foreshock.errors import ForeshockError
from foreshock.guard import Guard
from foreshock.link import LinkSettings, keys_of, open_link, ros_tokens
from foreshock.policy import MINIMAL_RISK
from foreshock.records import Intervention
from foreshock.twin import Twin
from foreshock.wire import (
    PROTOCOL,
    ROS_NAMES,
    ChannelNote,
    Codec,
    Hello,
    Request,
    Stepped,
    pack_attachment,
    pack_samples,
    rihs01,
)

__all__ = ["FreeRunning", "SteppedServer"]

BY_NAME = {cls.__name__: ros for cls, ros in ROS_NAMES.items()}


def hello_of(twin: Twin, robot: str, clock: str) -> Hello:
    """What a twin declares."""
    channels = tuple(ChannelNote(c.name, BY_NAME[c.type], rihs01(BY_NAME[c.type]), c.period_ns) for c in twin.channels)
    stepped = clock == "simulated"
    actions = tuple(sorted(twin.actions))
    return Hello(PROTOCOL, robot, twin.period_ns, stepped, clock, "SI", "REP-103", channels, actions)


class SteppedServer:
    """Answers questions, one after the other, from the thread that calls serve.

    Args:
        twin: to host.
        robot: its name.
        link: how to join.
        base: folder that the paths of certificates start from.
    """

    def __init__(self, twin: Twin, robot: str, link: LinkSettings, base: Path | None = None) -> None:
        import zenoh

        self._twin, self._codec = twin, Codec()
        self._hello = hello_of(twin, robot, "simulated")
        self._session: Any = open_link(link, base)
        keys = keys_of(link, robot)
        self._queries: Any = self._session.declare_queryable(keys.service("twin"), zenoh.handlers.FifoChannel(16))
        self._token = self._session.liveliness().declare_token(keys.alive("twin", str(wall_ns())))
        self._last: tuple[int, bytes] = (-1, b"")

    def serve(self, stop: threading.Event) -> None:
        """Answer until stop is set."""
        try:
            while not stop.is_set():
                query: Any = self._queries.try_recv()
                if query is None:
                    # a blocking receive could not be stopped; a question waits 0.1 ms at most
                    stop.wait(1e-4)
                    continue
                try:
                    query.reply(query.key_expr, self.answer(query.payload.to_bytes() if query.payload else b""))
                except (ForeshockError, msgspec.MsgspecError, UnicodeDecodeError) as e:
                    query.reply_err(f"{type(e).__name__}: {e}".encode())
                query.drop()
        finally:
            self._session.close()

    def answer(self, payload: bytes) -> bytes:
        """The answer to one question.

        Raises:
            ForeshockError: the twin failed, or the question makes no sense.
            msgspec.MsgspecError, UnicodeDecodeError: it is no question.
        """
        request = msgspec.json.decode(payload, type=Request)
        if request.op == "hello":
            return msgspec.json.encode(self._hello)
        if request.op == "reset":
            self._twin.reset(request.parameters, request.seed)
            self._last = (0, msgspec.json.encode(Stepped((), (), _finite(self._twin.probes()))))
            return self._last[1]
        if self._last[0] < 0:
            raise ForeshockError(f"{request.op!r} before a reset")
        for intervention in request.interventions:
            self._twin.intervene(intervention)
        if request.op == "intervene":
            return b"{}"
        if request.op != "advance":
            raise ForeshockError(f"no operation {request.op!r}; known: hello, reset, advance, intervene")
        if request.until_ns == self._last[0]:
            return self._last[1]
        if request.until_ns < self._last[0]:
            raise ForeshockError(f"time goes backwards: {request.until_ns} ns after {self._last[0]} ns")
        samples = pack_samples(self._twin.advance(request.until_ns), self._codec)
        answer = msgspec.json.encode(Stepped(samples, tuple(self._twin.events()), _finite(self._twin.probes())))
        self._last = (request.until_ns, answer)
        return answer


class FreeRunning:
    """A twin on this machine's clock: it streams, holds the lease through a guard, and obeys interventions.

    Without a lease it is at minimal risk: before the first, and after one that lapsed until the next.

    Args:
        twin: to host, reset already.
        robot: its name.
        link: how to join.
        base: folder that the paths of certificates start from.
    """

    def __init__(self, twin: Twin, robot: str, link: LinkSettings, base: Path | None = None) -> None:
        import zenoh

        self._twin, self._codec, self._lock = twin, Codec(), threading.Lock()
        self._waiting: list[Intervention] = []
        self._why, self._lapsed, self._asked = "no motion lease yet", False, 0.0
        name = str(wall_ns())
        self.guard = Guard(robot, self._intervened, self._minimal_risk, link, f"twin-{name}", base=base)
        self._session: Any = open_link(link, base)
        keys = keys_of(link, robot)
        self._gid = wall_ns().to_bytes(16, "little")
        hello = msgspec.json.encode(hello_of(twin, robot, "real"))
        key = keys.service(f"twin/{name}")
        self._hello = self._session.declare_queryable(key, lambda query: query.reply(key, hello))
        self._token = self._session.liveliness().declare_token(keys.alive("twin", name))
        self._tokens = ros_tokens(
            self._session, keys, "MP", {f"{robot}/{c.name}": BY_NAME[c.type] for c in twin.channels}
        )
        self._publishers = {
            f"{robot}/{c.name}": self._session.declare_publisher(
                keys.stream(f"{robot}/{c.name}", BY_NAME[c.type]),
                congestion_control=zenoh.CongestionControl.DROP,
                express=True,
            )
            for c in twin.channels
        }
        self._sequence = dict.fromkeys(self._publishers, 0)

    def run(self, stop: threading.Event, duration_s: float = float("inf")) -> float:
        """Run in real time until stop is set or the time is over; how late it was at worst, in s."""
        worst = 0
        with self.guard:
            began_ns, now_ns = monotonic_ns(), 0
            try:
                while not stop.is_set() and now_ns < duration_s * NS_PER_S:
                    now_ns += self._twin.period_ns
                    sleep_until(began_ns + now_ns)
                    worst = max(worst, monotonic_ns() - began_ns - now_ns)
                    self._step(now_ns, began_ns)
            finally:
                self._session.close()
        return worst / NS_PER_S

    def _step(self, now_ns: int, began_ns: int) -> None:
        with self._lock:
            waiting, self._waiting = self._waiting, []
            why, self._why = self._why, ""
        for intervention in waiting:
            if intervention.action == MINIMAL_RISK:
                self._asked = intervention.strength
            if not (self._lapsed and intervention.action == MINIMAL_RISK):
                self._twin.intervene(intervention)
        if why:
            self._lapsed = True
            self._twin.intervene(Intervention(now_ns, MINIMAL_RISK, 1.0, "", (why,)))
        elif self._lapsed and self.guard.permitted():
            # the lease is back: what its lapse asked for ends, unless the supervisor asks for it as well
            self._lapsed = False
            self._twin.intervene(Intervention(now_ns, MINIMAL_RISK, self._asked))
        for sample in self._twin.advance(now_ns):
            # simulated time began when the run did: stamps are on this machine's monotonic clock
            stamp_ns = began_ns + sample.stamp_ns
            self._sequence[sample.channel] += 1
            attachment = pack_attachment(self._sequence[sample.channel], stamp_ns, self._gid)
            payload = self._codec.encode(sample.value, stamp_ns)
            self._publishers[sample.channel].put(payload, attachment=attachment)

    def _intervened(self, intervention: Intervention) -> bool:
        with self._lock:
            self._waiting.append(intervention)
        return intervention.action in self._twin.actions

    def _minimal_risk(self, why: str) -> None:
        with self._lock:
            self._why = why


def _finite(probes: Mapping[str, float]) -> dict[str, float | None]:
    """JSON knows no NaN."""
    return {name: value if value == value and abs(value) != float("inf") else None for name, value in probes.items()}
