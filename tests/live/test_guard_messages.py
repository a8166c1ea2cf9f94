"""The guard's own CDR is that of rosbags, byte for byte; garbage is refused."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from foreshock.errors import WireError
from foreshock.guard._cdr import (
    Ack,
    Numbered,
    Request,
    pack_ack,
    pack_intervention,
    pack_lease,
    pack_request,
    unpack_ack,
    unpack_intervention,
    unpack_lease,
    unpack_request,
)
from foreshock.records import Intervention, Lease
from foreshock.wire import encode_ros, ros_type

LONG = st.integers(-(2**63), 2**63 - 1)
TEXT = st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\0"), max_size=12)
STAMP = st.integers(0, (2**31 - 1) * 10**9)


def header(stamp_ns: int) -> object:
    sec, nanosec = divmod(stamp_ns, 10**9)
    time = ros_type("builtin_interfaces/msg/Time")(sec=sec, nanosec=nanosec)
    return ros_type("std_msgs/msg/Header")(stamp=time, frame_id="")


def ros(name: str, **fields: object) -> bytes:
    full = f"foreshock_msgs/msg/{name}"
    return encode_ros(full, ros_type(full)(**fields))


@given(TEXT, LONG, LONG)
def test_requests(guard: str, nonce: int, guard_ns: int) -> None:
    data = pack_request(Request(guard, nonce, guard_ns))
    assert data == ros("LeaseRequest", guard=guard, nonce=nonce, guard_ns=guard_ns)
    assert unpack_request(data) == Request(guard, nonce, guard_ns)


@given(LONG, LONG, LONG, LONG)
def test_leases(epoch: int, nonce: int, guard_ns: int, ttl_ns: int) -> None:
    data = pack_lease(Lease(epoch, nonce, guard_ns, ttl_ns))
    assert data == ros("Lease", epoch=epoch, nonce=nonce, guard_ns=guard_ns, ttl_ns=ttl_ns)
    assert unpack_lease(data) == Lease(epoch, nonce, guard_ns, ttl_ns)


@given(STAMP, LONG, LONG, TEXT, st.floats(0.0, 1.0), TEXT, st.lists(TEXT, max_size=4))
def test_interventions(
    stamp_ns: int, epoch: int, number: int, action: str, strength: float, mode: str, reasons: list[str]
) -> None:
    numbered = Numbered(epoch, number, Intervention(stamp_ns, action, strength, mode, tuple(reasons)))
    data = pack_intervention(numbered)
    assert data == ros(
        "Intervention",
        header=header(stamp_ns),
        epoch=epoch,
        number=number,
        action=action,
        strength=strength,
        mode=mode,
        reasons=reasons,
    )
    assert unpack_intervention(data) == numbered


@given(STAMP, TEXT, LONG, LONG, st.booleans())
def test_acknowledgements(stamp_ns: int, guard: str, epoch: int, number: int, understood: bool) -> None:
    ack = Ack(stamp_ns, guard, epoch, number, understood)
    data = pack_ack(ack)
    assert data == ros(
        "InterventionAck", header=header(stamp_ns), guard=guard, epoch=epoch, number=number, understood=understood
    )
    assert unpack_ack(data) == ack


@pytest.mark.parametrize("unpack", [unpack_request, unpack_lease, unpack_intervention, unpack_ack])
@given(st.binary(max_size=80))
def test_garbage_is_a_wire_error_or_a_message(unpack: Callable[[bytes], object], data: bytes) -> None:
    for given_ in (data, b"\x00\x01\x00\x00" + data):
        try:
            unpack(given_)
        except WireError:
            continue
        assert given_[:2] == b"\x00\x01"


def test_a_strength_that_is_none_is_refused() -> None:
    good = pack_intervention(Numbered(1, 1, Intervention(0, "hold", 1.0)))
    for strength in (float("nan"), -0.1, 1.1, float("inf")):
        bad = pack_intervention(Numbered(1, 1, Intervention(0, "hold", strength)))
        assert len(bad) == len(good)
        with pytest.raises(WireError, match="strength"):
            unpack_intervention(bad)
