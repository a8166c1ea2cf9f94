"""The robot's side of the link: it holds the lease, takes over interventions, and ends motion by itself.

    guard = Guard("talos", on_intervention=apply, on_minimal_risk=stop)
    with guard:
        while running:
            if guard.permitted():
                move()

Threads: one asks for the lease and watches it expire; one each waits for leases and for interventions. None of them
needs the control loop, and the control loop waits for none of them.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import msgspec

from foreshock.clock import monotonic_ns, ns
from foreshock.errors import WireError
from foreshock.guard._cdr import Ack, Request, pack_ack, pack_request, unpack_intervention, unpack_lease
from foreshock.guard._motion import MotionGuard
from foreshock.link import DEFAULT_ENDPOINT, LinkSettings, keys_of, open_link
from foreshock.records import Intervention

__all__ = ["Guard", "GuardCounts"]

PATIENT = LinkSettings("peer", (), (DEFAULT_ENDPOINT,))
"""A guard may start before its supervisor."""


class GuardCounts(msgspec.Struct):
    """What a guard has seen: leases taken and refused, interventions taken, repeated and fenced, garbage, expiries."""

    leases: int = 0
    refused: int = 0
    interventions: int = 0
    repeated: int = 0
    fenced: int = 0
    garbage: int = 0
    expiries: int = 0


class Guard:
    """Permission to move, and interventions, in the robot's process.

    Args:
        robot: its name.
        on_intervention: called for each intervention, from the guard's thread; what it gives says whether the action is
            known. An exception counts as unknown.
        on_minimal_risk: called once when the lease expires, with the reason, from the guard's own thread. The control
            loop polls permitted() besides: whichever is first.
        link: how to reach the supervisor; the default is this machine's.
        name: of this guard, unique for the robot: while two have one name, neither gets a lease.
        period_s: how often it asks for a lease.
        max_ttl_s: a lease that wants to live longer is refused.
        base: folder that the paths of certificates start from.
    """

    def __init__(
        self,
        robot: str,
        on_intervention: Callable[[Intervention], bool],
        on_minimal_risk: Callable[[str], None],
        link: LinkSettings = PATIENT,
        name: str = "guard",
        period_s: float = 0.02,
        max_ttl_s: float = 1.0,
        base: Path | None = None,
    ) -> None:
        self._keys, self._link, self._base = keys_of(link, robot), link, base
        self._on_intervention, self._on_minimal_risk = on_intervention, on_minimal_risk
        self._name, self._period_ns = name, ns(period_s)
        self._lease = MotionGuard(ns(max_ttl_s))
        self._lock = threading.Lock()
        self._renewed = threading.Event()
        self._ended = threading.Event()
        self._threads: list[threading.Thread] = []
        self._session: Any = None
        self._told_epoch = -1
        self._done: dict[int, bool] = {}
        self._newest: dict[str, int] = {}
        self.counts = GuardCounts()

    def permitted(self) -> bool:
        """Whether the robot may move now."""
        return self._lease.permitted(monotonic_ns())

    def start(self) -> None:
        """Open the link and begin to ask.

        Raises:
            BadInputError: a certificate is missing; a supervisor that is not there yet is no error.
        """
        import zenoh

        self._session = session = open_link(self._link, self._base)
        self._ask, self._ack = (
            session.declare_publisher(
                self._keys.service(service), congestion_control=zenoh.CongestionControl.DROP, express=True
            )
            for service in ("lease_request", "ack")
        )
        self._token = session.liveliness().declare_token(self._keys.alive("guard", self._name))
        for service, take in (("lease", self._take_lease), ("intervention", self._take_intervention)):
            subscriber = session.declare_subscriber(self._keys.service(service), zenoh.handlers.RingChannel(64))
            self._spawn(self._listen, subscriber, take)
        self._spawn(self._watch)

    def close(self) -> None:
        """End motion permission by no longer asking, and close the link; idempotent."""
        self._ended.set()
        self._renewed.set()
        if self._session is not None:
            self._session.close()
            self._session = None
        for thread in self._threads:
            if thread is not threading.current_thread():
                thread.join(2.0)

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close()

    def _spawn(self, body: Callable[..., None], *given: Any) -> None:
        thread = threading.Thread(target=body, args=given, name=f"foreshock-{self._name}", daemon=True)
        self._threads.append(thread)
        thread.start()

    def _listen(self, subscriber: Any, take: Callable[[bytes], None]) -> None:
        while not self._ended.is_set():
            try:
                sample = subscriber.recv()
            except Exception:  # noqa: BLE001 # the session was closed: zenoh has one error for everything
                return
            try:
                take(sample.payload.to_bytes())
            except WireError:
                self.counts.garbage += 1

    def _take_lease(self, data: bytes) -> None:
        lease = unpack_lease(data)
        with self._lock:
            if self._lease.receive(lease):
                self.counts.leases += 1
                self._renewed.set()
            else:
                self.counts.refused += 1

    def _take_intervention(self, data: bytes) -> None:
        numbered = unpack_intervention(data)
        epoch, number, intervention = numbered.epoch, numbered.number, numbered.intervention
        with self._lock:
            if not self._lease.fence(epoch):
                self.counts.fenced += 1
                return
        if epoch != self._told_epoch:  # another supervisor, which counts from 1 again
            self._told_epoch = epoch
            self._done, self._newest = {}, {}
        if number in self._done:
            self.counts.repeated += 1
        else:
            # one that was overtaken by a newer word on the same action is acknowledged, but no longer applied
            overtaken = self._newest.get(intervention.action, -1) > number
            self._done[number] = overtaken or self._apply(intervention)
            self._newest[intervention.action] = max(number, self._newest.get(intervention.action, -1))
            self.counts.interventions += 1
            if len(self._done) > 4096:
                del self._done[min(self._done)]
        ack = Ack(monotonic_ns(), self._name, epoch, number, self._done[number])
        self._put(self._ack, pack_ack(ack))

    def _apply(self, intervention: Intervention) -> bool:
        try:
            return bool(self._on_intervention(intervention))
        except Exception:  # noqa: BLE001 # the robot's own code: it must not end the guard
            return False

    def _put(self, publisher: Any, data: bytes) -> None:
        if not self._ended.is_set():
            try:
                publisher.put(data)
            except Exception:  # noqa: BLE001 # as above: the session was closed
                self._ended.set()

    def _watch(self) -> None:
        """Ask for a lease every period; tell of its end, once."""
        moving, next_ns = False, monotonic_ns()
        while not self._ended.is_set():
            now_ns = monotonic_ns()
            if now_ns >= next_ns:
                with self._lock:
                    nonce, guard_ns = self._lease.request(now_ns)
                self._put(self._ask, pack_request(Request(self._name, nonce, guard_ns)))
                next_ns = max(next_ns + self._period_ns, now_ns)
            if self._lease.permitted(now_ns):
                moving = True
            elif moving:
                moving = False
                self.counts.expiries += 1
                self._tell("the motion lease has expired")
            until_ns = min(next_ns, self._lease.until_ns if moving else next_ns)
            self._renewed.wait(max(0.0, (until_ns - monotonic_ns()) / 1e9))
            self._renewed.clear()
        if moving:
            self._tell("the guard was closed")

    def _tell(self, why: str) -> None:
        with suppress(Exception):  # the robot's own code must not end the guard; permitted() is False all the same
            self._on_minimal_risk(why)
