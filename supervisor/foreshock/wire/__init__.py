"""The wire format: CDR of ROS 2 messages, attachments and key expressions (docs/wire.md). Needs no Zenoh."""

from foreshock.wire._attachment import Attachment, pack_attachment, unpack_attachment
from foreshock.wire._codec import MAX_BYTES, Codec, decode_reference, decode_ros, encode_reference, encode_ros
from foreshock.wire._keys import Keys, Naming, dds_name, liveliness_token
from foreshock.wire._lockstep import (
    PROTOCOL,
    ChannelNote,
    Hello,
    Request,
    Stepped,
    WireSample,
    check_hello,
    pack_samples,
    unpack_samples,
)
from foreshock.wire._ros import BY_ROS, ROS_NAMES, ros_header, stamp_of
from foreshock.wire._ros import from_ros as message_of
from foreshock.wire._types import definitions, rihs01, ros_type, typestore

__all__ = [
    "BY_ROS",
    "MAX_BYTES",
    "PROTOCOL",
    "ROS_NAMES",
    "Attachment",
    "ChannelNote",
    "Codec",
    "Hello",
    "Keys",
    "Naming",
    "Request",
    "Stepped",
    "WireSample",
    "check_hello",
    "dds_name",
    "decode_reference",
    "decode_ros",
    "definitions",
    "encode_reference",
    "encode_ros",
    "liveliness_token",
    "message_of",
    "pack_attachment",
    "pack_samples",
    "rihs01",
    "ros_header",
    "ros_type",
    "stamp_of",
    "typestore",
    "unpack_attachment",
    "unpack_samples",
]
