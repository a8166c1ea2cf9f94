"""The codec equals rosbags byte for byte, loses nothing, and no bytes whatever make it raise anything but WireError."""

from __future__ import annotations

import math
import struct
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from foreshock.errors import WireError
from foreshock.messages import (
    Capsule,
    Detection,
    Detections,
    Gaze,
    GripState,
    Heartbeat,
    HumanPose,
    Humans,
    ImageStatistics,
    Imu,
    JointState,
    MotionCommand,
    MotionPlan,
    Odometry,
    PlannedPath,
    Scalar,
    TaskPhase,
    WrenchStamped,
)
from foreshock.wire import ROS_NAMES, Codec, decode_reference, encode_reference, ros_type, typestore
from foreshock.wire._hot import learn

NUMBER = st.floats(width=64)
VEC3 = st.tuples(NUMBER, NUMBER, NUMBER)
QUAT = st.tuples(NUMBER, NUMBER, NUMBER, NUMBER)
TEXT = st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\0"), max_size=12)
FLAG = st.booleans()
CAPSULE = st.builds(Capsule, TEXT, VEC3, VEC3, NUMBER)
LONG = st.integers(-(2**63), 2**63 - 1)


@st.composite
def rows(draw: Any, n: int) -> Any:
    return tuple(draw(st.lists(NUMBER, min_size=n, max_size=n)))


@st.composite
def joint_states(draw: Any) -> JointState:
    n = draw(st.integers(0, 5))
    names = tuple(draw(st.lists(TEXT, min_size=n, max_size=n)))
    others = [draw(rows(n)) if draw(FLAG) else () for _ in range(2)]
    return JointState(names, draw(rows(n)), *others)


MESSAGES = {
    Scalar: st.builds(Scalar, NUMBER),
    JointState: joint_states(),
    Imu: st.builds(Imu, QUAT, VEC3, VEC3, TEXT),
    WrenchStamped: st.builds(WrenchStamped, VEC3, VEC3, TEXT),
    Odometry: st.builds(Odometry, VEC3, QUAT, VEC3, VEC3, TEXT, TEXT),
    Detections: st.builds(
        Detections,
        st.lists(st.builds(Detection, TEXT, TEXT, NUMBER, VEC3, VEC3, NUMBER), max_size=3).map(tuple),
        TEXT,
    ),
    Humans: st.builds(
        Humans,
        st.lists(
            st.builds(HumanPose, TEXT, st.lists(CAPSULE, max_size=3).map(tuple), st.none() | VEC3, NUMBER), max_size=2
        ).map(tuple),
        TEXT,
    ),
    GripState: st.builds(GripState, FLAG, NUMBER, NUMBER, NUMBER, NUMBER, NUMBER, NUMBER),
    Heartbeat: st.builds(Heartbeat, LONG, NUMBER),
    MotionPlan: st.builds(MotionPlan, VEC3, st.lists(TEXT, max_size=3).map(tuple), NUMBER),
    PlannedPath: st.integers(0, 4).flatmap(lambda n: st.builds(PlannedPath, rows(n), rows(n), rows(n), TEXT)),
    MotionCommand: st.builds(MotionCommand, FLAG, FLAG, NUMBER, FLAG),
    TaskPhase: st.builds(TaskPhase, LONG, NUMBER),
    Gaze: st.builds(Gaze, TEXT, VEC3, NUMBER, TEXT),
    ImageStatistics: st.builds(ImageStatistics, NUMBER, NUMBER, NUMBER, NUMBER),
}
STAMPS = st.integers(0, (2**31 - 1) * 1_000_000_000)
ANY = st.one_of(*MESSAGES.values())


def same(a: Any, b: Any) -> bool:
    """Equal field by field, NaN to NaN and -0.0 to -0.0."""
    if isinstance(a, float):
        return struct.pack("<d", a) == struct.pack("<d", b)
    if isinstance(a, tuple):
        return len(a) == len(b) and all(same(x, y) for x, y in zip(a, b, strict=True))
    if hasattr(a, "__struct_fields__"):
        return type(a) is type(b) and all(same(getattr(a, f), getattr(b, f)) for f in a.__struct_fields__)
    return type(a) is type(b) and a == b


def test_every_message_is_covered() -> None:
    assert set(MESSAGES) == set(ROS_NAMES)


@given(ANY, STAMPS)
@settings(max_examples=400, deadline=None)
def test_what_is_decoded_is_what_was_encoded(message: Any, stamp_ns: int) -> None:
    for codec in (Codec(), SHARED):
        data = codec.encode(message, stamp_ns)
        assert data == encode_reference(message, stamp_ns)
        found, seen_ns = codec.decode(type(message), data)
        assert same(found, message)
        assert seen_ns == (None if isinstance(message, Scalar) else stamp_ns)
        assert same(decode_reference(type(message), data)[0], message)


SHARED = Codec()


@given(st.sampled_from(sorted(MESSAGES, key=lambda c: c.__name__)), st.binary(max_size=300))
@example(JointState, b"")
@example(JointState, b"\x00\x01\x00\x00" + b"\xff" * 40)
@settings(max_examples=5000, deadline=None)
def test_garbage_is_a_wire_error_or_a_message(cls: type, data: bytes) -> None:
    for given_ in (data, b"\x00\x01\x00\x00" + data):
        try:
            message, _ = SHARED.decode(cls, given_)
        except WireError:
            continue
        assert type(message) is cls


@given(ANY, st.data())
@settings(max_examples=5000, deadline=None)
def test_a_truncated_or_altered_payload_is_a_wire_error_or_another_message(message: Any, data: Any) -> None:
    payload = bytearray(SHARED.encode(message, 5))
    if data.draw(FLAG):
        del payload[data.draw(st.integers(0, len(payload) - 1)) :]
    else:
        payload[data.draw(st.integers(0, len(payload) - 1))] ^= data.draw(st.integers(1, 255))
    try:
        found, _ = SHARED.decode(type(message), bytes(payload))
    except WireError:
        return
    assert type(found) is type(message)


def test_an_oversized_payload_is_refused_unread() -> None:
    with pytest.raises(WireError, match="at most 250000 are read"):
        Codec().decode(JointState, b"\x00\x01\x00\x00" + bytes(1_000_000))


def test_a_robots_own_covariances_do_not_matter() -> None:
    """A ROS 2 robot fills them; they are constant as a rule, and the cached layout holds them."""
    ros = ros_type("sensor_msgs/msg/Imu")
    header = ros_type("std_msgs/msg/Header")(
        stamp=ros_type("builtin_interfaces/msg/Time")(sec=3, nanosec=4), frame_id="imu"
    )
    vector, quaternion = ros_type("geometry_msgs/msg/Vector3"), ros_type("geometry_msgs/msg/Quaternion")
    codec = Codec()
    for k in range(20):
        covariance = np.full(9, 0.01 if k < 10 else 0.01 * k)
        data = bytes(
            typestore().serialize_cdr(
                ros(
                    header=header,
                    orientation=quaternion(x=0.0, y=0.0, z=0.0, w=1.0),
                    orientation_covariance=covariance,
                    angular_velocity=vector(x=0.1 * k, y=0.0, z=0.0),
                    angular_velocity_covariance=covariance,
                    linear_acceleration=vector(x=0.0, y=0.0, z=9.81),
                    linear_acceleration_covariance=covariance,
                ),
                "sensor_msgs/msg/Imu",
            )
        )
        message, stamp_ns = codec.decode(Imu, data)
        assert message == Imu((0.0, 0.0, 0.0, 1.0), (0.1 * k, 0.0, 0.0), (0.0, 0.0, 9.81), "imu")
        assert stamp_ns == 3_000_000_004


def test_no_stream_of_changing_shapes_fills_the_memory() -> None:
    codec = Codec()
    for k in range(1000):
        message = JointState((f"joint-{k}",), (math.pi,))
        assert codec.decode(JointState, codec.encode(message, k))[0] == message
    assert len(codec._out) <= 64
    assert sum(map(len, codec._in.values())) <= 64 * 4


def test_a_message_too_large_for_a_layout_is_read_by_the_reference() -> None:
    """Learning would take time with the square of the numbers, and a peer chooses how many there are."""
    names = tuple(f"joint-{k}" for k in range(3_000))
    message = JointState(names, (0.5,) * 3_000, (1.5,) * 3_000)
    assert learn(message, encode_reference) is None
    codec = Codec()
    data = codec.encode(message, 7)
    assert data == encode_reference(message, 7)
    assert codec.decode(JointState, data) == (message, 7)


def test_payloads_of_every_length_fill_no_memory() -> None:
    codec = Codec()
    for n in range(3_000):
        with pytest.raises(WireError):
            codec.decode(JointState, b"\x00\x01\x00\x00" + b"\xff" * n)
    for n in range(1, 200):
        names = tuple(f"joint-{k}" for k in range(n))
        codec.decode(JointState, encode_reference(JointState(names, (0.5,) * n), 7))
    assert len(codec._in) <= 64
