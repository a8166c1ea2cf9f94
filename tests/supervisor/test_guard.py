"""Rule 5: a dead, slow, second or lying supervisor never prolongs the permission to move."""

from __future__ import annotations

from typing import Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from foreshock.errors import ConfigError
from foreshock.guard import MotionGuard
from foreshock.records import Lease

MS = 1_000_000
TTL = 100 * MS


def answer(nonce: int, guard_ns: int, epoch: int = 0, ttl_ns: int = TTL) -> Lease:
    return Lease(epoch, nonce, guard_ns, ttl_ns)


def test_nothing_is_permitted_before_the_first_lease() -> None:
    guard = MotionGuard()
    guard.request(0)
    assert not guard.permitted(0)


def test_permission_ends_at_guard_time_plus_time_to_live() -> None:
    guard = MotionGuard()
    assert guard.receive(answer(*guard.request(1000 * MS)))
    assert guard.permitted(1000 * MS)
    assert guard.permitted(1100 * MS - 1)
    assert not guard.permitted(1100 * MS)
    assert not guard.permitted(5000 * MS)


def test_a_delayed_lease_never_renews() -> None:
    """It counts from the request: an answer that took longer than its time to live permits nothing."""
    guard = MotionGuard()
    lease = answer(*guard.request(0))
    guard.receive(lease)
    assert not guard.permitted(150 * MS)


def test_a_lease_is_taken_once() -> None:
    guard = MotionGuard()
    lease = answer(*guard.request(0))
    assert guard.receive(lease)
    assert not guard.receive(lease)


def test_an_answer_to_an_older_request_is_refused_after_a_newer_one() -> None:
    guard = MotionGuard()
    old, new = guard.request(0), guard.request(50 * MS)
    assert guard.receive(answer(*new))
    assert not guard.receive(answer(*old))


def test_wrong_nonce_altered_time_and_no_time_to_live_are_refused() -> None:
    guard = MotionGuard()
    nonce, at = guard.request(1000 * MS)
    for forged in (answer(nonce + 1, at), answer(nonce, at + 1), answer(nonce, at, ttl_ns=0), answer(nonce, at, 0, -1)):
        assert not guard.receive(forged)
        assert not guard.permitted(at)
    assert guard.receive(answer(nonce, at))  # the forgeries have not used it up


def test_an_older_epoch_is_fenced_off() -> None:
    guard = MotionGuard()
    assert guard.receive(answer(*guard.request(0), epoch=2))
    assert not guard.receive(answer(*guard.request(50 * MS), epoch=1))
    assert not guard.permitted(120 * MS)
    assert guard.receive(answer(*guard.request(130 * MS), epoch=3))


EVENTS = st.lists(
    st.tuples(
        st.sampled_from(["ask", "deliver", "replay", "forge-nonce", "forge-time", "stale-epoch"]),
        st.integers(1, 80),
        st.integers(0, 9),
    ),
    max_size=60,
)


@given(EVENTS)
def test_permission_never_outlives_an_honest_answer_to_its_own_request(events: list[tuple[str, int, int]]) -> None:
    """Under any interleaving of delay, loss, replay and forgery, the bound is the newest answered request + ttl."""
    guard, now, sent, given_, bound = MotionGuard(), 0, [], [], -1
    guard.receive(answer(*guard.request(0), epoch=5))
    bound = TTL
    for what, gap, pick in events:
        now += gap * MS
        if what == "ask":
            sent.append(guard.request(now))
        elif what == "replay" and given_:
            assert not guard.receive(given_[pick % len(given_)])
        elif sent:
            nonce, at = sent[pick % len(sent)]
            lease = answer(nonce, at, epoch=5)
            if what == "deliver":
                if guard.receive(lease):
                    bound = max(bound, at + TTL)
                    given_.append(lease)
                    sent = [s for s in sent if s[0] > nonce]
            elif what == "forge-nonce":
                assert not guard.receive(msgspec.structs.replace(lease, nonce=nonce + 1000))
            elif what == "forge-time":
                assert not guard.receive(msgspec.structs.replace(lease, guard_ns=at + 1))
            elif what == "stale-epoch":
                assert not guard.receive(msgspec.structs.replace(lease, epoch=4))
        assert guard.permitted(now) is (now < bound)


def test_many_unanswered_requests_do_not_grow_without_bound_and_the_newest_still_counts() -> None:
    guard = MotionGuard()
    for k in range(10_000):
        last = guard.request(k * MS)
    assert guard.receive(answer(*last))
    assert guard.permitted(9_999 * MS)


def test_a_lease_that_lives_longer_than_allowed_is_refused() -> None:
    guard = MotionGuard()
    nonce, at = guard.request(0)
    assert not guard.receive(answer(nonce, at, ttl_ns=1_000_000_001))
    assert not guard.receive(answer(nonce, at, ttl_ns=10**18))
    assert not guard.permitted(0)
    assert guard.receive(answer(nonce, at, ttl_ns=1_000_000_000))
    strict = MotionGuard(max_ttl_ns=50 * MS)
    assert not strict.receive(answer(*strict.request(0)))


@pytest.mark.parametrize("field", ["epoch", "nonce", "guard_ns", "ttl_ns"])
@pytest.mark.parametrize("value", [float("nan"), None, "1", True])
def test_a_lease_of_no_type_is_refused_and_does_not_unfence(field: str, value: Any) -> None:
    guard = MotionGuard()
    assert guard.receive(answer(*guard.request(0), epoch=2))
    forged = msgspec.structs.replace(answer(*guard.request(50 * MS), epoch=2), **{field: value})
    assert not guard.receive(forged)
    assert not guard.receive(answer(*guard.request(60 * MS), epoch=1))
    assert not guard.permitted(TTL)


@pytest.mark.parametrize("value", [0, -1, 1e9, float("inf"), True])
def test_a_bound_that_is_none_is_refused(value: Any) -> None:
    with pytest.raises(ConfigError, match=r"guard\.max_ttl_ns"):
        MotionGuard(max_ttl_ns=value)
