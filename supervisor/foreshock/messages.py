"""What a sample can carry: typed messages with ROS 2 names and semantics, otherwise our own.

Vectors are tuples of float, so that a message is immutable and compares by value. Frames follow REP 103 (x forward,
y left, z up) and REP 105. Quaternions are x, y, z, w.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, TypeAlias

import msgspec

__all__ = [
    "Capsule",
    "Detection",
    "Detections",
    "Gaze",
    "GripState",
    "Heartbeat",
    "HumanPose",
    "Humans",
    "ImageStatistics",
    "Imu",
    "JointState",
    "Message",
    "MotionCommand",
    "MotionPlan",
    "Odometry",
    "PlannedPath",
    "Scalar",
    "TaskPhase",
    "Vec3",
    "WrenchStamped",
    "is_finite",
    "stands_still",
]

Vec3: TypeAlias = tuple[float, float, float]
Quaternion: TypeAlias = tuple[float, float, float, float]


class Message(msgspec.Struct, frozen=True, tag=True):
    """Base of all messages."""


class Scalar(Message, frozen=True):
    """One number whose meaning its channel names (std_msgs/Float64)."""

    data: float


class JointState(Message, frozen=True):
    """sensor_msgs/JointState: joint names, positions (rad or m), velocities (1/s), efforts (N m or N); may be empty."""

    name: tuple[str, ...]
    position: tuple[float, ...]
    velocity: tuple[float, ...] = ()
    effort: tuple[float, ...] = ()


class Imu(Message, frozen=True):
    """sensor_msgs/Imu: orientation, angular velocity (rad/s), linear acceleration (m/s^2, gravity included)."""

    orientation: Quaternion
    angular_velocity: Vec3
    linear_acceleration: Vec3
    frame_id: str = "imu_link"


class WrenchStamped(Message, frozen=True):
    """geometry_msgs/WrenchStamped: what the environment exerts on the frame, in that frame: force (N), torque (N m)."""

    force: Vec3
    torque: Vec3
    frame_id: str = ""


class Odometry(Message, frozen=True):
    """nav_msgs/Odometry: pose of the child frame in frame_id; twist (m/s, rad/s) in the child frame."""

    position: Vec3
    orientation: Quaternion
    linear: Vec3
    angular: Vec3
    frame_id: str = "odom"
    child_frame_id: str = "base_link"


class Detection(msgspec.Struct, frozen=True):
    """vision_msgs/Detection3D with its best hypothesis: track id, class, confidence 0..1, centre and size (m).

    visible is the share 0..1 of the object's expected outline that the camera sees (KITTI's occlusion, turned round).
    """

    id: str
    class_id: str
    confidence: float
    center: Vec3
    size: Vec3 = (0.0, 0.0, 0.0)
    visible: float = 1.0


class Detections(Message, frozen=True):
    """vision_msgs/Detection3DArray."""

    detections: tuple[Detection, ...]
    frame_id: str = "odom"


class Capsule(msgspec.Struct, frozen=True):
    """A body segment: all points within radius (m) of the segment from a to b (m).

    region is a body region of ISO/TS 15066 Annex A, e.g. ``chest``.
    """

    region: str
    a: Vec3
    b: Vec3
    radius: float


class HumanPose(msgspec.Struct, frozen=True):
    """One tracked human as capsules, with the velocity of the trunk (m/s) if it is measured.

    uncertainty is the standard position uncertainty Z_d of ISO/TS 15066 in m.
    """

    id: str
    capsules: tuple[Capsule, ...]
    velocity: Vec3 | None = None
    uncertainty: float = 0.0


class Humans(Message, frozen=True):
    """Every human that perception sees now; an empty tuple says that nobody is there."""

    humans: tuple[HumanPose, ...]
    frame_id: str = "odom"


class GripState(Message, frozen=True):
    """A gripper: closed or not, measured normal and tangential force (N), opening (m), commanded normal force (N).

    object_mass is the mass that the planner assumes for the held object (kg); 0 when nothing is held.
    """

    grasping: bool
    normal_force: float
    tangential_force: float
    opening: float
    commanded_force: float
    object_mass: float = 0.0
    vertical_acceleration: float = 0.0


class Heartbeat(Message, frozen=True):
    """Sign of life of a sender: its sequence number and the round trip of its control loop (s), if it measures one."""

    sequence: int
    round_trip_s: float = 0.0


class MotionPlan(Message, frozen=True):
    """What the robot's own control intends.

    com: planned centre of mass relative to the midpoint of the soles (m), axes of the base footprint.
    support: soles that the plan loads now, of ``left`` and ``right``.
    speed: planned speed of travel (m/s).
    """

    com: Vec3
    support: tuple[str, ...]
    speed: float = 0.0


class PlannedPath(Message, frozen=True):
    """Where something is going to be (nav_msgs/Path with stamps): x, y (m), time from the stamp (s), row by row."""

    x: tuple[float, ...]
    y: tuple[float, ...]
    time_from_start: tuple[float, ...]
    frame_id: str = "odom"


class MotionCommand(Message, frozen=True):
    """What the robot's control and its operators ask of a motion now.

    enabled: motion is permitted by whoever starts and stops it.
    stop_requested: a protective stop has been asked for and has not been withdrawn (ISO 13850, ISO 10218-1).
    speed: commanded speed (m/s); announced: a signal (light, sound) warns people of a start.
    """

    enabled: bool
    stop_requested: bool
    speed: float
    announced: bool = False


class TaskPhase(Message, frozen=True):
    """Where the plan is: number of the phase under way, when it is due to end (s from the stamp; below 0: overdue)."""

    phase: int
    due_s: float


class Gaze(Message, frozen=True):
    """Where one human looks: unit vector from the head in frame_id, confidence 0..1 of the estimate."""

    human_id: str
    direction: Vec3
    confidence: float = 1.0
    frame_id: str = "odom"


class ImageStatistics(Message, frozen=True):
    """Of the newest camera image, each 0..1: mean luminance, RMS contrast, sharpness, share of saturated pixels.

    sharpness is the variance of the Laplacian relative to that of the camera's reference image, cut off at 1.
    """

    luminance: float
    contrast: float
    sharpness: float
    saturated: float = 0.0


AnyMessage: TypeAlias = (
    Scalar
    | JointState
    | Imu
    | WrenchStamped
    | Odometry
    | Detections
    | Humans
    | GripState
    | Heartbeat
    | MotionPlan
    | PlannedPath
    | MotionCommand
    | TaskPhase
    | Gaze
    | ImageStatistics
)


def _vectors(*vectors: tuple[float, ...] | None) -> float:
    return sum([sum(v) for v in vectors if v])


_TOTAL: Mapping[type, Callable[[Any], float]] = {
    Scalar: lambda m: m.data,
    JointState: lambda m: sum(m.position) + sum(m.velocity) + sum(m.effort),
    Imu: lambda m: _vectors(m.orientation, m.angular_velocity, m.linear_acceleration),
    WrenchStamped: lambda m: sum(m.force) + sum(m.torque),
    Odometry: lambda m: _vectors(m.position, m.orientation, m.linear, m.angular),
    Detections: lambda m: sum([d.confidence + d.visible + sum(d.center) + sum(d.size) for d in m.detections]),
    Humans: lambda m: sum(
        [
            h.uncertainty + sum(h.velocity or ()) + sum([sum(c.a) + sum(c.b) + c.radius for c in h.capsules])
            for h in m.humans
        ]
    ),
    GripState: lambda m: (
        m.normal_force + m.tangential_force + m.opening + m.commanded_force + m.object_mass + m.vertical_acceleration
    ),
    Heartbeat: lambda m: m.round_trip_s,
    MotionPlan: lambda m: sum(m.com) + m.speed,
    PlannedPath: lambda m: sum(m.x) + sum(m.y) + sum(m.time_from_start),
    MotionCommand: lambda m: m.speed,
    TaskPhase: lambda m: m.phase + m.due_s,
    Gaze: lambda m: sum(m.direction) + m.confidence,
    ImageStatistics: lambda m: m.luminance + m.contrast + m.sharpness + m.saturated,
}
"""Sum of all numbers of a message: finite only if every one is (or it overflows, which no physical quantity does)."""


def is_finite(message: Message) -> bool:
    """Whether every number in a message is a finite number."""
    try:
        return math.isfinite(_TOTAL[type(message)](message))
    except (TypeError, ValueError, KeyError):
        return False


def stands_still(before: Message, after: Message) -> bool:
    """Whether a message measures, to the last bit, what the one before it on its channel did.

    That nobody is there, or nothing detected, is no measurement and never stands still. Of a heartbeat only the
    sequence number counts. What cannot be compared (an array in place of a tuple) shows no motion: it stands still.
    """
    try:
        if before == after:
            return not (
                (type(after) is Humans and not after.humans) or (type(after) is Detections and not after.detections)
            )
    except ValueError:
        return True
    return type(before) is type(after) is Heartbeat and before.sequence == after.sequence
