"""Draws how many precursors each synthetic event has, of which classes and kinds, with exact marginals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from foreshock.taxonomy import Taxonomy

__all__ = ["apportion", "classes", "kinds", "sizes"]

TIED, STEP, OTHER = 12.0, 4.0, 1.0
"""Weight of a class in a mode: tied by Table 2; per kind of the class in the mode's cascade (Table 3); any other."""

SWEEPS = 40
"""Proposed swaps per precursor; the draw forgets its start after a few."""

CASCADE, REST = 16.0, 1.0
"""Weight of a kind in its class: in the mode's cascade; any other."""


def apportion(weights: Sequence[float], total: int) -> list[int]:
    """Integers with this total, in proportion to the weights by largest remainders."""
    w = np.asarray(weights, float)
    exact = total * w / w.sum()
    whole = np.floor(exact + 1e-9).astype(int)
    for k in np.argsort(-(exact - whole), kind="stable")[: total - int(whole.sum())]:
        whole[k] += 1
    return [int(n) for n in whole]


def sizes(n: int, total: int, several: int, rng: np.random.Generator) -> NDArray[np.int_]:
    """Number of precursors of each of n events: several events have two or three, the others one, total in all.

    With the paper's 126, 241 and 92 (73 %) it is 34 events with one, 69 with two and 23 with three.
    """
    three = min(several, max(0, total - (n - several) - 2 * several))
    two = several - three
    return rng.permutation(np.repeat([1, 2, 3], [n - several, two, three]))


def classes(modes: Sequence[str], taxonomy: Taxonomy, rng: np.random.Generator) -> list[str]:
    """A class for each precursor, given the mode of its event.

    Class totals are the paper's shares as near as integers allow. Which precursor gets which is a draw from
    P(assignment) proportional to prod w[mode, class], given these totals (Metropolis, proposals swap two classes).
    """
    ids = [c.id for c in taxonomy.classes]
    row = {code: k for k, code in enumerate(taxonomy.codes)}
    w = np.full((len(row), len(ids)), OTHER)
    for k, c in enumerate(taxonomy.classes):
        for code in c.modes:
            w[row[code], k] += TIED
    for mode in taxonomy.modes:
        for kind in mode.cascade:
            w[row[mode.code], ids.index(taxonomy.class_of(kind))] += STEP
    n = len(modes)
    of_slot = np.array([row[m] for m in modes], int)
    counts = apportion([c.share for c in taxonomy.classes], n)
    held = rng.permutation(np.repeat(np.arange(len(ids)), counts))
    pairs = rng.integers(0, n, (SWEEPS * n, 2)) if n else np.zeros((0, 2), int)
    for (i, j), u in zip(pairs, rng.random(len(pairs)), strict=True):
        a, b, r, s = held[i], held[j], of_slot[i], of_slot[j]
        if u * w[r, a] * w[s, b] < w[r, b] * w[s, a]:
            held[i], held[j] = b, a
    return [ids[k] for k in held]


def kinds(mode: str, of_class: Sequence[str], taxonomy: Taxonomy, rng: np.random.Generator) -> list[str]:
    """A kind of each class for one event of a mode, none twice while the class has others."""
    cascade = taxonomy.mode(mode).cascade if mode in taxonomy.codes else ()
    chosen: list[str] = []
    for name in of_class:
        weight: Mapping[str, float] = {
            k.id: CASCADE if k.id in cascade else REST for k in taxonomy.kinds if k.class_ == name
        }
        left = {k: w for k, w in weight.items() if k not in chosen} or weight
        p = np.array(list(left.values()))
        chosen.append(str(rng.choice(list(left), p=p / p.sum())))
    return chosen
