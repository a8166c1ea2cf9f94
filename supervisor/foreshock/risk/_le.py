"""The Logistic-Exponential model (Eq. 1): accident probability from the diversity and recurrence of precursors."""

from __future__ import annotations

import math
from typing import overload

import msgspec
import numpy as np
from numpy.typing import ArrayLike, NDArray

from foreshock.errors import ConfigError

__all__ = ["LogisticExponential"]


class LogisticExponential(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """P = (1 - exp(-c q)) / (1 + exp(-a (m - b))), Eq. 1.

    Attributes:
        a: gain of the logistic escalation, > 0; the paper uses 1.6.
        b: number of distinct precursors at which it is half way; the paper uses 2.
        c: how fast recurrence saturates, > 0; the paper uses 1.2.

    Raises:
        ConfigError: a or c is not a positive number, or b not a number.
    """

    a: float = 1.6
    b: float = 2.0
    c: float = 1.2

    def __post_init__(self) -> None:
        for name, value in (("a", self.a), ("c", self.c)):
            if not (value > 0 and math.isfinite(value)):
                raise ConfigError(f"risk.{name}", f"{value!r} is not a positive number")
        if not math.isfinite(self.b):
            raise ConfigError("risk.b", f"{self.b!r} is not a finite number")

    def of_counts(self, m: float, q: float) -> float:
        """P for one pair of counts."""
        x = -self.a * (m - self.b)
        # min() gives its first argument unless the other is smaller, so that a NaN stays one
        return -math.expm1(-self.c * q) / (1.0 + math.exp(min(x, 700.0)))

    @overload
    def probability(self, m: float, q: float) -> float: ...
    @overload
    def probability(self, m: ArrayLike, q: ArrayLike) -> NDArray[np.float64]: ...
    def probability(self, m: ArrayLike, q: ArrayLike) -> float | NDArray[np.float64]:
        """P for m distinct precursors with q occurrences, both >= 0; arrays broadcast. NaN in, NaN out."""
        if isinstance(m, (int, float)) and isinstance(q, (int, float)):
            return self.of_counts(m, q)
        x = -self.a * (np.asarray(m, float) - self.b)
        return np.asarray(-np.expm1(-self.c * np.asarray(q, float)) / (1.0 + np.exp(np.minimum(x, 700.0))))
