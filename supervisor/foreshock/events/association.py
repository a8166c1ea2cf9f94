"""Which precursors go with which outcomes: conditional probabilities and tests (section 2.2, Tables 2 and 3)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from math import sqrt

import msgspec
import numpy as np

from foreshock.events.pairs import seen_kinds
from foreshock.events.schema import NO_ACCIDENT, Event
from foreshock.session.rates import Rate, wilson
from foreshock.taxonomy import Taxonomy

__all__ = ["Association", "ChiSquare", "Tie", "class_association", "kind_association"]


class Tie(msgspec.Struct, frozen=True):
    """One outcome and one class or kind, over events.

    Attributes:
        outcome: code of an accident mode, or ``none``.
        name: id of the class or kind.
        given_outcome: P(name is present | outcome), 95% Wilson interval.
        given_name: P(outcome | name is present), likewise. It holds for this table: how many accidents and near
            misses were collected is a choice of who collected them.
        lift: P(name | outcome) / P(name); None if no event has the name or the outcome.
        p_value: Fisher's exact test, two-sided, of name against outcome.
        q_value: the same, adjusted for all ties of the table (Benjamini and Hochberg).
        tied: whether the paper ties them (classes: Table 2; kinds: Table 3).
    """

    outcome: str
    name: str
    given_outcome: Rate
    given_name: Rate
    lift: float | None
    p_value: float
    q_value: float
    tied: bool


class ChiSquare(msgspec.Struct, frozen=True):
    """Pearson's test of independence of outcome and class, over precursors; v is Cramér's V, 0..1.

    Where the least expected count is below 5 the p value is rough. Precursors of one event are not independent.
    """

    statistic: float
    dof: int
    p_value: float
    v: float
    least_expected: float


class Association(msgspec.Struct, frozen=True):
    """All ties, outcome by outcome, and the test as a whole (None where a table has one row or column)."""

    outcomes: tuple[str, ...]
    names: tuple[str, ...]
    ties: tuple[Tie, ...]
    chi_square: ChiSquare | None


def class_association(events: Sequence[Event], taxonomy: Taxonomy) -> Association:
    """Outcomes against the taxonomy's classes; ``none`` is an outcome if any event has it."""
    names = tuple(c.id for c in taxonomy.classes)
    tied = {(code, c.id) for c in taxonomy.classes for code in c.modes}
    return _associate(events, names, tied, taxonomy, taxonomy.class_of)


def kind_association(events: Sequence[Event], taxonomy: Taxonomy) -> Association:
    """Outcomes against the kinds that occur."""
    names = seen_kinds(events, taxonomy)
    tied = {(m.code, taxonomy.kind(kind).id) for m in taxonomy.modes for kind in m.cascade}
    return _associate(events, names, tied, taxonomy, str)


def _associate(
    events: Sequence[Event],
    names: tuple[str, ...],
    tied: set[tuple[str, str]],
    taxonomy: Taxonomy,
    name_of: Callable[[str], str],
) -> Association:
    from scipy.stats import false_discovery_control, fisher_exact

    of_outcome = Counter(e.outcome for e in events)
    outcomes = taxonomy.codes + ((NO_ACCIDENT,) if NO_ACCIDENT in of_outcome else ())
    present = [(e.outcome, {name_of(p.kind) for p in e.precursors}) for e in events]
    of_name = Counter(name for _, held in present for name in held)
    both = Counter((outcome, name) for outcome, held in present for name in held)
    cells = [(o, name) for o in outcomes for name in names]
    p_values = []
    for o, name in cells:
        k = both[o, name]
        rest = len(events) - of_outcome[o] - of_name[name] + k
        p_values.append(float(fisher_exact([[k, of_outcome[o] - k], [of_name[name] - k, rest]])[1]))
    q_values = false_discovery_control(p_values) if p_values else []
    ties = tuple(
        Tie(
            o,
            name,
            wilson(both[o, name], of_outcome[o]),
            wilson(both[o, name], of_name[name]),
            _lift(both[o, name], of_outcome[o], of_name[name], len(events)),
            p,
            float(q),
            (o, name) in tied,
        )
        for (o, name), p, q in zip(cells, p_values, q_values, strict=True)
    )
    instances = Counter((e.outcome, name_of(p.kind)) for e in events for p in e.precursors)
    return Association(outcomes, names, ties, _chi_square(instances, outcomes, names))


def _lift(both: int, a: int, b: int, n: int) -> float | None:
    return both * n / (a * b) if a and b else None


def _chi_square(instances: Counter[tuple[str, str]], outcomes: Sequence[str], names: Sequence[str]) -> ChiSquare | None:
    from scipy.stats import chi2_contingency

    counts = np.array([[instances[o, name] for name in names] for o in outcomes]).reshape(len(outcomes), len(names))
    counts = counts[counts.sum(axis=1) > 0][:, counts.sum(axis=0) > 0]
    if min(counts.shape) < 2:
        return None
    test = chi2_contingency(counts, correction=False)
    v = sqrt(float(test.statistic) / (counts.sum() * (min(counts.shape) - 1)))
    return ChiSquare(float(test.statistic), int(test.dof), float(test.pvalue), v, float(test.expected_freq.min()))
