"""A plant's description: what ``<plant>.toml`` says, checked."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Literal, TypeAlias, cast

import msgspec

from foreshock.errors import ConfigError, nearest
from foreshock_fmus._toml import TomlTable
from foreshock_fmus._units import parse_unit

__all__ = ["Causality", "PlantDescription", "PlantVariable", "read_plant"]

Causality: TypeAlias = Literal["parameter", "input", "output"]
_CAUSALITIES = ("parameter", "input", "output")
_IDENTIFIER = re.compile(r"[A-Za-z_]\w*", re.ASCII)
_NAME = re.compile(r"([A-Za-z_]\w*(?:\.[A-Za-z_]\w*)*)(?:\[(\d+)\.\.(\d+)\])?", re.ASCII)


class PlantVariable(msgspec.Struct, frozen=True):
    """A scalar, or a row of scalars ``q[1..39]`` with consecutive value references.

    Attributes:
        name: base name, without the indices; structured naming: dots allowed.
        first: first index of a row, None for a scalar.
        start: start values, one per scalar; empty for an output, which the plant computes.
        size: number of scalars.
        causality: who sets it: the run (parameter), the importer (input), the plant (output).
        unit: unit expression, ``1`` if dimensionless.
        description: for people.
        min: smallest legal value, for each scalar.
        max: largest legal value.
        depends: of an output, the inputs that it depends on directly, not through the state; None if that is not said.
    """

    name: str
    first: int | None
    size: int
    start: tuple[float, ...]
    causality: Causality
    unit: str
    description: str
    min: float
    max: float
    depends: tuple[str, ...] | None = None

    @property
    def symbol(self) -> str:
        """Its name as part of a C identifier."""
        return self.name.replace(".", "_")

    def scalars(self) -> tuple[str, ...]:
        """The names of its scalars: ``q[1]``, ``q[2]``, ..."""
        if self.first is None:
            return (self.name,)
        return tuple(f"{self.name}[{i}]" for i in range(self.first, self.first + self.size))


class PlantDescription(msgspec.Struct, frozen=True):
    """All that ``<plant>.toml`` says."""

    id: str
    title: str
    description: str
    default_step_s: float
    variables: tuple[PlantVariable, ...]

    @property
    def n_scalars(self) -> int:
        """Number of value references, without time."""
        return sum(v.size for v in self.variables)


def read_plant(path: Path) -> PlantDescription:
    """Read and check a plant's description.

    Raises:
        ConfigError: naming the file, the key and what was expected.
    """
    top = TomlTable.read(path)
    head = top.table("plant", required=True)
    plant_id = head.text("id")
    if not _IDENTIFIER.fullmatch(plant_id):
        head.fail("id", f"{plant_id!r} is no C identifier", "; letters, digits and _ alone (FMI model identifier)")
    if plant_id != path.stem:
        head.fail("id", f"is {plant_id!r}", f"; the file's name says {path.stem!r}")
    step = head.number("default_step_s")
    if step <= 0.0:
        head.fail("default_step_s", f"is {step!r}", "; expected a time > 0 in s")
    title, text = head.text("title"), head.text("description", "")
    head.done()
    variables = tuple(_variable(table) for table in top.tables("variables"))
    top.done()
    if not variables:
        top.fail("variables", "is missing or empty", "; expected [[variables]] tables")
    _check_names(path, variables)
    return PlantDescription(plant_id, title, text, step, variables)


def _variable(table: TomlTable) -> PlantVariable:
    full = table.text("name")
    match = _NAME.fullmatch(full)
    if match is None:
        table.fail("name", f"{full!r} is no variable name", "; expected one like base.roll or q[1..39]")
    base, first, last = match[1], match[2], match[3]
    size = 1 if first is None else int(last) - int(first) + 1
    if size < 1:
        table.fail("name", f"{full!r} is an empty range")
    causality = table.text("causality")
    if causality not in _CAUSALITIES:
        table.fail("causality", f"is {causality!r}", nearest(causality, _CAUSALITIES))
    unit = table.text("unit", "1")
    try:
        parse_unit(unit)
    except ConfigError as error:
        table.fail("unit", str(error))
    low, high = table.optional_number("min"), table.optional_number("max")
    low, high = -math.inf if low is None else low, math.inf if high is None else high
    if low > high:
        table.fail("min", f"is {low!r}", f"; max is {high!r}")
    start = _start(table, size, causality)
    for value in start:
        if not low <= value <= high:
            table.fail("start", f"{value!r} is outside [{low!r}, {high!r}]")
    text = table.text("description", "")
    depends = _depends(table, causality)
    table.done()
    index = None if first is None else int(first)
    return PlantVariable(base, index, size, start, cast(Causality, causality), unit, text, low, high, depends)


def _depends(table: TomlTable, causality: str) -> tuple[str, ...] | None:
    value = table.raw("depends")
    if value is None:
        return None
    if causality != "output":
        table.fail("depends", f"is given, but {causality} is its causality", "; an output depends on inputs")
    if not isinstance(value, list) or not all(isinstance(name, str) for name in value):
        table.fail("depends", f"is {value!r}", "; expected a list of inputs")
    return tuple(value)


def _start(table: TomlTable, size: int, causality: str) -> tuple[float, ...]:
    value = table.raw("start")
    if causality == "output":
        if value is not None:
            table.fail("start", f"is {value!r} for an output", "; an output is set by plant_init")
        return ()
    if value is None:
        table.fail("start", f"is missing; every {causality} needs one")
    if not isinstance(value, list):
        return (table.finite("start", value),) * size
    if len(value) != size:
        table.fail("start", f"has {len(value)} values", f"; expected {size}, or one number for all")
    return tuple(table.finite("start", v) for v in value)


def _check_names(path: Path, variables: tuple[PlantVariable, ...]) -> None:
    seen: dict[str, str] = {"time": "time (the independent variable)"}
    for v in variables:
        if v.symbol in seen:
            problem = f"{v.name!r} clashes with {seen[v.symbol]!r}"
            raise ConfigError(f"{path}: variables", problem, "; names must differ in C too")
        seen[v.symbol] = v.name
    inputs = [v.name for v in variables if v.causality == "input"]
    for v in variables:
        for name in v.depends or ():
            if name not in inputs:
                place = f"{path}: {v.name}.depends"
                raise ConfigError(place, f"there is no input {name!r}", nearest(name, inputs))
