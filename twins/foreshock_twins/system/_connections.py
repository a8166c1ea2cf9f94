"""Connections between parts: checked, free of algebraic loops, and an order in which the parts step.

An output may depend on an input of its part directly, or only by way of the part's state. If around a loop of
connections every output depends directly on the input before it, the values at one instant must satisfy an equation
y = f(y) together: an algebraic loop. Stepping would iterate it once per communication step, whether or not that
converges, so it is refused with the cycle named. A loop with a state in it is sound: one of its connections then
carries a value that is one communication step old, an error of the order of the step.
"""

from __future__ import annotations

from collections.abc import Sequence
from graphlib import CycleError, TopologicalSorter

import msgspec

from foreshock.errors import ConfigError
from foreshock_twins.fmi._variables import Variable
from foreshock_twins.system import ConnectionConfig
from foreshock_twins.system._parts import Part, SystemVariables

__all__ = ["Connection", "Order", "connect", "order_of"]

REALS = frozenset(["Real", "Float64", "Float32"])


class Connection(msgspec.Struct, frozen=True):
    """An output that feeds an input: names of both parts, and both variables under their own names."""

    source: str
    output: Variable
    target: str
    input: Variable
    delayed: bool = False

    @property
    def text(self) -> str:
        """``part.output -> part.input``."""
        return f"{self.source}.{self.output.name} -> {self.target}.{self.input.name}"


class Order(msgspec.Struct, frozen=True):
    """How the parts step.

    Attributes:
        parts: their order.
        lagging: connections that carry the value of the last communication point, because they run against the order.
    """

    parts: tuple[str, ...]
    lagging: tuple[Connection, ...]


def connect(given: Sequence[ConnectionConfig], parts: Sequence[Part]) -> tuple[Connection, ...]:
    """The connections, checked.

    Raises:
        ConfigError: an end does not exist or is of the wrong causality, units or types differ, an input is fed
            twice, or the connections form an algebraic loop.
    """
    variables = SystemVariables(parts)
    found: list[Connection] = []
    fed: dict[str, int] = {}
    for k, c in enumerate(given):
        place = f"twin.connections[{k}]"
        output = variables.end(c.from_, f"{place}.from", "output", parts)
        target = variables.end(c.to, f"{place}.to", "input", parts)
        if c.to in fed:
            raise ConfigError(f"{place}.to", f"{c.to!r} is fed twice, by connections[{fed[c.to]}] as well")
        fed[c.to] = k
        _check_units(place, c, output, target)
        (source, own_output), (sink, own_input) = variables.home[c.from_], variables.home[c.to]
        found.append(Connection(source.name, own_output, sink.name, own_input, c.delayed))
    _refuse_loops(found, parts)
    return tuple(found)


def _check_units(place: str, c: ConnectionConfig, output: Variable, target: Variable) -> None:
    """Units of both ends must mean the same where both are declared; numbers must be of one sort."""
    a, b = output.unit, target.unit
    same = output.unit_name == target.unit_name or (a is not None and b is not None and a.same(b))
    if output.unit_name and target.unit_name and not same:
        problem = f"{c.from_!r} is in {output.unit_name!r}, {c.to!r} in {target.unit_name!r}"
        raise ConfigError(place, problem, "; expected the same unit at both ends")
    if output.type != target.type and not {output.type, target.type} <= REALS:
        problem = f"{c.from_!r} is of type {output.type}, {c.to!r} of type {target.type}"
        raise ConfigError(place, problem, "; expected the same type at both ends")


def _refuse_loops(connections: Sequence[Connection], parts: Sequence[Part]) -> None:
    """Name the cycle if values of one instant depend on themselves."""
    before: dict[str, set[str]] = {}
    for c in connections:
        if not c.delayed:
            before.setdefault(f"{c.target}.{c.input.name}", set()).add(f"{c.source}.{c.output.name}")
    for part in parts:
        for output, inputs in part.depends.items():
            before.setdefault(f"{part.name}.{output}", set()).update(f"{part.name}.{name}" for name in inputs)
    try:
        TopologicalSorter({name: sorted(before[name]) for name in sorted(before)}).prepare()
    except CycleError as error:
        cycle: list[str] = error.args[1]
        unsaid = {f"{p.name}.{name}" for p in parts for name in p.undeclared}
        guess = next((name for name in cycle if name in unsaid), None)
        hint = "; set delayed = true on one of its connections, which then carries the value of the last step"
        if guess is not None:
            hint = f"; what {guess!r} depends on is not said in its FMU, so that every input counts{hint}"
        raise ConfigError("twin.connections", f"algebraic loop: {' -> '.join(cycle)}", hint) from None


def order_of(connections: Sequence[Connection], parts: Sequence[Part]) -> Order:
    """An order of the parts in which as few connections as a greedy choice allows run backwards.

    Connections into an input that some output depends on directly come first, then the others, each by the order of the
    file; one that would close a cycle of parts runs backwards. Parts that nothing orders keep the order of the file.
    """
    direct = {p.name: frozenset().union(*p.depends.values()) for p in parts}
    ranked = sorted(connections, key=lambda c: c.input.name not in direct[c.target])
    before: dict[str, list[str]] = {p.name: [] for p in parts}
    lagging = [c for c in connections if c.delayed]
    for c in ranked:
        if c.delayed:
            continue
        if c.source == c.target or _reaches(c.target, c.source, before):
            lagging.append(c)
        else:
            before[c.target].append(c.source)
    return Order(tuple(TopologicalSorter(before).static_order()), tuple(lagging))


def _reaches(first: str, last: str, before: dict[str, list[str]]) -> bool:
    """Whether first must step before last."""
    return last == first or any(_reaches(first, name, before) for name in before[last])
