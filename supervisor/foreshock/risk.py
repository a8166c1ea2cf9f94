"""The Logistic-Exponential model (Eq. 1): accident probability from the diversity and recurrence of precursors."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TypeAlias, overload

import msgspec
import numpy as np
from numpy.typing import ArrayLike, NDArray

from foreshock.errors import ConfigError
from foreshock.records import Attribution, Precursor, RiskEstimate
from foreshock.taxonomy import Taxonomy

__all__ = ["IndependentRisk", "LogisticExponential"]

Counted: TypeAlias = tuple[str, str, float, float]
"""kind, subject, weight and occurrences: all that a precursor's risk depends on."""


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
        self._last: tuple[list[Counted], RiskEstimate] = ([], self._none)

    def modes_of(self, kind: str) -> Sequence[str]:
        """Accident modes that a kind counts for."""
        return self._modes[kind]

    def estimate(self, precursors: Sequence[Precursor]) -> RiskEstimate:
        """The risk of these precursors; each (kind, subject) is one of them."""
        counted = [(p.kind, p.subject, p.weight, p.occurrences) for p in precursors]
        # counts stay the same from tick to tick but for an onset, a recurrence or an expiry
        before, last = self._last
        if counted != before:
            last = self._estimate(counted) if counted else self._none
            self._last = counted, last
        # copies: whoever writes into an estimate must not move that of the next tick
        return RiskEstimate(
            last.probability,
            last.lower,
            last.upper,
            last.m,
            last.q,
            last.by_mode.copy(),
            last.by_class.copy(),
            last.counts.copy(),
            last.attribution,
        )

    def _estimate(self, counted: Sequence[Counted]) -> RiskEstimate:
        p_of = self._model.of_counts
        m = math.fsum([weight for _, _, weight, _ in counted])
        q = math.fsum([occurrences for _, _, _, occurrences in counted])
        probability = p_of(m, q)
        by_mode, counts = self._grouped(counted, self._modes, self._none.by_mode)
        by_class, _ = self._grouped(counted, self._class, self._none.by_class)
        shares = tuple(
            [
                Attribution(kind, subject, probability - p_of(m - weight, q - occurrences))
                for kind, subject, weight, occurrences in counted
            ]
        )
        all_counts = {**self._none.counts, **counts}
        return RiskEstimate(probability, probability, probability, m, q, by_mode, by_class, all_counts, shares)

    def _grouped(
        self, counted: Iterable[Counted], groups: Mapping[str, Sequence[str]], zero: Mapping[str, float]
    ) -> tuple[dict[str, float], dict[str, tuple[float, float]]]:
        counts: dict[str, tuple[float, float]] = {}
        for kind, _, weight, occurrences in counted:
            for group in groups[kind]:
                m, q = counts.get(group, (0.0, 0.0))
                counts[group] = (m + weight, q + occurrences)
        return {**zero, **{group: self._model.of_counts(m, q) for group, (m, q) in counts.items()}}, counts
