"""Cached layouts for the streams that come a thousand times a second: the numbers change, the bytes around them do not.

A layout is learnt from the reference codec: a message of the same shape with distinct marker numbers is encoded by it
once, and where the markers lie in the bytes, there the numbers go. So it cannot differ from the reference.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import msgspec

from foreshock.clock import NS_PER_S
from foreshock.messages import AnyMessage, Imu, JointState, Odometry, WrenchStamped

__all__ = ["HOT", "Layout", "learn"]

Numbers = tuple[float, ...]
STAMP = struct.Struct("<iI")
MOST_NUMBERS = 400
"""Learning takes time with their square: a message of 6,000 joints would stop the supervisor for 11 s."""
STAMP_AT = 4
"""The header's stamp comes first, after the four bytes that say CDR, little-endian."""


class Shape(msgspec.Struct, frozen=True):
    """How a message class is taken apart: what is constant, its numbers, and how both make a message again."""

    constant: Callable[[Any], tuple[Any, ...]]
    numbers: Callable[[Any], Numbers]
    make: Callable[[tuple[Any, ...], Numbers], AnyMessage]


def _joint_state(c: tuple[Any, ...], x: Numbers) -> JointState:
    name, n, v, _ = c
    return JointState(name, x[:n], x[n : n + v], x[n + v :])


HOT: Mapping[type, Shape] = {
    JointState: Shape(
        lambda m: (m.name, len(m.position), len(m.velocity), len(m.effort)),
        lambda m: m.position + m.velocity + m.effort,
        _joint_state,
    ),
    Imu: Shape(
        lambda m: (m.frame_id,),
        lambda m: m.orientation + m.angular_velocity + m.linear_acceleration,
        lambda c, x: Imu((x[0], x[1], x[2], x[3]), (x[4], x[5], x[6]), (x[7], x[8], x[9]), c[0]),
    ),
    WrenchStamped: Shape(
        lambda m: (m.frame_id,),
        lambda m: m.force + m.torque,
        lambda c, x: WrenchStamped((x[0], x[1], x[2]), (x[3], x[4], x[5]), c[0]),
    ),
    Odometry: Shape(
        lambda m: (m.frame_id, m.child_frame_id),
        lambda m: m.position + m.orientation + m.linear + m.angular,
        lambda c, x: Odometry(
            (x[0], x[1], x[2]), (x[3], x[4], x[5], x[6]), (x[7], x[8], x[9]), (x[10], x[11], x[12]), c[0], c[1]
        ),
    ),
}


class Layout:
    """Where the numbers of one shape lie.

    Args:
        shape: how to take the message apart.
        constant: what does not change.
        template: the encoded marker message.
        offsets: of each number in it.
    """

    def __init__(self, shape: Shape, constant: tuple[Any, ...], template: bytes, offsets: Sequence[int]) -> None:
        self._make, self._constant, self._template = shape.make, constant, template
        self._runs: list[tuple[int, int, int, struct.Struct]] = []
        for k, offset in enumerate(offsets):
            if self._runs and offset == self._runs[-1][0] + 8 * (k - self._runs[-1][1]):
                at, first, _, _ = self._runs.pop()
                self._runs.append((at, first, k + 1, struct.Struct(f"<{k + 1 - first}d")))
            else:
                self._runs.append((offset, k, k + 1, struct.Struct("<d")))
        self._fixed: list[tuple[int, int, bytes]] = []
        begin = STAMP_AT + STAMP.size
        for at, first, last, _ in self._runs:
            self._fixed.append((begin, at, template[begin:at]))
            begin = at + 8 * (last - first)
        self._fixed.append((begin, len(template), template[begin:]))
        self._fixed.append((0, STAMP_AT, template[:STAMP_AT]))

    def encode(self, numbers: Numbers, stamp_ns: int) -> bytes:
        """The message's bytes."""
        out = bytearray(self._template)
        STAMP.pack_into(out, STAMP_AT, *divmod(stamp_ns, NS_PER_S))
        for at, first, last, run in self._runs:
            run.pack_into(out, at, *numbers[first:last])
        return bytes(out)

    def decode(self, data: bytes) -> tuple[AnyMessage, int] | None:
        """Message and source time; None if the bytes are of another shape."""
        if len(data) != len(self._template):
            return None
        for begin, end, fixed in self._fixed:
            if data[begin:end] != fixed:
                return None
        sec, nanosec = STAMP.unpack_from(data, STAMP_AT)
        runs = self._runs
        if len(runs) == 1:
            numbers = runs[0][3].unpack_from(data, runs[0][0])
        else:
            numbers = tuple([x for at, _, _, run in runs for x in run.unpack_from(data, at)])
        return self._make(self._constant, numbers), sec * NS_PER_S + nanosec


def learn(message: AnyMessage, reference: Callable[[AnyMessage, int], bytes], like: bytes = b"") -> Layout | None:
    """The layout of messages of this shape; None if it has none: no numbers, or none that can be told apart.

    Args:
        message: of that shape.
        reference: the reference codec.
        like: bytes of such a message whose constants are kept: a peer's covariances, say, which our messages lack.
    """
    shape = HOT[type(message)]
    constant, n = shape.constant(message), len(shape.numbers(message))
    if n > MOST_NUMBERS:
        return None
    # exponents far from anything physical, so that no constant bytes equal a marker
    markers = tuple(struct.unpack("<d", struct.pack("<Q", 0x7A5A_0000_0000_0000 + 7919 * (k + 1)))[0] for k in range(n))
    template = reference(shape.make(constant, markers), 0)
    offsets = [template.find(struct.pack("<d", m)) for m in markers]
    if not n or min(offsets) < 0 or any(template.count(struct.pack("<d", m)) != 1 for m in markers):
        return None
    if like and len(like) != len(template):
        return None
    return Layout(shape, constant, like or template, offsets)
