"""CDR by rosbags, and by cached layouts for the hot types."""

from __future__ import annotations

from typing import Any

from foreshock.errors import WireError
from foreshock.messages import AnyMessage
from foreshock.wire._hot import HOT, Layout, learn
from foreshock.wire._ros import BY_ROS, ROS_NAMES, from_ros, stamp_of, to_ros
from foreshock.wire._types import typestore

__all__ = ["MAX_BYTES", "Codec", "decode_reference", "decode_ros", "encode_reference", "encode_ros"]

MAX_BYTES = 250_000
"""A payload longer than this is refused unread: no message of ours comes near it."""
MOST_LAYOUTS = 64
"""A peer that changes its joint names with every message must not fill the memory."""

MOST_PER_LENGTH = 4
"""Where bytes beside the numbers change, e.g. a covariance, no layout fits: then learning ends, and rosbags decodes."""


def encode_ros(name: str, ros: Any) -> bytes:
    """Little-endian CDR of a ROS 2 message, by rosbags."""
    return bytes(typestore().serialize_cdr(ros, name))


def decode_ros(name: str, data: bytes) -> Any:
    """A ROS 2 message of little-endian CDR, by rosbags.

    Raises:
        WireError: too long, truncated, of another encoding, or not of this type.
    """
    if len(data) > MAX_BYTES:
        raise WireError(name, f"{len(data)} bytes, at most {MAX_BYTES} are read")
    if data[:2] != b"\x00\x01":
        raise WireError(name, f"begins with {data[:4].hex() or 'nothing'}, little-endian CDR begins with 0001")
    try:
        return typestore().deserialize_cdr(data, name)
    except Exception as e:  # noqa: BLE001 # garbage makes rosbags raise anything, from struct.error to AssertionError
        raise WireError(name, f"cannot be decoded: {type(e).__name__}: {e}") from None


class Codec:
    """Encodes and decodes messages; it learns the layouts of the streams that it sees."""

    def __init__(self) -> None:
        self._out: dict[tuple[Any, ...], Layout | None] = {}
        self._in: dict[tuple[type, int], list[Layout]] = {}

    def encode(self, message: AnyMessage, stamp_ns: int) -> bytes:
        """CDR of a message with this source time."""
        cls = type(message)
        shape = HOT.get(cls)
        if shape is None:
            return encode_reference(message, stamp_ns)
        key = (cls, shape.constant(message))
        if key not in self._out:
            if len(self._out) >= MOST_LAYOUTS:
                self._out.clear()
            self._out[key] = learn(message, encode_reference)
        layout = self._out[key]
        if layout is None:
            return encode_reference(message, stamp_ns)
        return layout.encode(shape.numbers(message), stamp_ns)

    def decode(self, cls: type, data: bytes) -> tuple[AnyMessage, int | None]:
        """Message and source time; None for a type without header.

        Raises:
            WireError: the bytes are not of this type.
        """
        if cls not in HOT:
            return decode_reference(cls, data)
        key = (cls, len(data))
        known = self._in.get(key, [])
        for layout in known:
            found = layout.decode(data)
            if found is not None:
                return found
        message, stamp_ns = decode_reference(cls, data)
        if len(known) < MOST_PER_LENGTH:
            layout_ = learn(message, encode_reference, data)
            if layout_ is not None:
                if key not in self._in and len(self._in) >= MOST_LAYOUTS:
                    self._in.clear()
                self._in[key] = [*known, layout_]
        return message, stamp_ns


def encode_reference(message: AnyMessage, stamp_ns: int) -> bytes:
    """CDR by rosbags alone."""
    return encode_ros(ROS_NAMES[type(message)], to_ros(message, stamp_ns))


def decode_reference(cls: type, data: bytes) -> tuple[AnyMessage, int | None]:
    """Message and source time by rosbags alone.

    Raises:
        WireError: the bytes are not of this type.
    """
    name = ROS_NAMES[cls]
    ros = decode_ros(name, data)
    try:
        return from_ros(name, ros), stamp_of(ros)
    except WireError:
        raise
    except Exception as e:  # noqa: BLE001 # what was decoded from garbage may be anything
        raise WireError(name, f"cannot be read: {type(e).__name__}: {e}") from None


assert set(BY_ROS.values()) == set(ROS_NAMES)  # noqa: S101 # no two messages share a ROS 2 type
