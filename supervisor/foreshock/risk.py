"""The Logistic-Exponential model (Eq. 1): accident probability from the diversity and recurrence of precursors."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TypeVar, overload

import msgspec
import numpy as np
from numpy.typing import ArrayLike, NDArray

from foreshock.errors import ConfigError
from foreshock.records import Attribution, Precursor, RiskEstimate
from foreshock.taxonomy import Taxonomy

__all__ = ["IndependentRisk", "LogisticExponential"]

T = TypeVar("T")


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

    @overload
    def probability(self, m: float, q: float) -> float: ...
    @overload
    def probability(self, m: ArrayLike, q: ArrayLike) -> NDArray[np.float64]: ...
    def probability(self, m: ArrayLike, q: ArrayLike) -> float | NDArray[np.float64]:
        """P for m distinct precursors with q occurrences, both >= 0; arrays broadcast. NaN in, NaN out."""
        if isinstance(m, (int, float)) and isinstance(q, (int, float)):
            x = -self.a * (m - self.b)
            # min() gives its first argument unless the other is smaller, so that a NaN stays one
            return -math.expm1(-self.c * q) / (1.0 + math.exp(min(x, 700.0)))
        x = -self.a * (np.asarray(m, float) - self.b)
        return np.asarray(-np.expm1(-self.c * np.asarray(q, float)) / (1.0 + np.exp(np.minimum(x, 700.0))))


class IndependentRisk:
    """Eq. 1 on plain counts, as in the paper: overall, per accident mode and per precursor class.

    A precursor counts for every mode that Tables 2 and 3 tie its kind to.
    """

    def __init__(self, model: LogisticExponential, taxonomy: Taxonomy) -> None:
        self._model = model
        self._modes = {k.id: taxonomy.modes_of(k.id) for k in taxonomy.kinds}
        self._class = {k.id: (k.class_,) for k in taxonomy.kinds}
        self._none = RiskEstimate(
            0.0,
            0.0,
            0.0,
            0.0,
            0.0,
            dict.fromkeys(taxonomy.codes, 0.0),
            {c.id: 0.0 for c in taxonomy.classes},
            dict.fromkeys(taxonomy.codes, (0.0, 0.0)),
        )

    def modes_of(self, kind: str) -> Sequence[str]:
        """Accident modes that a kind counts for."""
        return self._modes[kind]

    def estimate(self, precursors: Sequence[Precursor]) -> RiskEstimate:
        """The risk of these precursors; each (kind, subject) is one of them."""
        if not precursors:
            none = self._none
            # copies: whoever writes into an estimate must not move the baseline of the next
            return RiskEstimate(0.0, 0.0, 0.0, 0.0, 0.0, dict(none.by_mode), dict(none.by_class), dict(none.counts))
        p_of = self._model.probability
        m = math.fsum(p.weight for p in precursors)
        q = math.fsum(p.occurrences for p in precursors)
        probability = p_of(m, q)
        by_mode, counts = self._grouped(precursors, self._modes, self._none.by_mode)
        by_class, _ = self._grouped(precursors, self._class, self._none.by_class)
        shares = tuple(
            Attribution(p.kind, p.subject, probability - p_of(m - p.weight, q - p.occurrences)) for p in precursors
        )
        all_counts = {**self._none.counts, **counts}
        return RiskEstimate(probability, probability, probability, m, q, by_mode, by_class, all_counts, shares)

    def _grouped(
        self, precursors: Iterable[Precursor], groups: Mapping[str, Sequence[str]], zero: Mapping[str, float]
    ) -> tuple[dict[str, float], dict[str, tuple[float, float]]]:
        counts: dict[str, tuple[float, float]] = {}
        for p in precursors:
            for group in groups[p.kind]:
                m, q = counts.get(group, (0.0, 0.0))
                counts[group] = (m + p.weight, q + p.occurrences)
        risks = dict(zero)
        cache: dict[tuple[float, float], float] = {}
        for group, mq in counts.items():
            if mq not in cache:
                cache[mq] = self._model.probability(*mq)
            risks[group] = cache[mq]
        return risks, counts
