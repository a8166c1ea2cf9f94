"""The variables of an FMU, as its model description declares them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

import msgspec

from foreshock.errors import ConfigError, nearest
from foreshock_fmus import BASE_UNITS, TomlTable, Unit, parse_unit

__all__ = ["NUMERIC", "Variable", "Variables"]

# FMI type names whose values are numbers; FMI 2 enumerations are read as Integer, those of FMI 3 as Int64.
NUMERIC = frozenset(
    ["Real", "Integer", "Boolean", "Enumeration", "Float64", "Float32"]
    + [f"{sign}Int{bits}" for sign in ("", "U") for bits in (8, 16, 32, 64)]
)


class Variable(msgspec.Struct, frozen=True):
    """A scalar variable.

    Attributes:
        name: its name.
        reference: value reference.
        type: FMI type name: Real, Integer, Boolean, Float64, Int32, ...
        causality: parameter, calculatedParameter, input, output, local, independent.
        unit_name: unit as declared, ``""`` if none.
        unit: what the unit means; None if none is declared or the FMU does not define it.
        start: start value, None if it has none.
        min: smallest legal value.
        max: largest legal value.
    """

    name: str
    reference: int
    type: str
    causality: str
    unit_name: str = ""
    unit: Unit | None = None
    start: float | None = None
    min: float = -math.inf
    max: float = math.inf


class Variables(Mapping[str, Variable]):
    """All variables by name, with errors that name the nearest.

    Args:
        description: FMPy's ModelDescription.
        fmu: what to call the FMU in errors.
    """

    def __init__(self, description: Any, fmu: str) -> None:
        self.fmu = fmu
        units = {u.name: _unit(u) for u in description.unitDefinitions}
        self._shapes = {v.name: v.shape for v in description.modelVariables if v.shape}
        self._known = {v.name: _variable(v, units) for v in description.modelVariables}

    def __getitem__(self, name: str) -> Variable:
        return self._known[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._known)

    def __len__(self) -> int:
        return len(self._known)

    def shape(self, name: str) -> tuple[int, ...]:
        """Shape of an array; empty for a scalar."""
        return tuple(self._shapes.get(name, ()))

    def find(self, name: str, place: str) -> Variable:
        """A variable that holds a number.

        Args:
            name: its name.
            place: where it was named, for the error.

        Raises:
            ConfigError: there is none of that name, or it is no scalar number.
        """
        variable = self._known.get(name)
        if variable is None:
            raise ConfigError(place, f"{self.fmu} has no variable {name!r}", nearest(name, self._known))
        if variable.type not in NUMERIC:
            problem = f"variable {name!r} is of type {variable.type}"
            raise ConfigError(place, problem, "; expected a number or a Boolean")
        if name in self._shapes:
            problem = f"variable {name!r} is an array of shape {self._shapes[name]}"
            raise ConfigError(place, problem, "; only scalars can be bound")
        return variable

    def readable(self, table: TomlTable, key: str, name: str) -> Variable:
        """A variable for a channel, event or probe; an input is none: it says what was asked, not what happened."""
        variable = self.find(name, table.place(key))
        if variable.causality == "input":
            outputs = [v.name for v in self._known.values() if v.causality in ("output", "local")]
            table.fail(key, f"{name!r} is an input", f"; expected an output{nearest(name, outputs)}")
        return variable


def _variable(v: Any, units: dict[str, Unit | None]) -> Variable:
    declared = v.declaredType
    unit_name = v.unit or (declared.unit if declared is not None else None) or ""
    low = v.min if v.min is not None else (declared.min if declared is not None else None)
    high = v.max if v.max is not None else (declared.max if declared is not None else None)
    numeric = v.type in NUMERIC and not v.shape
    return Variable(
        name=v.name,
        reference=v.valueReference,
        type=v.type,
        causality=v.causality,
        unit_name=unit_name,
        unit=units.get(unit_name),
        start=_number(v.start) if numeric and v.start is not None else None,
        min=-math.inf if low is None or not numeric else _number(low),
        max=math.inf if high is None or not numeric else _number(high),
    )


def _number(text: object) -> float:
    """A start, min or max attribute; an XML Boolean counts as 0 or 1."""
    name = str(text)
    return float(name == "true") if name in ("true", "false") else float(name)


def _unit(u: Any) -> Unit | None:
    base = u.baseUnit
    if base is not None:
        return Unit(tuple(int(getattr(base, symbol)) for symbol in BASE_UNITS), float(base.factor), float(base.offset))
    try:
        return parse_unit(u.name)
    except ConfigError:
        return None
