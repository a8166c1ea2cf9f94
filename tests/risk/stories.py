"""Strategies: correlation matrices of every sort, precursors, and parameters of the correlated model.

Each precursor and each matrix is drawn as few numbers that are then decoded: thousands of cases in little time.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import combinations

import numpy as np
from brute_force import KINDS, pair, parameters_of
from hypothesis import strategies as st

from foreshock.records import Precursor
from foreshock.risk import Link, Pair, RiskParameters
from foreshock.taxonomy import builtin_taxonomy

TAXONOMY = builtin_taxonomy()
MS = 1_000_000
NEAR = 1.0 - 1e-9
ENTRIES = (0.0, 0.5, 1.0, 0.9, NEAR, 1.0 - 1e-12, 0.1, 0.3, 0.6, 0.7071067811865476, 0.72, 0.99)
PLACES = [(k, s) for s in ("", "left") for k in KINDS]


def symmetric(n: int, entries: Sequence[float]) -> np.ndarray:
    r = np.eye(n)
    for (i, j), x in zip(combinations(range(n), 2), entries, strict=True):
        r[i, j] = r[j, i] = x
    return r


@st.composite
def any_matrices(draw: st.DrawFn, most: int = 6) -> np.ndarray:
    """Any symmetric R with entries 0..1: most of three kinds and more are not positive semidefinite."""
    n = draw(st.integers(1, most))
    count = n * (n - 1) // 2
    return symmetric(n, draw(st.lists(st.sampled_from(ENTRIES), min_size=count, max_size=count)))


def cosines(rows: Sequence[Sequence[int]], shrunk: float) -> np.ndarray:
    """R of vectors >= 0, all correlations multiplied by shrunk: positive semidefinite, duplicates where they agree."""
    entries = []
    for x, y in combinations(rows, 2):
        dot = sum(a * b for a, b in zip(x, y, strict=True))
        square = sum(a * a for a in x) * sum(b * b for b in y)
        # in integers first: vectors of one direction are exact duplicates
        entries.append(shrunk * (1.0 if dot * dot == square else dot / math.sqrt(square)))
    return symmetric(len(rows), entries)


@st.composite
def gram_matrices(draw: st.DrawFn, most: int = 6) -> np.ndarray:
    """Correlation matrices, singular where the vectors have few dimensions."""
    d = draw(st.integers(1, 4))
    codes = draw(st.lists(st.integers(1, 4**d - 1), min_size=1, max_size=most))
    rows = [[code // 4**k % 4 for k in range(d)] for code in codes]
    return cosines(rows, draw(st.sampled_from([1.0, 1.0, NEAR, 0.9, 0.3])))


MATRICES = st.one_of(any_matrices(), gram_matrices())


def named(r: np.ndarray, kinds: Sequence[str]) -> dict[tuple[str, str], float]:
    return {pair(kinds[i], kinds[j]): float(r[i, j]) for i, j in combinations(range(len(kinds)), 2)}


def letters(n: int) -> list[str]:
    return list("abcdefgh")[:n]


def decoded(place: int, code: int, onsets: int, full: bool) -> Precursor:
    """Onsets are the bits of a number: at 0, 0.1, .. 0.9 s, at most three."""
    kind, subject = PLACES[place]
    severity = 1.0 if full else (code % 7) / 6
    weight = 1.0 if full else (1.0, 1.0, 0.5, 0.01)[code // 7 % 4]
    times = tuple(k * 100 * MS for k in range(10) if onsets >> k & 1)[:3]
    counted = (1 + code // 28 % 4) * weight
    # a record without a list has its one onset in onset_ns
    listed = times if len(times) > 1 or code // 112 % 2 else ()
    return Precursor(kind, subject, "ongoing", severity, counted, weight, times[0], "d", onsets_ns=listed)


def precursors(most: int = 5, least: int = 0, full: bool = False) -> st.SearchStrategy[list[Precursor]]:
    """Of KINDS, some with two subjects, with up to three onsets that may coincide."""
    one = st.tuples(st.integers(0, len(PLACES) - 1), st.integers(0, 223), st.integers(1, 1023))
    drawn = st.lists(one, min_size=least, max_size=most, unique_by=lambda x: x[0])
    return drawn.map(lambda found: [decoded(*x, full) for x in found])


def some_parameters(rng: np.random.Generator) -> RiskParameters:
    """R of KINDS that is a correlation matrix, J of some ordered pairs, and an interval around every number."""
    d = int(rng.integers(1, 5))
    rows = [[int(x) for x in rng.integers(0, 4, d)] for _ in KINDS]
    rows = [row if any(row) else [1] * d for row in rows]
    width = float(rng.choice([0.0, 0.1, 1.0]))
    pairs = [
        Pair(kinds=(a, b), r=x, low=max(0.0, x - width), high=min(1.0, x + width))
        for (a, b), x in named(cosines(rows, float(rng.choice([1.0, NEAR, 0.9, 0.5, 0.0]))), KINDS).items()
        if x > 0.0 or width > 0.0
    ]
    share = rng.choice([0.0, 0.15, 0.3, 1.0])
    links = [
        Link(
            first=a, then=b, lift=j, low=j * float(rng.choice([0.0, 0.5, 1.0])), high=j * float(rng.choice([1.0, 2.0]))
        )
        for a in KINDS
        for b in KINDS
        if a != b and rng.random() < share
        for j in [float(rng.choice([0.25, 1.0, 1.5]))]
    ]
    fields = {
        "a": (1.6, 0.5, 4.0),
        "b": (2.0, 1.0, 3.5),
        "c": (1.2, 0.1, 3.0),
        "kappa": (1.0, 0.3, 0.0),
        "presence": (1.0, 0.5, 0.0),
    }
    scalars = {name: float(rng.choice(values)) for name, values in fields.items()}
    return parameters_of(pairs, links, **scalars).check(TAXONOMY, "a test")


def parameters() -> st.SearchStrategy[RiskParameters]:
    rng = np.random.default_rng(20261125)
    return st.sampled_from([some_parameters(rng) for _ in range(400)])
