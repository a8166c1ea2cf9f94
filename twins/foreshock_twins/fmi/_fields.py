"""How a field of a message is filled: from variables, constants or literals, checked against its annotation."""

from __future__ import annotations

import re
import typing
from typing import Any, Protocol

import msgspec

from foreshock.errors import TwinError, nearest
from foreshock_fmus import TomlTable
from foreshock_twins.fmi._layout import Item, Layout, Reader, Values
from foreshock_twins.fmi._message_units import MESSAGE_UNITS, check_unit
from foreshock_twins.fmi._variables import Variable, Variables

__all__ = ["Source", "read_item", "read_struct"]

_RANGE = re.compile(r"(.+)\[(\d+)\.\.(\d+)\]")


class Source(Protocol):
    """Where a field's value comes from."""

    def items(self) -> tuple[Item, ...]:
        """The variables and constants that it needs."""

    def reader(self, layout: Layout) -> Reader:
        """Makes the value from one step's values."""


class Literal(msgspec.Struct, frozen=True):
    """A value that never changes: text, or a default."""

    value: Any

    def items(self) -> tuple[Item, ...]:
        """None."""
        return ()

    def reader(self, layout: Layout) -> Reader:  # noqa: ARG002 - the port
        """Gives the value itself."""
        value = self.value
        return lambda _: value


class Number(msgspec.Struct, frozen=True):
    """A float, int or bool field; a bool is true above 0.5."""

    item: Item
    kind: type
    what: str

    def items(self) -> tuple[Item, ...]:
        """The one."""
        return (self.item,)

    def reader(self, layout: Layout) -> Reader:
        """Reads and converts; an integer field refuses a fraction."""
        read, what = layout.number(self.item), self.what
        if self.kind is float:
            return read
        if self.kind is bool:
            return lambda values: read(values) > 0.5

        def integer(values: Values) -> int:
            value = read(values)
            if not float(value).is_integer():
                raise TwinError("error", f"{what} must be an integer, the FMU gave {value!r}")
            return int(value)

        return integer


class Vector(msgspec.Struct, frozen=True):
    """A tuple of floats."""

    parts: tuple[Item, ...]

    def items(self) -> tuple[Item, ...]:
        """All components."""
        return self.parts

    def reader(self, layout: Layout) -> Reader:
        """A slice where the components stand side by side."""
        if len(self.parts) == 1:
            read = layout.number(self.parts[0])
            return lambda values: (read(values),)
        return layout.vector(self.parts)


class Names(msgspec.Struct, frozen=True):
    """The names whose variable is above 0.5, in the order of the binding."""

    pairs: tuple[tuple[str, Item], ...]

    def items(self) -> tuple[Item, ...]:
        """The variables."""
        return tuple(item for _, item in self.pairs)

    def reader(self, layout: Layout) -> Reader:
        """Filters the names."""
        readers = [(name, layout.number(item)) for name, item in self.pairs]
        return lambda values: tuple(name for name, read in readers if read(values) > 0.5)


class Choice(msgspec.Struct, frozen=True):
    """A text that changes: one of several, by a variable that counts from 0."""

    item: Item
    names: tuple[str, ...]
    what: str

    def items(self) -> tuple[Item, ...]:
        """The number."""
        return (self.item,)

    def reader(self, layout: Layout) -> Reader:
        """Picks; a number beyond the list is the FMU's error."""
        read, names, what = layout.number(self.item), self.names, self.what

        def chosen(values: Values) -> str:
            value = read(values)
            if not (value >= 0.0 and float(value).is_integer() and value < len(names)):
                raise TwinError("error", f"{what} must be one of 0..{len(names) - 1}, the FMU gave {value!r}")
            return names[int(value)]

        return chosen


def read_struct(
    table: TomlTable, cls: type[msgspec.Struct], variables: Variables, beside: tuple[str, ...] = ()
) -> tuple[Source, ...]:
    """The sources of all fields of a message, in the order of its constructor; beside are other keys.

    Raises:
        ConfigError: an unknown or missing field, a wrong length or type, an unknown variable, another unit.
    """
    fields = {f.name: f for f in msgspec.structs.fields(cls)}
    for name in table.names():
        if name not in fields and name not in beside:
            table.fail(name, f"{cls.__name__} has no such field", nearest(name, fields))
    hints = typing.get_type_hints(cls)
    sources: list[Source] = []
    for name, field in fields.items():
        if table.has(name):
            sources.append(_source(table, name, cls.__name__, hints[name], variables))
        elif field.default is not msgspec.NODEFAULT:
            sources.append(Literal(field.default))
        else:
            table.fail(name, f"is missing; {cls.__name__} needs it", nearest(name, set(table.names()) - set(fields)))
    return tuple(sources)


def read_item(
    table: TomlTable, key: str, value: object, what: str, units: tuple[str, ...], variables: Variables
) -> Item:
    """One variable, checked for its unit, or one constant."""
    if isinstance(value, str):
        variable = variables.readable(table, key, value)
        check_unit(table, key, what, variable, units)
        return variable
    return table.finite(key, value)


def _source(table: TomlTable, key: str, message: str, hint: Any, variables: Variables) -> Source:
    value, what = table.raw(key), f"{message}.{key}"
    if hint is str:
        return _text(table, key, what, variables)
    arguments = typing.get_args(hint)
    if typing.get_origin(hint) is tuple and arguments[0] is str:
        return _names(table, key, what, variables)
    units = MESSAGE_UNITS.get((message, key))
    if units is None:
        table.fail(key, f"{what} cannot be bound to variables")
    if hint is bool and isinstance(value, bool):
        return Literal(value)
    if hint in (float, int, bool):
        if isinstance(value, list) or (isinstance(value, str) and _RANGE.fullmatch(value)):
            table.fail(key, f"is {value!r}", f"; {what} is one number")
        return Number(read_item(table, key, value, what, units, variables), hint, what)
    parts = tuple(read_item(table, key, v, what, units, variables) for v in _spread(table, key, value))
    if arguments[-1] is not Ellipsis and len(parts) != len(arguments):
        table.fail(key, f"has {len(parts)} components", f"; {what} needs {len(arguments)}")
    return Vector(parts)


def _spread(table: TomlTable, key: str, value: object) -> list[object]:
    """A list with its ranges ``q[8..39]`` written out."""
    found: list[object] = []
    for part in value if isinstance(value, list) else [value]:
        match = _RANGE.fullmatch(part) if isinstance(part, str) else None
        if match is None:
            found.append(part)
            continue
        first, last = int(match[2]), int(match[3])
        if first > last:
            table.fail(key, f"{part!r} is an empty range")
        found += [f"{match[1]}[{i}]" for i in range(first, last + 1)]
    return found


def _text(table: TomlTable, key: str, what: str, variables: Variables) -> Source:
    """A text, or ``{ of = [texts], index = variable }``."""
    if not isinstance(table.raw(key), dict):
        return Literal(table.text(key))
    choice = table.table(key)
    texts = choice.raw("of")
    if not (isinstance(texts, list) and texts and all(isinstance(t, str) for t in texts)):
        choice.fail("of", f"is {texts!r}", "; expected a list of texts, the one at index is taken")
    item = read_item(choice, "index", choice.text("index"), f"index of {what}", ("1",), variables)
    choice.done()
    return Choice(item, tuple(texts), what)


def _names(table: TomlTable, key: str, what: str, variables: Variables) -> Source:
    value = table.raw(key)
    if isinstance(value, list) and all(isinstance(v, str) for v in value):
        return Literal(tuple(value))
    if not isinstance(value, dict):
        table.fail(key, f"is {value!r}", "; expected a list of names, or a table of name = variable")
    pairs = table.table(key)
    return Names(tuple((name, _flag(pairs, name, what, variables)) for name in pairs.names()))


def _flag(table: TomlTable, key: str, what: str, variables: Variables) -> Variable:
    variable = variables.readable(table, key, table.text(key))
    check_unit(table, key, what, variable, ("1",))
    return variable
