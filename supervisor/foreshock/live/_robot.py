"""What goes to the robot's guards and comes back: leases, interventions until they are acknowledged."""

from __future__ import annotations

from typing import Any

import msgspec

from foreshock.clock import give_way
from foreshock.errors import WireError
from foreshock.guard._cdr import (
    Numbered,
    Request,
    pack_intervention,
    pack_lease,
    unpack_ack,
    unpack_request,
)
from foreshock.live._settings import LiveSettings
from foreshock.records import Decision, Intervention
from foreshock.supervisor import Supervisor
from foreshock.wire import Keys

__all__ = ["RobotLink"]

RING = 64
TWICE_NS = 1_000_000_000
"""Nobody moves for so long after the nonces of a guard that is there went back."""


class Pending(msgspec.Struct):
    """An intervention that not every guard has acknowledged: first sent, last sent, and who has acknowledged it."""

    numbered: Numbered
    first_ns: int
    last_ns: int
    by: set[str]


class Asking(msgspec.Struct):
    """A guard: when it was heard last, the nonce of its last request, and when its nonces went back last."""

    heard_ns: int
    nonce: int
    twice_ns: int = -TWICE_NS


class RobotLink:
    """The supervisor's end.

    Args:
        session: open Zenoh session.
        keys: of the robot.
        settings: how long things may take.
        epoch: of this supervisor.
    """

    def __init__(self, session: Any, keys: Keys, settings: LiveSettings, epoch: int) -> None:
        import zenoh

        def publisher(service: str) -> Any:
            return session.declare_publisher(
                keys.service(service),
                congestion_control=zenoh.CongestionControl.DROP,
                priority=zenoh.Priority.REAL_TIME,
                express=True,
            )

        self._settings, self._epoch = settings, epoch
        self._ttl_ns = round(settings.ttl_s * 1e9)
        self._lease, self._intervention = publisher("lease"), publisher("intervention")
        self._requests = session.declare_subscriber(keys.service("lease_request"), zenoh.handlers.RingChannel(RING))
        self._acks = session.declare_subscriber(keys.service("ack"), zenoh.handlers.RingChannel(RING))
        self._number = 0
        self._pending: dict[str, Pending] = {}
        self._active: dict[str, Numbered] = {}
        self._guards: dict[str, Asking] = {}
        self.unknown: dict[str, int] = {}
        self.garbage = 0
        self.granted = 0

    @property
    def guards(self) -> dict[str, int]:
        """When each guard was heard last, by name, on the supervisor's timeline."""
        return {name: guard.heard_ns for name, guard in self._guards.items()}

    def overdue(self, now_ns: int) -> list[str]:
        """Actions that a guard has not acknowledged in time: the robot may not know of them."""
        limit_ns = round(self._settings.ack_s * 1e9)
        return [action for action, p in self._pending.items() if now_ns - p.first_ns > limit_ns]

    def twice(self, now_ns: int) -> list[str]:
        """Guards whose nonces went back though they had just been heard: two of one name, or one that began again.

        An acknowledgement names its guard, so that one of two would answer for both.
        """
        return [name for name, guard in self._guards.items() if now_ns - guard.twice_ns < TWICE_NS]

    def tell(self, decision: Decision, now_ns: int) -> None:
        """Send what changed, and again what a guard has not acknowledged."""
        for change in decision.changes:
            self._send(change, now_ns)
        if decision.changes:
            give_way()  # Zenoh's thread sends; it may wait for this one's next pause, half a tick later
        again_ns = round(self._settings.resend_s * 1e9)
        for pending in self._pending.values():
            if now_ns - pending.last_ns >= again_ns:
                pending.last_ns = now_ns
                self._intervention.put(pack_intervention(pending.numbered))

    def _send(self, change: Intervention, now_ns: int) -> None:
        self._number += 1
        numbered = Numbered(self._epoch, self._number, change)
        if change.strength > 0.0:
            self._active[change.action] = numbered
        else:
            self._active.pop(change.action, None)
        # a newer word on an action takes the place of an older one, whose time to be heard runs on
        before = self._pending.get(change.action)
        self._pending[change.action] = Pending(numbered, now_ns if before is None else before.first_ns, now_ns, set())
        self._intervention.put(pack_intervention(numbered))

    def hear(self, now_ns: int) -> None:
        """Take acknowledgements."""
        for _ in range(RING):
            raw = self._acks.try_recv()
            if raw is None:
                break
            try:
                ack = unpack_ack(raw.payload.to_bytes())
            except WireError:
                self.garbage += 1
                continue
            if ack.epoch != self._epoch:
                continue
            if ack.guard not in self._guards:
                continue  # who never asked for a lease is no guard
            self._guards[ack.guard].heard_ns = now_ns
            for action, pending in self._pending.items():
                if pending.numbered.number == ack.number and ack.guard not in pending.by:
                    pending.by.add(ack.guard)
                    if not ack.understood:
                        self.unknown[action] = self.unknown.get(action, 0) + 1
        # one that is silent for longer than the time to live holds no lease
        present = {name for name, guard in self._guards.items() if now_ns - guard.heard_ns <= self._ttl_ns}
        self._pending = {a: p for a, p in self._pending.items() if not p.by or not p.by >= present}

    def grant(self, supervisor: Supervisor, now_ns: int, permitted: bool) -> None:
        """Answer requests for the lease; a guard that is new, or has begun again, is told of everything that holds.

        Args:
            supervisor: that grants.
            now_ns: on its timeline.
            permitted: nothing beside the supervisor forbids it.
        """
        for _ in range(RING):
            raw = self._requests.try_recv()
            if raw is None:
                return
            try:
                request = unpack_request(raw.payload.to_bytes())
            except WireError:
                self.garbage += 1
                continue
            self._meet(request, now_ns)
            lease = supervisor.lease(request.nonce, request.guard_ns, now_ns, self._settings.ttl_s)
            if permitted and lease is not None and not self.twice(now_ns):
                self.granted += 1
                self._lease.put(pack_lease(lease))

    def _meet(self, request: Request, now_ns: int) -> None:
        known = self._guards.get(request.guard)
        if known is None and len(self._guards) >= RING:
            del self._guards[min(self._guards, key=lambda g: self._guards[g].heard_ns)]
        asking = self._guards[request.guard] = Asking(now_ns, request.nonce)
        if known is not None:
            asking.twice_ns = known.twice_ns
            if now_ns - known.heard_ns <= self._ttl_ns:
                if request.nonce > known.nonce:
                    return
                asking.twice_ns = now_ns
        for action, numbered in self._active.items():
            pending = self._pending.setdefault(action, Pending(numbered, now_ns, now_ns, set()))
            pending.by.discard(request.guard)
            self._intervention.put(pack_intervention(numbered))
