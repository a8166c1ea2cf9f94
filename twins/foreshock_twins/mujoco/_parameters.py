"""What scenarios vary, with unit, default and range."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

from foreshock.errors import ConfigError, nearest

__all__ = ["PARAMETERS", "Parameter", "values_of"]


class Parameter(NamedTuple):
    """A parameter of the twin: default, SI unit, legal range, and what it is."""

    start: float
    unit: str
    low: float
    high: float
    text: str


_BIG = 1e9
_WHOLE = frozenset({"drop_foot", "human", "weak_joint"})
"""They choose one of several: half a foot would quietly be none."""

PARAMETERS: Mapping[str, Parameter] = {
    # walk
    "stepping": Parameter(1.0, "1", 0.0, 1.0, "1 walks, 0 stands on both feet"),
    "step_length": Parameter(0.1, "m", -0.1, 0.25, "from foot to foot; 0 steps in place"),
    "step_height": Parameter(0.04, "m", 0.01, 0.08, "lift of the swing foot"),
    "single_support": Parameter(0.7, "s", 0.3, 2.0, "single support of a step"),
    "double_support": Parameter(0.2, "s", 0.1, 2.0, "double support of a step"),
    "first_support": Parameter(1.0, "1", -1.0, 1.0, "foot that stands first: above 0 left, else right"),
    "start_time": Parameter(1.5, "s", 0.0, _BIG, "when the walk begins"),
    "walk_time": Parameter(0.0, "s", 0.0, _BIG, "how long it walks before it stands; 0: for ever"),
    "stand_time": Parameter(2.0, "s", 0.0, _BIG, "how long it stands before it walks again"),
    "arms_forward": Parameter(0.0, "1", 0.0, 1.0, "hands held out in front, as with a box between them"),
    # floor
    "mu": Parameter(0.8, "1", 0.001, 2.0, "Coulomb friction of both soles"),
    "drop_mu": Parameter(0.04, "1", 0.001, 2.0, "friction on the ice"),
    "drop_time": Parameter(4.0, "s", 0.0, _BIG, "when a sole comes onto ice"),
    "drop_duration": Parameter(0.0, "s", 0.0, _BIG, "how long it stays there; 0 is no ice"),
    "drop_foot": Parameter(0.0, "1", 0.0, 2.0, "sole on ice: 0 left, 1 right, 2 both"),
    "block_height": Parameter(0.0, "m", 0.0, 0.06, "an unseen block where a foot lands; 0 is none"),
    "block_time": Parameter(4.0, "s", 0.0, _BIG, "the first swing that begins after this lands on it"),
    # forces and load
    "push_impulse": Parameter(0.0, "N.s", 0.0, 200.0, "push against the torso"),
    "push_time": Parameter(4.0, "s", 0.0, _BIG, "when it begins"),
    "push_duration": Parameter(0.1, "s", 0.005, 10.0, "constant force for so long"),
    "push_direction": Parameter(0.0, "rad", -7.0, 7.0, "where it pushes to, from the x axis of odom"),
    "payload_hands": Parameter(0.0, "kg", 0.0, 40.0, "mass in both hands together that the robot does not know of"),
    "payload_torso": Parameter(0.0, "kg", 0.0, 60.0, "mass on the torso that it does not know of"),
    "payload_time": Parameter(0.0, "s", 0.0, _BIG, "when it takes them up"),
    # control and drives
    "delay": Parameter(0.005, "s", 0.0, 0.2, "age of the measurements that balance control uses"),
    "lag": Parameter(0.0, "s", 0.0, 0.5, "added to that age, and to that of all measurements but the human's"),
    "lag_time": Parameter(4.0, "s", 0.0, _BIG, "from when on"),
    "lag_duration": Parameter(_BIG, "s", 0.0, _BIG, "for how long"),
    "blind_time": Parameter(4.0, "s", 0.0, _BIG, "when balance feedback is lost"),
    "blind_duration": Parameter(0.0, "s", 0.0, _BIG, "for how long; 0 never"),
    "weak_joint": Parameter(3.0, "1", 0.0, 200.0, "joint that loses torque, by its number in joints/state from 0"),
    "weak_share": Parameter(1.0, "1", 0.0, 1.0, "share of its torque that is left"),
    "weak_time": Parameter(4.0, "s", 0.0, _BIG, "from when on"),
    # human
    "human": Parameter(0.0, "1", 0.0, 3.0, "0 nobody, 1 stands, 2 walks past, 3 reaches in"),
    "human_x": Parameter(1.0, "m", -50.0, 50.0, "where he stands at first"),
    "human_y": Parameter(0.0, "m", -50.0, 50.0, "where he stands at first"),
    "human_yaw": Parameter(math.pi, "rad", -7.0, 7.0, "where he faces, from the x axis"),
    "human_start": Parameter(0.0, "s", 0.0, _BIG, "when he begins to walk or reach"),
    "human_speed": Parameter(1.3, "m/s", 0.1, 2.0, "of his walk"),
    "reach_x": Parameter(0.45, "m", -50.0, 50.0, "where his hand goes"),
    "reach_y": Parameter(0.1, "m", -50.0, 50.0, "where his hand goes"),
    "reach_z": Parameter(1.1, "m", 0.0, 3.0, "where his hand goes"),
    "reach_duration": Parameter(0.6, "s", 0.1, 10.0, "how long it takes"),
    # sensors: standard deviations of white noise
    "latency": Parameter(0.005, "s", 0.0, 0.5, "age of the measurements that the channels show"),
    "camera_latency": Parameter(0.06, "s", 0.0, 1.0, "age of the human's track"),
    "encoder_noise": Parameter(1e-4, "rad", 0.0, 0.1, "joint position"),
    "joint_rate_noise": Parameter(0.01, "rad/s", 0.0, 1.0, "joint velocity"),
    "effort_noise": Parameter(0.5, "N.m", 0.0, 100.0, "joint torque"),
    "base_noise": Parameter(3e-4, "m", 0.0, 0.1, "base position"),
    "base_rate_noise": Parameter(0.005, "m/s", 0.0, 1.0, "base velocity"),
    "attitude_noise": Parameter(3e-4, "rad", 0.0, 0.1, "base orientation about each axis"),
    "gyro_noise": Parameter(0.005, "rad/s", 0.0, 1.0, "angular velocity"),
    "accelerometer_noise": Parameter(0.05, "m/s2", 0.0, 10.0, "specific force"),
    "force_noise": Parameter(2.0, "N", 0.0, 100.0, "sole force"),
    "torque_noise": Parameter(0.2, "N.m", 0.0, 10.0, "sole torque"),
    "object_tilt_noise": Parameter(0.004, "rad", 0.0, 0.1, "orientation of what a hand holds, seen, about each axis"),
    "object_noise": Parameter(0.002, "m", 0.0, 0.1, "place of what a hand holds, seen"),
    "human_noise": Parameter(0.01, "m", 0.0, 1.0, "human's position; twice that in m/s for his velocity"),
    "gaze_noise": Parameter(0.03, "rad", 0.0, 1.0, "where he looks, about each axis"),
    "human_uncertainty": Parameter(0.02, "m", 0.0, 1.0, "position uncertainty that perception reports"),
}
"""Names that the FMU plants share mean the same here."""


def values_of(given: Mapping[str, float]) -> dict[str, float]:
    """All parameter values: those given, else the defaults.

    Raises:
        ConfigError: an unknown name, a value outside its range, or a fraction where one of several is chosen.
    """
    for name, value in given.items():
        if name not in PARAMETERS:
            raise ConfigError("parameters", f"the twin has no parameter {name!r}", nearest(name, PARAMETERS))
        p = PARAMETERS[name]
        if not (math.isfinite(value) and p.low <= value <= p.high):
            expected = f"; expected {p.low!r} to {p.high!r} {p.unit}, finite"
            raise ConfigError("parameters", f"{name!r} = {value!r} is out of range", expected)
        if name in _WHOLE and not float(value).is_integer():
            expected = f"; expected a whole number from {p.low:.0f} to {p.high:.0f}"
            raise ConfigError("parameters", f"{name!r} = {value!r} is none of its choices", expected)
    return {name: float(given.get(name, p.start)) for name, p in PARAMETERS.items()}
