"""The binding file: how an FMU's variables become channels, interventions, events and probes."""

from __future__ import annotations

import difflib
import re
from pathlib import Path
from typing import Literal

import msgspec

from foreshock.clock import ns
from foreshock.errors import nearest
from foreshock.policy import ACTIONS
from foreshock.taxonomy import builtin_taxonomy
from foreshock_fmus import TomlTable
from foreshock_twins.fmi._channels import ChannelBinding, read_channel
from foreshock_twins.fmi._layout import Item
from foreshock_twins.fmi._variables import Variable, Variables

__all__ = ["Binding", "Condition", "EventBinding", "InputTarget", "read_binding"]

_KEBAB = re.compile(r"[a-z0-9]+(-[a-z0-9]+)*")
# A similarity as difflib.SequenceMatcher.ratio gives it; above, a name counts as a known one misspelt.
_MISSPELT = 0.75


class InputTarget(msgspec.Struct, frozen=True):
    """The value that an input takes when an action has strength 1; in between it is linear from the start value."""

    variable: Variable
    start: float
    target: float


class Condition(msgspec.Struct, frozen=True):
    """A variable strictly above or below a bound."""

    variable: Variable
    side: Literal["above", "below"]
    bound: float


class EventBinding(msgspec.Struct, frozen=True):
    """An event that the referee sees when all conditions hold; its value is then the running maximum of a variable."""

    id: str
    mode: str
    when: tuple[Condition, ...]
    value: Variable
    limit: float
    unit: str


class Binding(msgspec.Struct, frozen=True):
    """All that a binding file says, resolved against one FMU's variables."""

    step_ns: int
    seed: Variable | None
    channels: tuple[ChannelBinding, ...]
    actions: dict[str, tuple[InputTarget, ...]]
    events: tuple[EventBinding, ...]
    probes: dict[str, Variable]

    def items(self) -> list[Item]:
        """Every variable and constant that a step must yield, in the order of use."""
        found: list[Item] = [item for c in self.channels for item in c.message.items()]
        found += [c.stamp for c in self.channels if c.stamp is not None]
        found += [v for e in self.events for v in (e.value, *(c.variable for c in e.when))]
        return found + list(self.probes.values())


def read_binding(path: Path, variables: Variables) -> Binding:
    """Read a binding file and resolve it.

    Raises:
        ConfigError: naming the file, the key path, what is wrong and the nearest right name.
    """
    top = TomlTable.read(path)
    head = top.table("binding", required=True)
    step_s = head.number("step_s")
    step_ns = ns(step_s)
    if step_ns < 1:
        head.fail("step_s", f"is {step_s!r}", "; expected a time of at least 1 ns in s")
    seed = _parameter(head, "seed", variables) if head.has("seed") else None
    head.done()
    channels = tuple(read_channel(t, step_ns, variables) for t in top.tables("channels"))
    names = [c.name for c in channels]
    for i, name in enumerate(names):
        if name in names[:i]:
            top.fail(f"channels[{i}].name", f"{name!r} is given twice")
    actions: dict[str, tuple[InputTarget, ...]] = {}
    for table in top.tables("interventions"):
        action, targets = _action(table, variables)
        if action in actions:
            table.fail("action", f"{action!r} is given twice")
        actions[action] = targets
    events = tuple(_event(t, variables) for t in top.tables("events"))
    probes_table = top.table("probes")
    probes = {name: variables.readable(probes_table, name, probes_table.text(name)) for name in probes_table.names()}
    top.done()
    return Binding(step_ns, seed, channels, actions, events, probes)


def _parameter(table: TomlTable, key: str, variables: Variables) -> Variable:
    variable = variables.find(table.text(key), table.place(key))
    if variable.causality != "parameter":
        table.fail(key, f"{variable.name!r} is of causality {variable.causality}", "; expected a parameter")
    return variable


def _action(table: TomlTable, variables: Variables) -> tuple[str, tuple[InputTarget, ...]]:
    action = _action_id(table)
    inputs = table.table("inputs", required=True)
    targets = tuple(_target(inputs, name, variables) for name in inputs.names())
    if not targets:
        table.fail("inputs", "is empty", "; expected input = value at strength 1")
    table.done()
    return action, targets


def _action_id(table: TomlTable) -> str:
    """An action that Foreshock knows, or one of a policy plugin; misspelt, a protocol would never reach the plant."""
    action = table.text("action")
    if action in ACTIONS:
        return action
    if close := difflib.get_close_matches(action.lower(), sorted(ACTIONS), n=1, cutoff=_MISSPELT):
        table.fail("action", f"{action!r} is not a known action", f"; did you mean {close[0]!r}?")
    if not _KEBAB.fullmatch(action):
        table.fail("action", f"{action!r} is not an action's id", "; expected one in kebab-case, e.g. 'balance-lock'")
    return action


def _target(table: TomlTable, name: str, variables: Variables) -> InputTarget:
    variable = variables.find(name, table.place(name))
    if variable.causality != "input":
        inputs = [v.name for v in variables.values() if v.causality == "input"]
        hint = nearest(name, inputs) or f"; the FMU has {len(inputs)} inputs"
        table.fail(name, f"is of causality {variable.causality}, but an intervention sets an input", hint)
    value = table.number(name)
    if not variable.min <= value <= variable.max:
        table.fail(name, f"is {value!r}", f"; the input's range is [{variable.min!r}, {variable.max!r}]")
    return InputTarget(variable, 0.0 if variable.start is None else variable.start, value)


def _event(table: TomlTable, variables: Variables) -> EventBinding:
    value = variables.readable(table, "value", table.text("value"))
    when = tuple(_condition(t, variables) for t in table.tables("when"))
    if not when:
        table.fail("when", "is missing or empty", "; expected [{variable = ..., above = ...}]")
    unit = table.text("unit", value.unit_name or "1")
    if value.unit_name and unit != value.unit_name:
        table.fail("unit", f"is {unit!r}", f"; variable {value.name!r} is in {value.unit_name!r}")
    mode, codes = table.text("mode", ""), builtin_taxonomy().codes
    if mode and mode not in codes:
        table.fail("mode", f"{mode!r} is not the code of an accident mode", nearest(mode, codes))
    event = EventBinding(table.text("id"), mode, when, value, table.number("limit"), unit)
    table.done()
    return event


def _condition(table: TomlTable, variables: Variables) -> Condition:
    variable = variables.readable(table, "variable", table.text("variable"))
    if table.has("above") == table.has("below"):
        table.fail("above", "give one of above and below")
    side: Literal["above", "below"] = "above" if table.has("above") else "below"
    condition = Condition(variable, side, table.number(side))
    table.done()
    return condition
