"""The lease as docs/wire.md and rule 5 of the design state it, against the guard that holds it.

Written from the specification alone: *motion is permitted until the time of the request + time to live, on the
guard's clock. A guard takes a lease only in answer to a request of its own (nonce and time match), not from a lower
epoch than it has seen, and for at most the time that it allows itself.* Where the text leaves a choice (the instant of
expiry itself; an answer that a newer one overtook) both are accepted.
"""

from __future__ import annotations

import hypothesis.strategies as st
import pytest
from hypothesis import settings
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from foreshock.errors import ConfigError
from foreshock.guard import MotionGuard
from foreshock.records import Lease

MS = 1_000_000
INT64 = st.integers(-(2**63), 2**63 - 1)


class LeaseModel(RuleBasedStateMachine):
    """A guard, supervisors that echo what they are asked, and a network that delays, doubles, reorders and forges."""

    @initialize(start_ns=st.integers(0, 2**61), max_ttl_ns=st.integers(1, 2_000 * MS))
    def begin(self, start_ns: int, max_ttl_ns: int) -> None:
        self.now_ns, self.max_ttl_ns = start_ns, max_ttl_ns
        self.guard = MotionGuard(max_ttl_ns)
        self.asked: list[tuple[int, int]] = []
        self.flying: list[Lease] = []
        self.epoch_taken: int | None = None
        self.epoch_seen: int | None = None
        self.newest_ns = -1
        self.at_most_ns = self.at_least_ns = start_ns - 1
        """Motion is not permitted later than the first, and is permitted before the second."""

    @rule(dt_ns=st.one_of(st.integers(0, 40 * MS), st.integers(0, 3_000 * MS), st.sampled_from([0, 1])))
    def time_passes(self, dt_ns: int) -> None:
        self.now_ns += dt_ns

    @rule()
    def to_the_end_of_the_permission(self) -> None:
        self.now_ns = max(self.now_ns, self.at_most_ns)

    @rule()
    def ask(self) -> None:
        request = self.guard.request(self.now_ns)
        assert request[1] == self.now_ns, "it sends its own time"
        assert request[0] not in {nonce for nonce, _ in self.asked}, "a nonce is used once"
        self.asked.append(request)

    @precondition(lambda self: self.asked)
    @rule(back=st.integers(0, 40), epoch=st.integers(1, 4), ttl_ns=st.integers(-1, 2_500 * MS))
    def a_supervisor_answers(self, back: int, epoch: int, ttl_ns: int) -> None:
        nonce, guard_ns = self.asked[-1 - back % len(self.asked)]
        self.flying.append(Lease(epoch, nonce, guard_ns, ttl_ns))

    @precondition(lambda self: self.asked)
    @rule(back=st.integers(0, 3), epoch=st.integers(1, 9), shift_ns=st.integers(-2_000 * MS, 2_000 * MS))
    def somebody_alters_the_time(self, back: int, epoch: int, shift_ns: int) -> None:
        nonce, guard_ns = self.asked[-1 - back % len(self.asked)]
        self.flying.append(Lease(epoch, nonce, guard_ns + shift_ns, 100 * MS))

    @precondition(lambda self: self.asked)
    @rule(shift=st.integers(-3, 3), epoch=st.integers(1, 9))
    def somebody_alters_the_nonce(self, shift: int, epoch: int) -> None:
        nonce, guard_ns = self.asked[-1]
        self.flying.append(Lease(epoch, nonce + shift, guard_ns, 100 * MS))

    @rule(epoch=INT64, nonce=INT64, guard_ns=INT64, ttl_ns=INT64)
    def somebody_forges(self, epoch: int, nonce: int, guard_ns: int, ttl_ns: int) -> None:
        self.flying.append(Lease(epoch, nonce, guard_ns, ttl_ns))

    @rule(epoch=st.integers(0, 4))
    def a_supervisor_of_some_epoch_is_heard(self, epoch: int) -> None:
        """By an intervention: leases of an older one are refused from now on."""
        seen = self.epoch_taken if self.epoch_taken is not None else -1
        assert self.guard.fence(epoch) == (epoch >= seen)
        if epoch >= seen:
            self.epoch_taken = epoch
            self.epoch_seen = max(epoch, self.epoch_seen if self.epoch_seen is not None else epoch)

    @precondition(lambda self: self.flying)
    @rule(which=st.integers(0, 1_000), again=st.booleans())
    def a_lease_arrives(self, which: int, again: bool) -> None:
        k = which % len(self.flying)
        self.deliver(self.flying[k] if again else self.flying.pop(k))

    @precondition(lambda self: self.asked)
    @rule(epoch=st.integers(1, 4), ttl_ns=st.integers(1, 2_000 * MS))
    def the_newest_request_is_answered_at_once(self, epoch: int, ttl_ns: int) -> None:
        self.deliver(Lease(epoch, *self.asked[-1], ttl_ns))

    def deliver(self, lease: Lease) -> None:
        answers = (lease.nonce, lease.guard_ns) in self.asked
        valid = answers and 0 < lease.ttl_ns <= self.max_ttl_ns
        fenced = self.epoch_taken is not None and lease.epoch < self.epoch_taken
        newest_ns = self.newest_ns
        taken = self.guard.receive(lease)
        if taken:
            assert answers, "no answer to a request of its own"
            assert lease.ttl_ns <= self.max_ttl_ns, "longer than it allows itself"
            assert not fenced, "a lower epoch than it has seen"
            self.at_most_ns = max(self.at_most_ns, lease.guard_ns + lease.ttl_ns)
            self.epoch_taken = lease.epoch
            self.newest_ns = max(self.newest_ns, lease.guard_ns)  # a request is answered once
        surely = valid and lease.epoch >= 0 and (self.epoch_seen is None or lease.epoch >= self.epoch_seen)
        young = self.now_ns < lease.guard_ns + lease.ttl_ns
        if surely and young and lease.guard_ns > newest_ns:
            assert taken, "an answer in time, from the highest epoch, newer than any other"
            self.at_least_ns = lease.guard_ns + lease.ttl_ns
        self.epoch_seen = max(lease.epoch, self.epoch_seen if self.epoch_seen is not None else lease.epoch)

    @invariant()
    def permission_is_as_long_as_was_granted(self) -> None:
        if not hasattr(self, "guard"):
            return
        for now_ns in (self.now_ns, self.at_most_ns + 1, self.at_most_ns + 10**12):
            if now_ns > self.at_most_ns:
                assert not self.guard.permitted(now_ns), "after the end"
        if self.now_ns < self.at_least_ns:
            assert self.guard.permitted(self.now_ns), "granted and not yet over"


LeaseModel.TestCase.settings = settings(max_examples=300, stateful_step_count=40, deadline=None)
TestLeaseModel = LeaseModel.TestCase


def test_nothing_is_permitted_before_a_lease() -> None:
    guard = MotionGuard()
    assert not guard.permitted(0)
    guard.request(5)
    assert not guard.permitted(5)
    assert not guard.permitted(0)


def test_a_round_trip_longer_than_the_period_of_asking_still_renews() -> None:
    """Asked every 20 ms, answered 70 ms later, time to live 100 ms: 30 ms are left of each, and they overlap."""
    guard, flying = MotionGuard(), []
    for k in range(50):
        now_ns = k * 20 * MS
        flying.append(guard.request(now_ns))
        if k >= 4:  # the request of 80 ms ago is answered
            nonce, guard_ns = flying[k - 4]
            assert guard.receive(Lease(1, nonce, guard_ns, 100 * MS))
            assert guard.permitted(now_ns)
            assert guard.permitted(now_ns + 19 * MS)
            assert not guard.permitted(guard_ns + 100 * MS + 1)


def test_a_delayed_lease_never_renews() -> None:
    guard = MotionGuard()
    nonce, guard_ns = guard.request(0)
    guard.receive(Lease(1, nonce, guard_ns, 100 * MS))  # whenever this was: only the time of asking counts
    assert not guard.permitted(101 * MS)
    guard.receive(Lease(1, nonce, guard_ns, 100 * MS))
    assert not guard.permitted(101 * MS)


def test_another_guards_lease_is_not_mine() -> None:
    mine, other = MotionGuard(), MotionGuard()
    mine.request(1_000)
    nonce, guard_ns = other.request(2_000)
    assert not mine.receive(Lease(1, nonce, guard_ns, 100 * MS))
    assert not mine.permitted(2_001)


def test_a_guard_that_begins_again_takes_nothing_of_its_former_life() -> None:
    before = MotionGuard()
    leases = [Lease(1, *before.request(k), 100 * MS) for k in range(20)]
    after = MotionGuard()
    for k in range(20):
        after.request(1_000 + k)
    assert not any(after.receive(lease) for lease in leases)
    assert not after.permitted(1_020)


@pytest.mark.parametrize("max_ttl_ns", [0, -1, 1.5, float("nan"), True])
def test_it_allows_itself_a_whole_positive_time(max_ttl_ns: object) -> None:
    with pytest.raises(ConfigError, match="max_ttl_ns"):
        MotionGuard(max_ttl_ns)  # type: ignore[arg-type]


def test_many_requests_without_an_answer_take_bounded_memory() -> None:
    guard = MotionGuard()
    for k in range(100_000):
        guard.request(k * 20 * MS)
    kept = sum(len(v) for v in vars(guard).values() if hasattr(v, "__len__"))
    assert kept < 1_000
