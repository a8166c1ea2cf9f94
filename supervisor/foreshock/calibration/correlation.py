"""R from the detectors' statistics in nominal runs, where precursors themselves are absent.

Rank-normalised statistics, Ledoit-Wolf shrinkage to the identity, clipped at 0; intervals by a bootstrap over runs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from foreshock.errors import BadInputError
from foreshock.risk import Pair

__all__ = ["correlation", "scaled"]

Array = NDArray[np.float64]
NEGLIGIBLE = 0.05
"""A pair whose interval ends below says nothing."""


def correlation(runs: Sequence[Mapping[str, Sequence[float]]], seed: int = 0, draws: int = 200) -> tuple[Pair, ...]:
    """Correlated pairs with their 95% intervals.

    Args:
        runs: of each nominal run, the statistic of each kind over time, in rows of equal length; NaN where unobserved.
        seed: of the bootstrap.
        draws: of the bootstrap.

    Raises:
        BadInputError: fewer than two runs, or kinds that differ between them.
    """
    if len(runs) < 2:
        raise BadInputError("nominal runs", f"{len(runs)} given; an interval needs two or more")
    kinds = sorted(runs[0])
    for k, run in enumerate(runs):
        if sorted(run) != kinds:
            raise BadInputError(f"nominal run {k}", f"kinds {sorted(run)} differ from {kinds} of the first")
    tables = [np.column_stack([np.asarray(run[kind], float) for kind in kinds]) for run in runs]
    tables = [t[np.isfinite(t).all(axis=1)] for t in tables]
    moving = [k for k in range(len(kinds)) if all(np.ptp(t[:, k]) > 0.0 for t in tables if len(t))]
    if len(moving) < 2:
        return ()
    tables = [t[:, moving] for t in tables]
    point = _shrunk(np.vstack(tables))
    rng = np.random.default_rng([0x72, seed])
    some = [_shrunk(np.vstack([tables[i] for i in rng.integers(0, len(tables), len(tables))])) for _ in range(draws)]
    low, high = np.quantile(np.stack(some), (0.025, 0.975), axis=0)
    pairs = []
    for i, j in zip(*np.triu_indices(len(moving), 1), strict=True):
        if high[i, j] > NEGLIGIBLE:
            r = float(point[i, j])
            names = (kinds[moving[i]], kinds[moving[j]])
            pairs.append(Pair(names, r, min(r, float(low[i, j])), max(r, float(high[i, j]))))
    return tuple(pairs)


def scaled(pairs: Sequence[Pair], rho: float, low: float, high: float) -> tuple[Pair, ...]:
    """R = rho R0 off its diagonal; the interval of r spans that of rho times that of r0.

    I + rho (R0 - I) has the eigenvalues 1 + rho (w - 1): positive semidefinite like R0 for rho in 0..1.

    Args:
        pairs: R0.
        rho: its scale, in 0..1.
        low: lower end of the interval of rho.
        high: upper end.
    """
    return tuple(Pair(p.kinds, rho * p.r, low * p.low, high * p.high) for p in pairs)


def _shrunk(table: Array) -> Array:
    """The correlation matrix: positive semidefinite, entries 0..1."""
    from scipy.stats import norm, rankdata
    from sklearn.covariance import ledoit_wolf

    scores = norm.ppf(rankdata(table, axis=0) / (len(table) + 1))
    covariance, _ = ledoit_wolf(scores)
    scale = np.sqrt(np.diag(covariance))
    r = np.clip(covariance / np.outer(scale, scale), 0.0, 1.0)
    np.fill_diagonal(r, 1.0)
    least = float(np.linalg.eigvalsh(r)[0])
    # clipping at 0 can cost it its definiteness: I + t (R - I) has the eigenvalues 1 + t (w - 1)
    return r if least >= 0.0 else np.asarray(np.eye(len(r)) + (r - np.eye(len(r))) / (1.0 - least))
