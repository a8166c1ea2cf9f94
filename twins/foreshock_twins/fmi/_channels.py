"""Channels of a binding: which message, how often, from which variables."""

from __future__ import annotations

import math
import re
import typing
from collections.abc import Callable, Sequence
from typing import Any

import msgspec

from foreshock.clock import NS_PER_S
from foreshock.errors import nearest
from foreshock.messages import AnyMessage, Capsule, Detection, Detections, HumanPose, Humans
from foreshock_fmus import TomlTable
from foreshock_twins.fmi._adult import placed
from foreshock_twins.fmi._fields import Literal, Source, read_item, read_struct
from foreshock_twins.fmi._layout import Item, Layout, Reader, Values
from foreshock_twins.fmi._message_units import check_unit
from foreshock_twins.fmi._variables import Variable, Variables

__all__ = ["MESSAGES", "ChannelBinding", "read_channel", "steps_of"]

MESSAGES: dict[str, type[msgspec.Struct]] = {cls.__name__: cls for cls in typing.get_args(AnyMessage)}
TEMPLATES: dict[str, Callable[..., tuple[Capsule, ...]]] = {"standing-adult": placed}
_CHANNEL = re.compile(r"[A-Za-z0-9_.-]+/[A-Za-z0-9_.-]+")
_POSE = {"x": None, "y": None, "z": 0.0, "yaw": 0.0, "uncertainty": 0.0, "lowered": 0.0}
_HAND = ("hand_x", "hand_y", "hand_z")
_POSE_UNITS = {"yaw": "rad", "vx": "m/s", "vy": "m/s"}
"""Of a human's keys; what is not here is in m."""


class ChannelBinding(msgspec.Struct, frozen=True):
    """One channel.

    Attributes:
        name: ``<subject>/<quantity>``.
        type: message class name.
        every: it is sampled at each n-th communication step.
        stamp: variable with the source time in s; None stamps with the time of the step.
        message: makes the message.
    """

    name: str
    type: str
    every: int
    stamp: Variable | None
    message: Source


class Struct(msgspec.Struct, frozen=True):
    """A message of plain fields."""

    cls: type[msgspec.Struct]
    fields: tuple[Source, ...]

    def items(self) -> tuple[Item, ...]:
        """Those of all fields."""
        return tuple(item for field in self.fields for item in field.items())

    def reader(self, layout: Layout) -> Reader:
        """Calls the constructor with the fields in order."""
        cls = self.cls
        if all(isinstance(f, Literal) for f in self.fields):
            constant = cls(*(f.reader(layout)(()) for f in self.fields))
            return lambda _: constant
        readers = tuple(f.reader(layout) for f in self.fields)
        return lambda values: cls(*[read(values) for read in readers])


class Human(msgspec.Struct, frozen=True):
    """A human from a template of capsules, placed by variables.

    pose is x, y, z, yaw, uncertainty, lowered; hand the right hand's middle in the channel's frame, or nothing where
    it hangs; velocity vx, vy.
    """

    id: str
    template: str
    pose: tuple[Item, ...]
    hand: tuple[Item, ...]
    velocity: tuple[Item, ...]

    def items(self) -> tuple[Item, ...]:
        """Pose, then hand, then velocity."""
        return self.pose + self.hand + self.velocity

    def reader(self, layout: Layout) -> Reader:
        """Places the template; a human who stands still is placed once."""
        pose, velocity = layout.vector(self.pose + self.hand), layout.vector(self.velocity)
        place, name = TEMPLATES[self.template], self.id
        last: tuple[Values, tuple[Capsule, ...]] | None = None

        def read(values: Values) -> HumanPose:
            nonlocal last
            at = pose(values)
            if last is None or last[0] != at:
                last = (at, place(at[0], at[1], at[2], at[3], at[5], tuple(at[6:])))
            v = velocity(values)
            return HumanPose(name, last[1], (v[0], v[1], 0.0) if v else None, at[4])

        return read


class Row(msgspec.Struct, frozen=True):
    """A message that holds a tuple of structs: Humans, Detections. when says of each part whether it is seen now."""

    cls: Callable[..., Any]
    parts: tuple[Source, ...]
    when: tuple[Item, ...]
    frame_id: str

    def items(self) -> tuple[Item, ...]:
        """Those of all parts."""
        return (*self.when, *(item for part in self.parts for item in part.items()))

    def reader(self, layout: Layout) -> Reader:
        """Reads part by part; a part is there while its ``when`` is above 0.5."""
        cls, frame, readers = self.cls, self.frame_id, tuple(part.reader(layout) for part in self.parts)
        if all(item == 1.0 for item in self.when):
            return lambda values: cls(tuple([read(values) for read in readers]), frame)
        pairs = tuple(zip((layout.number(item) for item in self.when), readers, strict=True))
        return lambda values: cls(tuple([read(values) for seen, read in pairs if seen(values) > 0.5]), frame)


def steps_of(table: TomlTable, key: str, period_s: float, step_s: float) -> int:
    """How many communication steps a period is; it must be a whole number of them (to 1e-6 of a step)."""
    steps = round(period_s / step_s)
    if steps < 1 or not math.isclose(steps * step_s, period_s, rel_tol=0.0, abs_tol=1e-6 * step_s):
        table.fail(key, f"is {period_s!r} s", f"; expected a multiple of the step, {step_s!r} s")
    return steps


def read_channel(table: TomlTable, step_ns: int, variables: Variables) -> ChannelBinding:
    """One ``[[channels]]`` table.

    Raises:
        ConfigError: naming the key, what is wrong and the nearest right name.
    """
    name, kind = table.text("name"), table.text("type")
    if not _CHANNEL.fullmatch(name):
        table.fail("name", f"is {name!r}", "; expected <subject>/<quantity>, e.g. imu/base")
    if kind not in MESSAGES:
        table.fail("type", f"there is no message {kind!r}", nearest(kind, MESSAGES))
    every = steps_of(table, "period_s", table.number("period_s"), step_ns / NS_PER_S)
    stamp = None
    if table.has("stamp"):
        stamp = variables.readable(table, "stamp", table.text("stamp"))
        check_unit(table, "stamp", "a source time", stamp, ("s",))
    message = _message(table, MESSAGES[kind], variables)
    table.done()
    return ChannelBinding(name, kind, every, stamp, message)


def _message(table: TomlTable, cls: type[msgspec.Struct], variables: Variables) -> Source:
    fields = table.table("fields")
    if cls is Humans:
        tables = table.tables("humans")
        humans = tuple(_human(t, variables) for t in tables)
        _check_ids(table, "humans", [h.id for h in humans])
        return Row(Humans, humans, _whens(tables, variables), _frame(fields))
    if cls is Detections:
        tables = table.tables("detections")
        whens = _whens(tables, variables)
        rows = tuple(Struct(Detection, read_struct(t, Detection, variables, ("when",))) for t in tables)
        return Row(Detections, rows, whens, _frame(fields))
    message = Struct(cls, read_struct(fields, cls, variables))
    if cls.__name__ == "JointState":
        _check_joints(fields, message, cls)
    return message


def _frame(fields: TomlTable) -> str:
    frame = fields.text("frame_id", "odom")
    fields.done()
    return frame


def _whens(tables: Sequence[TomlTable], variables: Variables) -> tuple[Item, ...]:
    """The variable of each part that says whether it is seen; 1 where none is named."""
    return tuple(
        read_item(t, "when", t.text("when"), "a flag", ("1",), variables) if t.has("when") else 1.0 for t in tables
    )


def _check_joints(fields: TomlTable, message: Struct, cls: type[msgspec.Struct]) -> None:
    """sensor_msgs/JointState: all rows have the length of name, or are empty."""
    by_name = dict(zip(cls.__struct_fields__, message.fields, strict=True))
    names = by_name["name"]
    if not isinstance(names, Literal):
        fields.fail("name", "joint names cannot change", "; expected a list of names")
    for key in ("position", "velocity", "effort"):
        n = len(by_name[key].items())
        if n != len(names.value) and (n or key == "position"):
            fields.fail(key, f"has {n} components", f"; there are {len(names.value)} joint names")


def _human(table: TomlTable, variables: Variables) -> Human:
    human_id, template = table.text("id"), table.text("template")
    if template not in TEMPLATES:
        table.fail("template", f"there is no template {template!r}", nearest(template, TEMPLATES))
    pose: list[Item] = []
    for key, default in _POSE.items():
        if not table.has(key) and default is not None:
            pose.append(default)
            continue
        if not table.has(key):
            table.fail(key, "is missing")
        pose.append(_placing(table, key, variables))
    if table.has("vx") != table.has("vy"):
        table.fail("vy" if table.has("vx") else "vx", "is missing", "; give both components of the velocity, or none")
    given = [key for key in _HAND if table.has(key)]
    if given and len(given) < len(_HAND):
        missing = next(key for key in _HAND if key not in given)
        table.fail(missing, "is missing", "; give all three coordinates of the right hand, or none")
    hand = tuple(_placing(table, key, variables) for key in given)
    velocity = tuple(_placing(table, key, variables) for key in ("vx", "vy") if table.has(key))
    if table.has("when"):
        table.text("when")
    table.done()
    return Human(human_id, template, tuple(pose), hand, velocity)


def _placing(table: TomlTable, key: str, variables: Variables) -> Item:
    return read_item(table, key, table.raw(key), f"a human's {key}", (_POSE_UNITS.get(key, "m"),), variables)


def _check_ids(table: TomlTable, key: str, ids: Sequence[str]) -> None:
    for name in ids:
        if ids.count(name) > 1:
            table.fail(key, f"id {name!r} is given twice")
