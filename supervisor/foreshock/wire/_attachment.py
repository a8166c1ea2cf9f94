"""What goes with every sample: sequence number, source time and sender, as rmw_zenoh attaches them (33 bytes)."""

from __future__ import annotations

import struct

import msgspec

from foreshock.errors import WireError

__all__ = ["Attachment", "pack_attachment", "unpack_attachment"]

_LAYOUT = struct.Struct("<qqB16s")
GID_LENGTH = 16


class Attachment(msgspec.Struct, frozen=True, gc=False):
    """Sequence number of the stream, source time (ns), and the sender's 16-byte GID."""

    sequence: int
    stamp_ns: int
    gid: bytes


def pack_attachment(sequence: int, stamp_ns: int, gid: bytes) -> bytes:
    """Little-endian: i64 sequence, i64 source time in ns, a byte with the length 16, the GID."""
    return _LAYOUT.pack(sequence, stamp_ns, GID_LENGTH, gid)


def unpack_attachment(data: bytes) -> Attachment:
    """The inverse.

    Raises:
        WireError: it is not of that form.
    """
    if len(data) != _LAYOUT.size:
        raise WireError("attachment", f"{len(data)} bytes, {_LAYOUT.size} are expected")
    sequence, stamp_ns, length, gid = _LAYOUT.unpack(data)
    if length != GID_LENGTH:
        raise WireError("attachment", f"a GID of {length} bytes, {GID_LENGTH} are expected")
    return Attachment(sequence, stamp_ns, gid)
