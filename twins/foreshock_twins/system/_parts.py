"""The parts of a system and their variables, under one roof: ``<part>.<variable>``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import msgspec

from foreshock.errors import ConfigError, nearest
from foreshock_twins.fmi._variables import Variable, Variables

__all__ = ["Part", "SystemVariables"]


class Part(msgspec.Struct, frozen=True):
    """One FMU of a system.

    Attributes:
        name: of the part.
        variables: its variables under their own names.
        depends: output -> inputs that it depends on directly; every input where its FMU does not say.
        undeclared: outputs of which its FMU does not say.
        seed: parameter that receives the seed; None if there is none.
    """

    name: str
    variables: Variables
    depends: Mapping[str, frozenset[str]]
    undeclared: frozenset[str]
    seed: Variable | None = None

    @classmethod
    def of(cls, name: str, description: Any, fmu: str, seed: str = "") -> Part:
        """A part from FMPy's ModelDescription.

        Raises:
            ConfigError: seed is no parameter of it.
        """
        variables = Variables(description, fmu)
        inputs = frozenset(v.name for v in variables.values() if v.causality == "input")
        said = {u.variable.name: u.dependencies for u in description.outputs if u.variable is not None}
        depends: dict[str, frozenset[str]] = {}
        for v in variables.values():
            if v.causality == "output":
                given = said.get(v.name)
                depends[v.name] = inputs if given is None else inputs & {d.name for d in given}
        undeclared = frozenset(name for name in depends if said.get(name) is None)
        found = None
        if seed:
            found = variables.find(seed, f"twin.parts.{name}.seed")
            if found.causality != "parameter":
                problem = f"{seed!r} is of causality {found.causality}"
                raise ConfigError(f"twin.parts.{name}.seed", problem, "; expected a parameter")
        return cls(name, variables, depends, undeclared, found)


class SystemVariables(Variables):
    """All variables of all parts, named ``<part>.<variable>`` and numbered through.

    Args:
        parts: by order of the file.
        fed: inputs that a connection feeds; to a binding these are no longer inputs.
    """

    def __init__(self, parts: Sequence[Part], fed: frozenset[str] = frozenset()) -> None:
        self.fmu = f"the system of {', '.join(p.name for p in parts)}"
        self.home: dict[str, tuple[Part, Variable]] = {}
        self._known: dict[str, Variable] = {}
        self._shapes: dict[str, Any] = {}
        for part in parts:
            for own in part.variables.values():
                name = f"{part.name}.{own.name}"
                shape = part.variables.shape(own.name)
                if shape:
                    self._shapes[name] = shape
                causality = "connected" if name in fed else own.causality
                self._known[name] = msgspec.structs.replace(
                    own, name=name, reference=len(self._known), causality=causality
                )
                self.home[name] = (part, own)

    def end(self, name: str, place: str, causality: str, parts: Sequence[Part]) -> Variable:
        """One end of a connection.

        Raises:
            ConfigError: no such part, no such variable, or it is of another causality.
        """
        head, _, tail = name.partition(".")
        names = [p.name for p in parts]
        if head not in names or not tail:
            raise ConfigError(place, f"{name!r} is not <part>.<variable>", nearest(head, names))
        fitting = [n for n, v in self._known.items() if v.causality == causality and n.startswith(f"{head}.")]
        if name not in self._known:
            raise ConfigError(place, f"part {head!r} has no variable {tail!r}", nearest(name, fitting))
        variable = self.find(name, place)
        if variable.causality != causality:
            problem = f"{name!r} is of causality {variable.causality}, {causality} is expected"
            raise ConfigError(place, problem, nearest(name, fitting))
        return variable
