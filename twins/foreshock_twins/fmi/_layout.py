"""Where each bound number stands in the tuple of values that one step yields."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from operator import itemgetter
from typing import Any, TypeAlias

from foreshock_twins.fmi._variables import Variable

__all__ = ["Item", "Layout", "Reader", "Values"]

Values: TypeAlias = tuple[float, ...]
Item: TypeAlias = "Variable | float"
Reader: TypeAlias = Callable[[Values], Any]

_DOUBLE = ("Real", "Float64")


class Layout:
    """An order of items: doubles first, for they come from one call, then other variables by type, then constants.

    Args:
        items: variables and constants, in the order of their use, so that a message's vectors become slices.
    """

    def __init__(self, items: Iterable[Item]) -> None:
        unique = list(dict.fromkeys(items))
        variables = [item for item in unique if isinstance(item, Variable)]
        types = sorted({v.type for v in variables}, key=lambda t: (t not in _DOUBLE, t))
        self.groups: tuple[tuple[str, tuple[Variable, ...]], ...] = tuple(
            (t, tuple(v for v in variables if v.type == t)) for t in types
        )
        self.constants: Values = tuple(item for item in unique if not isinstance(item, Variable))
        order: list[Item] = [v for _, group in self.groups for v in group]
        self.variables: tuple[Variable, ...] = tuple(v for _, group in self.groups for v in group)
        self._index = {item: i for i, item in enumerate([*order, *self.constants])}

    def index(self, item: Item) -> int:
        """The place of an item in the values."""
        return self._index[item]

    def number(self, item: Item) -> Reader:
        """Reads one number."""
        return itemgetter(self._index[item])

    def vector(self, items: tuple[Item, ...]) -> Reader:
        """Reads a tuple of numbers."""
        indices = [self._index[item] for item in items]
        if not indices:
            return lambda _: ()
        if indices == list(range(indices[0], indices[0] + len(indices))):
            return itemgetter(slice(indices[0], indices[0] + len(indices)))
        return itemgetter(*indices)
