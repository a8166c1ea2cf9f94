"""The four messages between guard and supervisor as little-endian CDR, with nothing but the standard library.

The robot's process needs no message library for them; the definitions are those of ``foreshock_msgs``.
"""

from __future__ import annotations

import struct

import msgspec

from foreshock.errors import WireError
from foreshock.records import Intervention, Lease

__all__ = [
    "Ack",
    "Numbered",
    "Request",
    "pack_ack",
    "pack_intervention",
    "pack_lease",
    "pack_request",
    "unpack_ack",
    "unpack_intervention",
    "unpack_lease",
    "unpack_request",
]

HEAD = b"\x00\x01\x00\x00"
MOST_TEXTS = 1000


class Request(msgspec.Struct, frozen=True):
    """foreshock_msgs/LeaseRequest: name of the guard, nonce, the guard's monotonic time."""

    guard: str
    nonce: int
    guard_ns: int


class Numbered(msgspec.Struct, frozen=True):
    """foreshock_msgs/Intervention: with the epoch of its supervisor and its number."""

    epoch: int
    number: int
    intervention: Intervention


class Ack(msgspec.Struct, frozen=True):
    """foreshock_msgs/InterventionAck: who took over which intervention, when, and whether it knows the action."""

    stamp_ns: int
    guard: str
    epoch: int
    number: int
    understood: bool


class _Out:
    """Appends values, aligned within the body."""

    def __init__(self) -> None:
        self._body = bytearray()

    def _align(self, n: int) -> None:
        self._body += bytes(-len(self._body) % n)

    def number(self, code: str, value: float) -> None:
        size = struct.calcsize(code)
        self._align(size)
        self._body += struct.pack(f"<{code}", value)

    def text(self, value: str) -> None:
        data = value.encode() + b"\0"
        self.number("I", len(data))
        self._body += data

    def header(self, stamp_ns: int) -> None:
        sec, nanosec = divmod(stamp_ns, 1_000_000_000)
        self.number("i", sec)
        self.number("I", nanosec)
        self.text("")

    def done(self) -> bytes:
        return HEAD + bytes(self._body)


class _In:
    """Takes values off."""

    def __init__(self, name: str, data: bytes) -> None:
        self._name, self._data, self._at = name, data[4:], 0
        if data[:2] != HEAD[:2]:
            self.fail("is no little-endian CDR")

    def fail(self, why: str) -> None:
        raise WireError(self._name, why)

    def number(self, code: str) -> float:
        size = struct.calcsize(code)
        at = self._at + -self._at % size
        if at + size > len(self._data):
            self.fail("is truncated")
        self._at = at + size
        value: float = struct.unpack_from(f"<{code}", self._data, at)[0]
        return value

    def integer(self, code: str) -> int:
        return int(self.number(code))

    def text(self) -> str:
        length = self.integer("I")
        end = self._at + length
        if length < 1 or end > len(self._data) or self._data[end - 1] != 0:
            self.fail("has a text that does not end where it says")
        raw = self._data[self._at : end - 1]
        self._at = end
        try:
            return raw.decode()
        except UnicodeDecodeError:
            self.fail("has a text that is not UTF-8")
            raise

    def header(self) -> int:
        sec, nanosec = self.integer("i"), self.integer("I")
        self.text()
        return sec * 1_000_000_000 + nanosec


def pack_request(request: Request) -> bytes:
    """A request as CDR."""
    out = _Out()
    out.text(request.guard)
    out.number("q", request.nonce)
    out.number("q", request.guard_ns)
    return out.done()


def unpack_request(data: bytes) -> Request:
    """The inverse.

    Raises:
        WireError: it is none.
    """
    take = _In("LeaseRequest", data)
    return Request(take.text(), take.integer("q"), take.integer("q"))


def pack_lease(lease: Lease) -> bytes:
    """A lease as CDR."""
    return HEAD + struct.pack("<4q", lease.epoch, lease.nonce, lease.guard_ns, lease.ttl_ns)


def unpack_lease(data: bytes) -> Lease:
    """The inverse.

    Raises:
        WireError: it is none.
    """
    take = _In("Lease", data)
    return Lease(take.integer("q"), take.integer("q"), take.integer("q"), take.integer("q"))


def pack_intervention(numbered: Numbered) -> bytes:
    """An intervention as CDR."""
    i = numbered.intervention
    out = _Out()
    out.header(i.stamp_ns)
    out.number("q", numbered.epoch)
    out.number("q", numbered.number)
    out.text(i.action)
    out.number("d", i.strength)
    out.text(i.mode)
    out.number("I", len(i.reasons))
    for reason in i.reasons:
        out.text(reason)
    return out.done()


def unpack_intervention(data: bytes) -> Numbered:
    """The inverse.

    Raises:
        WireError: it is none.
    """
    take = _In("Intervention", data)
    stamp_ns, epoch, number = take.header(), take.integer("q"), take.integer("q")
    action, strength, mode = take.text(), take.number("d"), take.text()
    count = take.integer("I")
    if count > MOST_TEXTS:
        take.fail(f"has {count} reasons")
    if not 0.0 <= strength <= 1.0:
        take.fail(f"has the strength {strength!r}, 0..1 is expected")
    reasons = tuple(take.text() for _ in range(count))
    return Numbered(epoch, number, Intervention(stamp_ns, action, strength, mode, reasons))


def pack_ack(ack: Ack) -> bytes:
    """An acknowledgement as CDR."""
    out = _Out()
    out.header(ack.stamp_ns)
    out.text(ack.guard)
    out.number("q", ack.epoch)
    out.number("q", ack.number)
    out.number("?", ack.understood)
    return out.done()


def unpack_ack(data: bytes) -> Ack:
    """The inverse.

    Raises:
        WireError: it is none.
    """
    take = _In("InterventionAck", data)
    return Ack(take.header(), take.text(), take.integer("q"), take.integer("q"), bool(take.number("?")))
