"""Connected FMUs, stepped together: what runs behind a twin in the place of one FMU."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Literal, TypeVar

from foreshock.errors import TwinError
from foreshock_twins.fmi._instance import FmuInstance
from foreshock_twins.fmi._layout import Layout, Values
from foreshock_twins.fmi._variables import Variable
from foreshock_twins.system._connections import Connection, Order
from foreshock_twins.system._parts import Part, SystemVariables

__all__ = ["FmuSystem", "layouts_of"]

T = TypeVar("T")


def layouts_of(
    layout: Layout, variables: SystemVariables, parts: Iterable[Part], connections: Iterable[Connection]
) -> dict[str, Layout]:
    """What each part must yield: what the binding reads of it, and the outputs that feed others."""
    wanted: dict[str, list[Variable]] = {p.name: [] for p in parts}
    for v in layout.variables:
        part, own = variables.home[v.name]
        wanted[part.name].append(own)
    for c in connections:
        wanted[c.source].append(c.output)
    return {name: Layout(items) for name, items in wanted.items()}


class FmuSystem:
    """Implements foreshock_twins.fmi._twin.Stepper.

    Inputs are held over a communication step. In Gauss-Seidel order a part sees the outputs that the parts before it
    have reached at the end of the step, and of those behind it the ones from its beginning; in Jacobi all from its
    beginning.

    Args:
        variables: of the system.
        layout: what a step yields.
        instances: the FMUs by part.
        layouts: what each of them yields.
        parts: in the order of the file.
        connections: checked.
        order: of the parts.
        coupling: ``gauss-seidel`` or ``jacobi``.
        seed: the binding's seed; None if it has none.
    """

    def __init__(
        self,
        variables: SystemVariables,
        layout: Layout,
        instances: Mapping[str, FmuInstance],
        layouts: Mapping[str, Layout],
        parts: Sequence[Part],
        connections: Sequence[Connection],
        order: Order,
        coupling: Literal["gauss-seidel", "jacobi"],
        seed: Variable | None,
    ) -> None:
        self._variables, self._constants = variables, layout.constants
        self._instances, self._order, self._jacobi = instances, order.parts, coupling == "jacobi"
        self._seed = seed
        self._seeds = [(k, p.name, p.seed) for k, p in enumerate(parts) if p.seed is not None]
        late = set(order.lagging)
        self._feeds: dict[str, list[tuple[Variable, str, int, bool]]] = {p.name: [] for p in parts}
        for c in connections:
            index = layouts[c.source].index(c.output)
            self._feeds[c.target].append((c.input, c.source, index, c in late))
        self._places = []
        for v in layout.variables:
            part, own = variables.home[v.name]
            self._places.append((part.name, layouts[part.name].index(own)))
        self._outputs: dict[str, Values] = {}

    def reset(self) -> None:
        """All parts back to the state after instantiation."""
        self._outputs = {}
        for name in self._order:
            self._guard(name, self._instances[name].reset)

    def initialize(self, values: Mapping[Variable, float]) -> None:
        """Part by part in order, each with the start outputs of those before it."""
        own, outputs = self._by_part(values), self._outputs
        for k, part, variable in self._seeds:
            own[part].setdefault(variable, (0.0 if self._seed is None else values.get(self._seed, 0.0)) + k)
        for name in self._order:
            start = {v: outputs[s][i] for v, s, i, _ in self._feeds[name] if s in outputs}
            self._guard(name, self._instances[name].initialize, own[name] | start)
            outputs[name] = self._guard(name, self._instances[name].read, 0.0)

    def set(self, values: Mapping[Variable, float], t: float = 0.0) -> None:
        """Set inputs that no connection feeds."""
        for name, group in self._by_part(values).items():
            if group:
                self._guard(name, self._instances[name].set, group, t)

    def step(self, t: float, h: float) -> Values:
        """One communication step of all parts."""
        before, outputs = dict(self._outputs), self._outputs
        for name in self._order:
            instance, feeds = self._instances[name], self._feeds[name]
            try:
                if feeds:
                    instance.set({v: (before if late or self._jacobi else outputs)[s][i] for v, s, i, late in feeds}, t)
                outputs[name] = instance.step(t, h)
            except TwinError as error:
                raise _named(name, error) from None
        return self.read(t + h)

    def read(self, t: float) -> Values:  # noqa: ARG002  # the parts have been read at t
        """All bound values; constants last."""
        outputs = self._outputs
        return tuple([outputs[name][i] for name, i in self._places]) + self._constants

    def close(self) -> None:
        """Free all parts; idempotent."""
        for instance in self._instances.values():
            instance.close()

    def _by_part(self, values: Mapping[Variable, float]) -> dict[str, dict[Variable, float]]:
        found: dict[str, dict[Variable, float]] = {name: {} for name in self._order}
        for v, value in values.items():
            part, own = self._variables.home[v.name]
            found[part.name][own] = value
        return found

    @staticmethod
    def _guard(name: str, call: Callable[..., T], *args: object) -> T:
        """Call a part; an error names it."""
        try:
            return call(*args)
        except TwinError as error:
            raise _named(name, error) from None


def _named(name: str, error: TwinError) -> TwinError:
    return TwinError(error.kind, f"part {name!r}: {error.detail}", error.log)
