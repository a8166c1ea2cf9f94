"""Keys, hashes, attachments and liveliness tokens against the vectors that rmw_zenoh and ROS 2 publish."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from foreshock.errors import ConfigError, WireError
from foreshock.wire import (
    Keys,
    dds_name,
    definitions,
    liveliness_token,
    pack_attachment,
    rihs01,
    typestore,
    unpack_attachment,
)

STRING = "std_msgs/msg/String"
STRING_HASH = "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"
"""rmw_zenoh, docs/design.md."""


def test_hashes_are_those_of_ros_2() -> None:
    assert rihs01(STRING) == STRING_HASH
    assert dds_name(STRING) == "std_msgs::msg::dds_::String_"


@pytest.mark.parametrize(("channel", "topic"), [("chatter", "chatter"), ("robot1/chatter", "robot1/chatter")])
def test_topic_keys_are_those_of_rmw_zenoh(channel: str, topic: str) -> None:
    keys = Keys("robot1", "rmw_zenoh", 0)
    assert keys.stream(channel, STRING) == f"0/{topic}/std_msgs::msg::dds_::String_/{STRING_HASH}"


def test_liveliness_tokens_are_those_of_rmw_zenoh() -> None:
    zid = "aac3178e146ba6f1fc6e6a4085e77f21"
    assert liveliness_token(0, zid, 0, 0, "NN", "listener") == f"@ros2_lv/0/{zid}/0/0/NN/%/%/listener"
    zid = "8b20917502ee955ac4476e0266340d5c"
    token = liveliness_token(0, zid, 0, 10, "MP", "talker", "/chatter", STRING, "::,7:,:,:,,")
    assert token == (
        f"@ros2_lv/0/{zid}/0/10/MP/%/%/talker/%chatter/std_msgs::msg::dds_::String_/{STRING_HASH}/::,7:,:,:,,"
    )


def test_our_own_keys_keep_streams_and_services_apart() -> None:
    keys = Keys("talos")
    assert keys.stream("talos/joints/state", "sensor_msgs/msg/JointState") == "foreshock/talos/joints/state"
    assert keys.service("lease") == "foreshock/talos/@/lease"
    assert keys.alive("guard", "g1") == "foreshock/talos/@/alive/guard/g1"


@pytest.mark.parametrize("robot", ["", "a/b", "*", "a$", "@x"])
def test_a_robot_that_cannot_be_a_key_is_refused(robot: str) -> None:
    with pytest.raises(ConfigError, match="cannot be part of a key expression"):
        Keys(robot)


def test_the_attachment_has_the_bytes_of_rmw_zenoh() -> None:
    """i64 sequence, i64 nanoseconds, a byte with the length of the GID, 16 bytes of it: 33 bytes, little-endian."""
    gid = bytes(range(16))
    data = pack_attachment(0x0102, -1, gid)
    assert data == b"\x02\x01" + bytes(6) + b"\xff" * 8 + b"\x10" + gid


@given(st.binary(max_size=40))
def test_any_bytes_are_an_attachment_or_a_wire_error(data: bytes) -> None:
    try:
        found = unpack_attachment(data)
    except WireError:
        return
    assert pack_attachment(found.sequence, found.stamp_ns, found.gid) == data


def test_every_definition_is_known_and_hashed() -> None:
    for name in definitions():
        assert name in typestore().types
        assert rihs01(name).startswith("RIHS01_")
