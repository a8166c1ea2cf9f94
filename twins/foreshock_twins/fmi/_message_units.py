"""The unit that each numeric field of a message carries: REP 103 and the docstrings of foreshock.messages."""

from __future__ import annotations

from foreshock_fmus import TomlTable, parse_unit
from foreshock_twins.fmi._variables import Variable

__all__ = ["MESSAGE_UNITS", "check_unit"]

# Several units where the field may be one or the other: prismatic and revolute joints. An empty tuple takes any unit.
MESSAGE_UNITS: dict[tuple[str, str], tuple[str, ...]] = {
    ("Scalar", "data"): (),
    ("JointState", "position"): ("rad", "m"),
    ("JointState", "velocity"): ("rad/s", "m/s"),
    ("JointState", "effort"): ("N.m", "N"),
    ("Imu", "orientation"): ("1",),
    ("Imu", "angular_velocity"): ("rad/s",),
    ("Imu", "linear_acceleration"): ("m/s2",),
    ("WrenchStamped", "force"): ("N",),
    ("WrenchStamped", "torque"): ("N.m",),
    ("Odometry", "position"): ("m",),
    ("Odometry", "orientation"): ("1",),
    ("Odometry", "linear"): ("m/s",),
    ("Odometry", "angular"): ("rad/s",),
    ("Detection", "confidence"): ("1",),
    ("Detection", "center"): ("m",),
    ("Detection", "size"): ("m",),
    ("Detection", "visible"): ("1",),
    ("GripState", "grasping"): ("1",),
    ("GripState", "normal_force"): ("N",),
    ("GripState", "tangential_force"): ("N",),
    ("GripState", "opening"): ("m",),
    ("GripState", "commanded_force"): ("N",),
    ("GripState", "object_mass"): ("kg",),
    ("GripState", "vertical_acceleration"): ("m/s2",),
    ("Heartbeat", "sequence"): ("1",),
    ("Heartbeat", "round_trip_s"): ("s",),
    ("MotionPlan", "com"): ("m",),
    ("MotionPlan", "support"): ("1",),
    ("MotionPlan", "speed"): ("m/s",),
    ("PlannedPath", "x"): ("m",),
    ("PlannedPath", "y"): ("m",),
    ("PlannedPath", "time_from_start"): ("s",),
    ("MotionCommand", "enabled"): ("1",),
    ("MotionCommand", "stop_requested"): ("1",),
    ("MotionCommand", "speed"): ("m/s",),
    ("MotionCommand", "announced"): ("1",),
    ("TaskPhase", "phase"): ("1",),
    ("TaskPhase", "due_s"): ("s",),
    ("Gaze", "direction"): ("1",),
    ("Gaze", "confidence"): ("1",),
    ("ImageStatistics", "luminance"): ("1",),
    ("ImageStatistics", "contrast"): ("1",),
    ("ImageStatistics", "sharpness"): ("1",),
    ("ImageStatistics", "saturated"): ("1",),
}


def check_unit(table: TomlTable, key: str, what: str, variable: Variable, expected: tuple[str, ...]) -> None:
    """Refuse a variable whose declared unit is another one; a variable that declares none is taken as it is.

    Args:
        table: where the binding names the variable.
        key: under which key.
        what: what it is bound to, for the error.
        variable: the variable.
        expected: acceptable units; empty accepts all.

    Raises:
        ConfigError: naming both units.
    """
    if not expected or not variable.unit_name:
        return
    unit = variable.unit
    if unit is None or not any(unit.same(parse_unit(name)) for name in expected):
        names = " or ".join(expected)
        table.fail(key, f"variable {variable.name!r} is in {variable.unit_name!r}", f"; {what} is in {names!r}")
