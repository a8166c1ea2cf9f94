"""Numbers inside messages by path, e.g. ``angular_velocity[2]`` or ``humans.capsules.a``, and their units."""

from __future__ import annotations

import math
import re
import types
import typing
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeAlias

import msgspec

from foreshock import messages as m
from foreshock.errors import ConfigError, nearest

__all__ = ["Path", "changed", "message_type", "not_a_number", "path_in"]

Path: TypeAlias = Sequence[tuple[str, int | None]]
"""Field names from the outside in, each with an index or None for all."""

PART = re.compile(r"(\w+)(?:\[(\d+)\])?")

_UNITS: Mapping[type, Mapping[str, tuple[str, ...]]] = {
    m.JointState: {"position": ("rad", "m"), "velocity": ("rad/s", "m/s"), "effort": ("N m", "N")},
    m.Imu: {"orientation": ("1",), "angular_velocity": ("rad/s",), "linear_acceleration": ("m/s^2",)},
    m.WrenchStamped: {"force": ("N",), "torque": ("N m",)},
    m.Odometry: {"position": ("m",), "orientation": ("1",), "linear": ("m/s",), "angular": ("rad/s",)},
    m.Detection: {"confidence": ("1",), "center": ("m",), "size": ("m",), "visible": ("1",)},
    m.Capsule: {"a": ("m",), "b": ("m",), "radius": ("m",)},
    m.HumanPose: {"velocity": ("m/s",), "uncertainty": ("m",)},
    m.GripState: {
        "normal_force": ("N",),
        "tangential_force": ("N",),
        "opening": ("m",),
        "commanded_force": ("N",),
        "object_mass": ("kg",),
        "vertical_acceleration": ("m/s^2",),
    },
    m.Heartbeat: {"round_trip_s": ("s",)},
    m.MotionPlan: {"com": ("m",), "speed": ("m/s",)},
    m.PlannedPath: {"x": ("m",), "y": ("m",), "time_from_start": ("s",)},
    m.MotionCommand: {"speed": ("m/s",)},
    m.TaskPhase: {"due_s": ("s",)},
    m.Gaze: {"direction": ("1",), "confidence": ("1",)},
    m.ImageStatistics: {"luminance": ("1",), "contrast": ("1",), "sharpness": ("1",), "saturated": ("1",)},
}
"""Unit of every float of a message; of Scalar only its channel knows it, so that any is taken."""


def message_type(name: str) -> type[m.Message] | None:
    """The message class of a name; None if it is no message of ours."""
    found = getattr(m, name, None)
    return found if isinstance(found, type) and issubclass(found, m.Message) and found is not m.Message else None


def path_in(type_: type, text: str, unit: str, place: str) -> Path:
    """The path that a text names in a message, if it leads to floats of this unit.

    Raises:
        ConfigError: at place, with the nearest names.
    """
    path: list[tuple[str, int | None]] = []
    for part in text.split("."):
        fit = PART.fullmatch(part)
        if fit is None:
            raise ConfigError(place, f"{text!r} is no field, e.g. 'position' or 'position[2]'")
        name, index = fit[1], None if fit[2] is None else int(fit[2])
        if not (isinstance(type_, type) and issubclass(type_, msgspec.Struct)):
            raise ConfigError(place, f"{text!r} goes on after a number")
        if name not in type_.__struct_fields__:
            raise ConfigError(place, f"{type_.__name__} has no field {name!r}", nearest(name, type_.__struct_fields__))
        owner, type_ = type_, _inner(typing.get_type_hints(type_)[name], index, f"{text!r}", place)
        path.append((name, index))
    if type_ is not float:
        inner = f"; go on with .{' or .'.join(_UNITS[type_])}" if type_ in _UNITS else ""
        raise ConfigError(place, f"{text!r} of {owner.__name__} is no measured number", inner)
    units = _UNITS.get(owner, {}).get(name, (unit,))
    if unit not in units:
        raise ConfigError(place, f"{text!r} of {owner.__name__} is in {' or '.join(units)}, the fault in {unit!r}")
    return path


def _inner(hint: Any, index: int | None, text: str, place: str) -> Any:
    """What a field holds, or its elements."""
    if typing.get_origin(hint) in (typing.Union, types.UnionType):
        hint = next(a for a in typing.get_args(hint) if a is not type(None))
    if typing.get_origin(hint) is tuple:
        args = typing.get_args(hint)
        if index is not None and args[-1] is not Ellipsis and index >= len(args):
            raise ConfigError(place, f"{text} has no element {index}; there are {len(args)}, from 0")
        return args[0]
    if index is not None:
        raise ConfigError(place, f"{text} has an index, but is a single value")
    return hint


def changed(value: Any, path: Path, change: Callable[[float], float]) -> Any:
    """A message with the numbers at a path changed; what is absent (None, an empty tuple) stays absent.

    Raises:
        ConfigError: an index lies beyond the numbers that the message carries.
    """
    (name, index), rest = path[0], path[1:]

    def inner(item: Any) -> Any:
        return changed(item, rest, change) if rest else change(item)

    old = getattr(value, name)
    if old is None:
        return value
    if not isinstance(old, tuple):
        return msgspec.structs.replace(value, **{name: inner(old)})
    if index is not None and old and not rest and index >= len(old):
        raise ConfigError("faults.fields", f"{name}[{index}] is not there: {type(value).__name__} carries {len(old)}")
    new = tuple([inner(x) if index is None or k == index else x for k, x in enumerate(old)])
    return msgspec.structs.replace(value, **{name: new})


def not_a_number(value: Any) -> Any:
    """A message with NaN for each of its floats."""
    if isinstance(value, float):
        return math.nan
    if isinstance(value, tuple):
        return tuple(map(not_a_number, value))
    if isinstance(value, msgspec.Struct):
        return msgspec.structs.replace(value, **{f: not_a_number(getattr(value, f)) for f in value.__struct_fields__})
    return value
