"""Our messages as ROS 2 messages and back, exactly: what is decoded equals what was encoded."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import msgspec
import numpy as np

from foreshock.clock import NS_PER_S
from foreshock.errors import WireError, nearest
from foreshock.messages import (
    AnyMessage,
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
from foreshock.wire._types import ros_type

__all__ = ["BY_ROS", "ROS_NAMES", "from_ros", "ros_header", "stamp_of", "to_ros"]

VISIBLE = "visible"
"""The class of a second hypothesis that carries a detection's visible share; vision_msgs has no field for it."""


def ros_header(stamp_ns: int, frame_id: str = "") -> Any:
    """A std_msgs/Header."""
    sec, nanosec = divmod(stamp_ns, NS_PER_S)
    time = ros_type("builtin_interfaces/msg/Time")(sec=sec, nanosec=nanosec)
    return ros_type("std_msgs/msg/Header")(stamp=time, frame_id=frame_id)


def _vector(v: Sequence[float]) -> Any:
    return ros_type("geometry_msgs/msg/Vector3")(x=v[0], y=v[1], z=v[2])


def _point(v: Sequence[float]) -> Any:
    return ros_type("geometry_msgs/msg/Point")(x=v[0], y=v[1], z=v[2])


def _quaternion(q: Sequence[float]) -> Any:
    return ros_type("geometry_msgs/msg/Quaternion")(x=q[0], y=q[1], z=q[2], w=q[3])


def _xyz(v: Any) -> tuple[float, float, float]:
    return (float(v.x), float(v.y), float(v.z))


def _xyzw(q: Any) -> tuple[float, float, float, float]:
    return (float(q.x), float(q.y), float(q.z), float(q.w))


def _array(values: Sequence[float]) -> Any:
    return np.array(values, np.float64)


def _pose(position: Sequence[float], orientation: Sequence[float]) -> Any:
    return ros_type("geometry_msgs/msg/Pose")(position=_point(position), orientation=_quaternion(orientation))


def _joint_state(m: JointState, stamp_ns: int) -> Any:
    return ros_type("sensor_msgs/msg/JointState")(
        header=ros_header(stamp_ns),
        name=list(m.name),
        position=_array(m.position),
        velocity=_array(m.velocity),
        effort=_array(m.effort),
    )


def _imu(m: Imu, stamp_ns: int) -> Any:
    unknown = np.zeros(9)
    return ros_type("sensor_msgs/msg/Imu")(
        header=ros_header(stamp_ns, m.frame_id),
        orientation=_quaternion(m.orientation),
        orientation_covariance=unknown,
        angular_velocity=_vector(m.angular_velocity),
        angular_velocity_covariance=unknown,
        linear_acceleration=_vector(m.linear_acceleration),
        linear_acceleration_covariance=unknown,
    )


def _wrench(m: WrenchStamped, stamp_ns: int) -> Any:
    wrench = ros_type("geometry_msgs/msg/Wrench")(force=_vector(m.force), torque=_vector(m.torque))
    return ros_type("geometry_msgs/msg/WrenchStamped")(header=ros_header(stamp_ns, m.frame_id), wrench=wrench)


def _odometry(m: Odometry, stamp_ns: int) -> Any:
    unknown = np.zeros(36)
    twist = ros_type("geometry_msgs/msg/Twist")(linear=_vector(m.linear), angular=_vector(m.angular))
    return ros_type("nav_msgs/msg/Odometry")(
        header=ros_header(stamp_ns, m.frame_id),
        child_frame_id=m.child_frame_id,
        pose=ros_type("geometry_msgs/msg/PoseWithCovariance")(
            pose=_pose(m.position, m.orientation), covariance=unknown
        ),
        twist=ros_type("geometry_msgs/msg/TwistWithCovariance")(twist=twist, covariance=unknown),
    )


def _detections(m: Detections, stamp_ns: int) -> Any:
    upright = (0.0, 0.0, 0.0, 1.0)
    header = ros_header(stamp_ns, m.frame_id)
    rows = []
    for d in m.detections:
        pose = ros_type("geometry_msgs/msg/PoseWithCovariance")(pose=_pose(d.center, upright), covariance=np.zeros(36))
        results = [
            ros_type("vision_msgs/msg/ObjectHypothesisWithPose")(
                hypothesis=ros_type("vision_msgs/msg/ObjectHypothesis")(class_id=name, score=value), pose=pose
            )
            for name, value in ((d.class_id, d.confidence), (VISIBLE, d.visible))
        ]
        box = ros_type("vision_msgs/msg/BoundingBox3D")(center=_pose(d.center, upright), size=_vector(d.size))
        rows.append(ros_type("vision_msgs/msg/Detection3D")(header=header, results=results, bbox=box, id=d.id))
    return ros_type("vision_msgs/msg/Detection3DArray")(header=header, detections=rows)


def _detection(d: Any) -> Detection:
    if not d.results:
        raise WireError("Detection3D.results", "empty; the best hypothesis is expected first")
    best = d.results[0].hypothesis
    seen = [float(r.hypothesis.score) for r in d.results[1:] if r.hypothesis.class_id == VISIBLE]
    center, size = _xyz(d.bbox.center.position), _xyz(d.bbox.size)
    return Detection(d.id, best.class_id, float(best.score), center, size, seen[0] if seen else 1.0)


def _humans(m: Humans, stamp_ns: int) -> Any:
    capsule, human = ros_type("foreshock_msgs/msg/Capsule"), ros_type("foreshock_msgs/msg/HumanPose")
    rows = [
        human(
            id=h.id,
            capsules=[capsule(region=c.region, a=_point(c.a), b=_point(c.b), radius=c.radius) for c in h.capsules],
            velocity_known=h.velocity is not None,
            velocity=_vector(h.velocity or (0.0, 0.0, 0.0)),
            uncertainty=h.uncertainty,
        )
        for h in m.humans
    ]
    return ros_type("foreshock_msgs/msg/Humans")(header=ros_header(stamp_ns, m.frame_id), humans=rows)


def _human(h: Any) -> HumanPose:
    capsules = tuple(Capsule(c.region, _xyz(c.a), _xyz(c.b), float(c.radius)) for c in h.capsules)
    return HumanPose(h.id, capsules, _xyz(h.velocity) if h.velocity_known else None, float(h.uncertainty))


def _plain(cls: type[msgspec.Struct], ros: str) -> Callable[[Any, int], Any]:
    """For messages whose fields are numbers, flags and texts of the same names; frame_id is the header's."""
    names = [f for f in cls.__struct_fields__ if f != "frame_id"]

    def convert(m: Any, stamp_ns: int) -> Any:
        header = ros_header(stamp_ns, getattr(m, "frame_id", ""))
        return ros_type(ros)(header=header, **{n: getattr(m, n) for n in names})

    return convert


def _path(m: PlannedPath, stamp_ns: int) -> Any:
    return ros_type("foreshock_msgs/msg/PlannedPath")(
        header=ros_header(stamp_ns, m.frame_id), x=_array(m.x), y=_array(m.y), time_from_start=_array(m.time_from_start)
    )


def _plan(m: MotionPlan, stamp_ns: int) -> Any:
    return ros_type("foreshock_msgs/msg/MotionPlan")(
        header=ros_header(stamp_ns), com=_point(m.com), support=list(m.support), speed=m.speed
    )


def _gaze(m: Gaze, stamp_ns: int) -> Any:
    return ros_type("foreshock_msgs/msg/Gaze")(
        header=ros_header(stamp_ns, m.frame_id),
        human_id=m.human_id,
        direction=_vector(m.direction),
        confidence=m.confidence,
    )


class _Pair(msgspec.Struct, frozen=True):
    ros: str
    to: Callable[[Any, int], Any]
    back: Callable[[Any], AnyMessage]


def _floats(values: Any) -> tuple[float, ...]:
    return tuple(np.asarray(values, np.float64).tolist())


_PAIRS: Mapping[type, _Pair] = {
    Scalar: _Pair(
        "std_msgs/msg/Float64",
        lambda m, _: ros_type("std_msgs/msg/Float64")(data=m.data),
        lambda r: Scalar(float(r.data)),
    ),
    JointState: _Pair(
        "sensor_msgs/msg/JointState",
        _joint_state,
        lambda r: JointState(tuple(r.name), _floats(r.position), _floats(r.velocity), _floats(r.effort)),
    ),
    Imu: _Pair(
        "sensor_msgs/msg/Imu",
        _imu,
        lambda r: Imu(_xyzw(r.orientation), _xyz(r.angular_velocity), _xyz(r.linear_acceleration), r.header.frame_id),
    ),
    WrenchStamped: _Pair(
        "geometry_msgs/msg/WrenchStamped",
        _wrench,
        lambda r: WrenchStamped(_xyz(r.wrench.force), _xyz(r.wrench.torque), r.header.frame_id),
    ),
    Odometry: _Pair(
        "nav_msgs/msg/Odometry",
        _odometry,
        lambda r: Odometry(
            _xyz(r.pose.pose.position),
            _xyzw(r.pose.pose.orientation),
            _xyz(r.twist.twist.linear),
            _xyz(r.twist.twist.angular),
            r.header.frame_id,
            r.child_frame_id,
        ),
    ),
    Detections: _Pair(
        "vision_msgs/msg/Detection3DArray",
        _detections,
        lambda r: Detections(tuple(_detection(d) for d in r.detections), r.header.frame_id),
    ),
    Humans: _Pair(
        "foreshock_msgs/msg/Humans",
        _humans,
        lambda r: Humans(tuple(_human(h) for h in r.humans), r.header.frame_id),
    ),
    GripState: _Pair(
        "foreshock_msgs/msg/GripState",
        _plain(GripState, "foreshock_msgs/msg/GripState"),
        lambda r: GripState(
            bool(r.grasping),
            float(r.normal_force),
            float(r.tangential_force),
            float(r.opening),
            float(r.commanded_force),
            float(r.object_mass),
            float(r.vertical_acceleration),
        ),
    ),
    Heartbeat: _Pair(
        "foreshock_msgs/msg/Heartbeat",
        _plain(Heartbeat, "foreshock_msgs/msg/Heartbeat"),
        lambda r: Heartbeat(int(r.sequence), float(r.round_trip_s)),
    ),
    MotionPlan: _Pair(
        "foreshock_msgs/msg/MotionPlan",
        _plan,
        lambda r: MotionPlan(_xyz(r.com), tuple(r.support), float(r.speed)),
    ),
    PlannedPath: _Pair(
        "foreshock_msgs/msg/PlannedPath",
        _path,
        lambda r: PlannedPath(_floats(r.x), _floats(r.y), _floats(r.time_from_start), r.header.frame_id),
    ),
    MotionCommand: _Pair(
        "foreshock_msgs/msg/MotionCommand",
        _plain(MotionCommand, "foreshock_msgs/msg/MotionCommand"),
        lambda r: MotionCommand(bool(r.enabled), bool(r.stop_requested), float(r.speed), bool(r.announced)),
    ),
    TaskPhase: _Pair(
        "foreshock_msgs/msg/TaskPhase",
        _plain(TaskPhase, "foreshock_msgs/msg/TaskPhase"),
        lambda r: TaskPhase(int(r.phase), float(r.due_s)),
    ),
    Gaze: _Pair(
        "foreshock_msgs/msg/Gaze",
        _gaze,
        lambda r: Gaze(r.human_id, _xyz(r.direction), float(r.confidence), r.header.frame_id),
    ),
    ImageStatistics: _Pair(
        "foreshock_msgs/msg/ImageStatistics",
        _plain(ImageStatistics, "foreshock_msgs/msg/ImageStatistics"),
        lambda r: ImageStatistics(float(r.luminance), float(r.contrast), float(r.sharpness), float(r.saturated)),
    ),
}

ROS_NAMES: Mapping[type, str] = {cls: pair.ros for cls, pair in _PAIRS.items()}
"""ROS 2 type name of each message class."""
BY_ROS: Mapping[str, type] = {ros: cls for cls, ros in ROS_NAMES.items()}
"""And back."""


def to_ros(message: AnyMessage, stamp_ns: int) -> Any:
    """The ROS 2 message; its header, where it has one, carries stamp_ns."""
    return _PAIRS[type(message)].to(message, stamp_ns)


def from_ros(name: str, ros: Any) -> AnyMessage:
    """Our message of a ROS 2 message of this type.

    Raises:
        WireError: no message of ours stands for this type.
    """
    cls = BY_ROS.get(name)
    if cls is None:
        raise WireError("type", f"{name!r} is none that Foreshock reads", nearest(name, BY_ROS))
    return _PAIRS[cls].back(ros)


def stamp_of(ros: Any) -> int | None:
    """Source time of the header in ns; None where there is none."""
    header = getattr(ros, "header", None)
    return None if header is None else int(header.stamp.sec) * NS_PER_S + int(header.stamp.nanosec)
