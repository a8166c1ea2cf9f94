"""Agreement between coders: Cohen's kappa for each field (section 3.1: 0.86 for precursors)."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from statistics import median

import msgspec
import numpy as np
from numpy.typing import NDArray

from foreshock.events.codings import coder_pairs
from foreshock.events.schema import DEVIATIONS, Event
from foreshock.taxonomy import Taxonomy

__all__ = ["Agreement", "Kappa", "agreement", "cohens_kappa"]

RESAMPLES, CHUNK = 2000, 100


class Kappa(msgspec.Struct, frozen=True):
    """Cohen's kappa of one field, (p_o - p_e) / (1 - p_e).

    Attributes:
        field: what was decided.
        kappa: None if both coders said one and the same throughout: then there is nothing to agree on.
        low: lower end of the 95% interval, from a bootstrap over events; decisions on one event are not independent.
        high: upper end.
        decisions: number of decisions by each coder.
        agreed: p_o, the share of decisions that agree.
    """

    field: str
    kappa: float | None
    low: float | None
    high: float | None
    decisions: int
    agreed: float


class Agreement(msgspec.Struct, frozen=True):
    """Two coders on the events that both coded.

    Attributes:
        coders: their names.
        events: number of events that both coded.
        kappas: precursor kinds (presence of each kind that either saw in any event, pooled), precursor classes
            (pooled), outcome, task, deviation (pooled).
        onset_s: median difference of the first onsets of kinds that both saw in an event, in s; None if there is none.
    """

    coders: tuple[str, str]
    events: int
    kappas: tuple[Kappa, ...]
    onset_s: float | None


def agreement(events: Sequence[Event], taxonomy: Taxonomy, seed: int = 0) -> tuple[Agreement, ...]:
    """One entry for each two coders that share events; seed of the bootstrap."""
    return tuple(_compare(*names, shared, taxonomy, seed) for names, shared in coder_pairs(events).items())


def _compare(a: str, b: str, shared: Sequence[tuple[Event, Event]], taxonomy: Taxonomy, seed: int) -> Agreement:
    every = sorted({p.kind for pair in shared for e in pair for p in e.precursors})
    classes = [c.id for c in taxonomy.classes]

    def kinds(e: Event) -> list[bool]:
        held = {p.kind for p in e.precursors}
        return [kind in held for kind in every]

    def groups(e: Event) -> list[bool]:
        held = {taxonomy.class_of(p.kind) for p in e.precursors}
        return [c in held for c in classes]

    fields: list[tuple[str, Callable[[Event], Sequence[Hashable]]]] = [
        ("precursor kinds", kinds),
        ("precursor classes", groups),
        ("outcome", lambda e: [e.outcome]),
        ("task", lambda e: [e.task]),
        ("deviation", lambda e: [d in e.deviation for d in DEVIATIONS]),
    ]
    kappas = tuple(cohens_kappa(name, [(f(x), f(y)) for x, y in shared], seed) for name, f in fields)
    apart = [abs(first[k] - second[k]) for first, second in map(_onsets, shared) for k in first.keys() & second.keys()]
    return Agreement((a, b), len(shared), kappas, median(apart) if apart else None)


def _onsets(pair: tuple[Event, Event]) -> tuple[dict[str, float], dict[str, float]]:
    first, second = ({p.kind: p.onset_s for p in sorted(e.precursors, key=lambda p: -p.onset_s)} for e in pair)
    return first, second


def cohens_kappa(
    field: str, decisions: Sequence[tuple[Sequence[Hashable], Sequence[Hashable]]], seed: int = 0
) -> Kappa:
    """Kappa of two coders.

    Args:
        field: for the result.
        decisions: for each event, what the first and what the second said, decision by decision.
        seed: of the bootstrap.
    """
    said = sorted({str(x) for pair in decisions for side in pair for x in side})
    index = {name: k for k, name in enumerate(said)}
    tables = np.zeros((len(decisions), len(said), len(said)))
    for k, (first, second) in enumerate(decisions):
        for x, y in zip(first, second, strict=True):
            tables[k, index[str(x)], index[str(y)]] += 1
    table = tables.sum(axis=0)
    n = int(table.sum())
    agreed = float(np.trace(table) / n) if n else 0.0
    if len(said) < 2:
        return Kappa(field, None, None, None, n, agreed)
    from statsmodels.stats.inter_rater import cohens_kappa as of_table

    kappa = float(of_table(table, return_results=False))
    resampled = _bootstrap(tables, np.random.default_rng(seed))
    low, high = np.nanpercentile(resampled, [2.5, 97.5])
    return Kappa(field, kappa, float(low), float(high), n, agreed)


def _bootstrap(tables: NDArray[np.float64], rng: np.random.Generator) -> NDArray[np.float64]:
    """Kappa of resampled events; NaN where a resample leaves nothing to agree on."""
    events, size, _ = tables.shape
    flat = tables.reshape(events, size * size)
    kappas = []
    for _ in range(RESAMPLES // CHUNK):
        weights = rng.multinomial(events, np.full(events, 1 / events), CHUNK)
        drawn = (weights @ flat).reshape(CHUNK, size, size)
        n = drawn.sum(axis=(1, 2))
        observed = np.trace(drawn, axis1=1, axis2=2) / n
        expected = (drawn.sum(axis=1) * drawn.sum(axis=2)).sum(axis=1) / n**2
        rest = 1 - expected
        kappas.append(np.divide(observed - expected, rest, out=np.full(CHUNK, np.nan), where=rest > 1e-12))
    return np.concatenate(kappas)
