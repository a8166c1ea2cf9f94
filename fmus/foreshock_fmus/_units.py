"""Units of the FMI standard: an expression such as ``kg.m2/s2`` as exponents of the SI base units and a factor.

FMI 3.0, 2.4.3: value in base units = factor * value + offset; rad counts as a base unit.
"""

from __future__ import annotations

import math
import re
from functools import cache

import msgspec

from foreshock.errors import ConfigError, nearest

__all__ = ["BASE_UNITS", "Unit", "parse_unit"]

BASE_UNITS = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")
_SYMBOL = re.compile(r"([A-Za-z]+|1)\^?(-?\d+)?")


class Unit(msgspec.Struct, frozen=True):
    """A unit by its exponents over BASE_UNITS, and its factor and offset towards them."""

    exponents: tuple[int, ...]
    factor: float = 1.0
    offset: float = 0.0

    def same(self, other: Unit) -> bool:
        """Whether numbers in both units mean the same (factor and offset to 1e-9)."""
        return (
            self.exponents == other.exponents
            and math.isclose(self.factor, other.factor, rel_tol=1e-9)
            and math.isclose(self.offset, other.offset, rel_tol=1e-9, abs_tol=1e-12)
        )


def _unit(factor: float = 1.0, **powers: int) -> Unit:
    return Unit(tuple(powers.get(base, 0) for base in BASE_UNITS), factor)


_SYMBOLS: dict[str, Unit] = {base: _unit(**{base: 1}) for base in BASE_UNITS} | {
    "1": _unit(),
    "N": _unit(kg=1, m=1, s=-2),
    "J": _unit(kg=1, m=2, s=-2),
    "W": _unit(kg=1, m=2, s=-3),
    "Pa": _unit(kg=1, m=-1, s=-2),
    "Hz": _unit(s=-1),
    "V": _unit(kg=1, m=2, s=-3, A=-1),
    "mm": _unit(1e-3, m=1),
    "ms": _unit(1e-3, s=1),
    "g": _unit(1e-3, kg=1),
    "deg": _unit(math.pi / 180.0, rad=1),
}


@cache
def parse_unit(text: str) -> Unit:
    """A unit expression: factors joined by ``.``, after one ``/`` the denominator: ``N.m/rad``, ``kg.m2/s2``, ``1/s``.

    Raises:
        ConfigError: an unknown symbol, or not such an expression.
    """
    parts = text.split("/")
    if not 1 <= len(parts) <= 2:
        raise ConfigError(f"unit {text!r}", "has more than one '/'", "; write it as in kg.m/s2")
    powers, factor = [0] * len(BASE_UNITS), 1.0
    for sign, part in zip((1, -1), parts, strict=False):
        for piece in part.strip("()").split("."):
            match = _SYMBOL.fullmatch(piece)
            if match is None or match[1] not in _SYMBOLS:
                raise ConfigError(f"unit {text!r}", f"{piece!r} is no unit symbol", nearest(piece, _SYMBOLS))
            symbol, power = _SYMBOLS[match[1]], sign * int(match[2] or 1)
            powers = [p + power * e for p, e in zip(powers, symbol.exponents, strict=True)]
            factor *= symbol.factor**power
    return Unit(tuple(powers), factor)
