"""Strategies: correlation matrices of every sort, precursors, and parameters of the correlated model."""

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
R = st.one_of(st.sampled_from([0.0, 0.5, 0.9, NEAR, 1.0 - 1e-12, 1.0]), st.floats(0.0, 1.0))


@st.composite
def any_matrices(draw: st.DrawFn, most: int = 6) -> np.ndarray:
    """Any symmetric R with entries 0..1: most of three kinds and more are not positive semidefinite."""
    n = draw(st.integers(1, most))
    upper = draw(st.lists(R, min_size=n * (n - 1) // 2, max_size=n * (n - 1) // 2))
    r = np.eye(n)
    for (i, j), x in zip(combinations(range(n), 2), upper, strict=True):
        r[i, j] = r[j, i] = x
    return r


@st.composite
def gram_matrices(draw: st.DrawFn, most: int = 6, least: int = 1) -> np.ndarray:
    """Cosines of vectors >= 0: a correlation matrix, singular where dimensions are few, with duplicates."""
    n, d = draw(st.integers(least, most)), draw(st.integers(1, 4))
    rows = draw(
        st.lists(st.lists(st.integers(0, 3), min_size=d, max_size=d).filter(any), min_size=n, max_size=n), label="rows"
    )
    shrunk = draw(st.sampled_from([1.0, 1.0, NEAR, 0.9, 0.3]), label="shrunk")
    r = np.eye(n)
    for i, j in combinations(range(n), 2):
        x, y = rows[i], rows[j]
        dot = sum(a * b for a, b in zip(x, y, strict=True))
        square = sum(a * a for a in x) * sum(b * b for b in y)
        # in integers first: vectors of one direction are exact duplicates
        cosine = 1.0 if dot * dot == square else dot / math.sqrt(square)
        r[i, j] = r[j, i] = shrunk * cosine
    return r


MATRICES = st.one_of(any_matrices(), gram_matrices())


def named(r: np.ndarray, kinds: Sequence[str]) -> dict[tuple[str, str], float]:
    return {pair(kinds[i], kinds[j]): float(r[i, j]) for i, j in combinations(range(len(kinds)), 2)}


def letters(n: int) -> list[str]:
    return list("abcdefgh")[:n]


@st.composite
def precursors(draw: st.DrawFn, most: int = 5, least: int = 0, full: bool = False) -> list[Precursor]:
    """Of KINDS, some with two subjects, with up to three onsets that may coincide."""
    places = st.tuples(st.sampled_from(KINDS), st.sampled_from(["", "", "left"]))
    where = draw(st.lists(places, min_size=least, max_size=most, unique=True), label="where")
    unit = st.one_of(st.sampled_from([0.0, 0.5, 1.0]), st.floats(0.0, 1.0))
    found = []
    for kind, subject in where:
        onsets = sorted(draw(st.sets(st.integers(0, 9), min_size=1, max_size=3)))
        times = tuple(t * 100 * MS for t in onsets)
        severity = 1.0 if full else draw(unit)
        weight = 1.0 if full else draw(st.sampled_from([1.0, 1.0, 0.5, 0.01]))
        counted = draw(st.integers(1, 4)) * weight
        listed = times if len(times) > 1 or draw(st.booleans()) else ()
        found.append(Precursor(kind, subject, "ongoing", severity, counted, weight, times[0], "d", onsets_ns=listed))
    return found


@st.composite
def parameters(draw: st.DrawFn, **fixed: float) -> RiskParameters:
    """R of KINDS that is a correlation matrix, J of some ordered pairs, and an interval around every number."""
    r = draw(gram_matrices(len(KINDS), least=len(KINDS)))
    width = draw(st.sampled_from([0.0, 0.1, 1.0]))
    pairs = [
        Pair((a, b), x, max(0.0, x - width), min(1.0, x + width))
        for (a, b), x in named(r, KINDS).items()
        if x > 0.0 or width > 0.0
    ]
    ordered = st.lists(st.tuples(st.sampled_from(KINDS), st.sampled_from(KINDS)), max_size=8, unique=True)
    links = [
        Link(a, b, j, draw(st.sampled_from([0.0, 0.5 * j, j])), draw(st.sampled_from([j, 2.0 * j])))
        for a, b in draw(ordered, label="links")
        if a != b
        for j in [draw(st.sampled_from([0.25, 1.0, 1.5]))]
    ]
    scalars = {
        "a": draw(st.sampled_from([1.6, 0.5, 4.0])),
        "b": draw(st.sampled_from([2.0, 1.0, 3.5])),
        "c": draw(st.sampled_from([1.2, 0.1, 3.0])),
        "kappa": draw(st.sampled_from([1.0, 0.3, 0.0])),
        "presence": draw(st.sampled_from([1.0, 0.5, 0.0])),
    }
    return parameters_of(pairs, links, **{**scalars, **fixed}).check(TAXONOMY, "a test")
