"""Supervisors that follow each other, guards that begin again, and more than one guard."""

from __future__ import annotations

import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

sys.path.append(str(Path(__file__).parent))
from robot import Robot, free_endpoint, supervisor, until

from foreshock.guard import Guard
from foreshock.guard._cdr import Numbered, Request, pack_intervention, pack_lease, pack_request, unpack_request
from foreshock.link import LinkSettings, open_link
from foreshock.records import Intervention, Lease
from foreshock.wire import Keys

pytest.importorskip("zenoh")
KEYS = Keys("robot")


class Sender:
    """Speaks as supervisors of any epoch do: grants what is asked for, sends what it is told to."""

    def __init__(self, session: Any) -> None:
        self._session, self.epoch = session, 0
        self._subscriber = session.declare_subscriber(KEYS.service("lease_request"), self._grant)

    def _grant(self, sample: Any) -> None:
        if self.epoch:
            request = unpack_request(sample.payload.to_bytes())
            lease = Lease(self.epoch, request.nonce, request.guard_ns, 10**9)
            self._session.put(KEYS.service("lease"), pack_lease(lease))

    def tell(self, epoch: int, number: int, action: str) -> None:
        numbered = Numbered(epoch, number, Intervention(0, action, 1.0))
        self._session.put(KEYS.service("intervention"), pack_intervention(numbered))


@contextmanager
def met() -> Iterator[tuple[Sender, Guard, list[str]]]:
    """A guard, what speaks to it as a supervisor, and the actions it was told."""
    endpoint, told = free_endpoint(), list[str]()
    guard = Guard(
        "robot", lambda i: told.append(i.action) is None, lambda _: None, LinkSettings("peer", (), (endpoint,))
    )
    session: Any = open_link(LinkSettings("router", (endpoint,)))
    with session, guard:
        yield Sender(session), guard, told


def test_the_next_supervisor_counts_from_one_again_and_is_obeyed() -> None:
    """Its lease comes before its first intervention, whose number the guard knows from the supervisor before it."""
    with met() as (sender, guard, told):
        sender.epoch = 1
        until(guard.permitted, "a lease of the first")
        sender.tell(1, 1, "derate")
        sender.tell(1, 2, "announce")
        until(lambda: told == ["derate", "announce"], "the first is obeyed")
        sender.epoch = 2
        leases = guard.counts.leases
        until(lambda: guard.counts.leases > leases + 2, "leases of the second")
        sender.tell(2, 1, "minimal-risk")
        until(lambda: told[-1] == "minimal-risk", "the second is obeyed")
        sender.tell(1, 3, "late")
        until(lambda: guard.counts.fenced == 1, "the first is no longer heard")
        assert told == ["derate", "announce", "minimal-risk"]


def test_an_intervention_of_the_next_supervisor_ends_the_leases_of_the_one_before() -> None:
    with met() as (sender, guard, told):
        sender.epoch = 1
        until(guard.permitted, "a lease of the first")
        sender.tell(2, 1, "minimal-risk")
        until(lambda: told == ["minimal-risk"], "the second is heard")
        until(lambda: not guard.permitted(), "the first grants on, in vain")
        assert guard.counts.refused > 0


def test_a_guard_that_begins_again_is_told_what_holds(tmp_path: Path) -> None:
    endpoint = free_endpoint()
    with supervisor(tmp_path, endpoint), Robot(endpoint) as robot:
        until(robot.guard.permitted, "the robot may move")
        robot.streaming = False
        until(lambda: robot.told("minimal-risk") == [1.0], "the minimal risk condition, which stays latched")
        robot.guard.close()
        told: list[str] = []
        with Guard("robot", lambda i: told.append(i.action) is None, lambda _: None, robot.link, "g1"):
            until(lambda: "minimal-risk" in told, "the robot's process began again: it is told")
            until(lambda: (s := robot.status()) and not s.unacknowledged, "and has acknowledged")


def test_every_guard_must_acknowledge(tmp_path: Path) -> None:
    endpoint, ended = free_endpoint(), threading.Event()
    with supervisor(tmp_path, endpoint), Robot(endpoint) as robot:
        until(robot.guard.permitted, "the robot may move")

        def ask() -> None:  # for leases, as a guard whose other half has died
            k = 0
            while not ended.wait(0.02):
                k += 1
                robot.session.put(KEYS.service("lease_request"), pack_request(Request("deaf", k, k)))

        thread = threading.Thread(target=ask)
        thread.start()
        try:
            until(lambda: (s := robot.status()) and "deaf" in s.guards, "a second guard")
            robot.streaming = False
            until(lambda: robot.told("minimal-risk"), "the first is told, and acknowledges")
            until(lambda: (s := robot.status()) and "minimal-risk" in s.unacknowledged, "the second does not")
        finally:
            ended.set()
            thread.join()
        until(lambda: (s := robot.status()) and not s.unacknowledged, "it is gone: it holds no lease any more")


def test_two_guards_of_one_name_keep_each_other_from_moving(tmp_path: Path) -> None:
    """What one acknowledges says nothing of the other, and the supervisor knows them by their name."""
    endpoint = free_endpoint()
    with supervisor(tmp_path, endpoint), Robot(endpoint) as robot:
        until(robot.guard.permitted, "the robot may move")
        with Guard("robot", lambda _: True, lambda _: None, robot.link, "g1") as second:
            until(lambda: not robot.guard.permitted(), "the first may not move")
            status = until(lambda: (s := robot.status()) and s.withheld and s, "the status says why")
            assert status.withheld == "two guards are called 'g1', or it has begun again within 1 s"
            assert not status.motion_permitted
            leases = (robot.guard.counts.leases, second.counts.leases)
            tick = status.tick
            until(lambda: (s := robot.status()) and s.tick > tick + 100, "neither gets a lease for a second")
            assert (robot.guard.counts.leases, second.counts.leases) == leases
            assert not second.permitted()
        until(robot.guard.permitted, "the second has gone")
        with Guard("robot", lambda _: True, lambda _: None, robot.link, "g2") as second:
            until(second.permitted, "one of another name may move")
            assert robot.guard.permitted()
