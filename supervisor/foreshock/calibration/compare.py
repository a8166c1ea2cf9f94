"""Cross-validation by fold group: Brier score and log loss of the models that one could have used instead."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import msgspec
import numpy as np
from numpy.typing import NDArray

from foreshock.calibration.features import Values
from foreshock.calibration.fit import TINY, fit, predict
from foreshock.calibration.landmarks import Landmark
from foreshock.calibration.moments import Moments
from foreshock.calibration.profile import MODE, WINDOWS_S, Axes, Surface, axes, best
from foreshock.errors import BadInputError

__all__ = ["Bin", "Score", "compare", "reliability"]

Array = NDArray[np.float64]
Chosen = NDArray[np.int64]
"""Numbers of moments."""


class Score(msgspec.Struct, frozen=True):
    """Of one model, out of fold: Brier score, log loss, and the Brier difference to the reference with its interval.

    Attributes:
        model: its name.
        brier: mean (P - y)^2.
        log_loss: mean of -ln of the probability given to what happened.
        difference: Brier score minus that of the independent LE, fitted; below 0 is better.
        low: lower end of its 95% interval, by a bootstrap over groups.
        high: upper end.
    """

    model: str
    brier: float
    log_loss: float
    difference: float
    low: float
    high: float


class Bin(msgspec.Struct, frozen=True):
    """A bin of the reliability diagram: mean P, share of accidents with its 95% Wilson interval, number of moments."""

    predicted: float
    observed: float
    low: float
    high: float
    n: int


REFERENCE = "independent LE, fitted"


def compare(
    moments: Moments,
    lifts: Callable[[frozenset[str]], Values],
    folds: int = 5,
    seed: int = 0,
    windows: Sequence[float] = (),
) -> tuple[list[Score], dict[str, Array], Array]:
    """Scores of every model on the same folds, its out-of-fold predictions, and the labels.

    Inside a fold every model but the paper's is fitted to the other folds alone, its window included, by the smallest
    loss; the correlated LE also has rho and presence fitted there. The grid is coarser than that of the fit to all
    moments and has no finer steps: every other window, and quarters of rho and presence.

    Args:
        moments: labelled; their R is from nominal runs, which hold no label.
        lifts: J from the events of these groups only, so that no fold has seen its own accidents.
        folds: number of folds; every group is in one.
        seed: of the bootstrap.
        windows: in s, to choose from, or one that is given; by default 0.5 to 3 s.

    Raises:
        BadInputError: fewer groups than folds.
    """
    from sklearn.model_selection import GroupKFold

    names, y = moments.groups, moments.y
    if len(names) < folds:
        raise BadInputError("--folds", f"{folds} folds of {len(names)} groups")
    grid = axes(moments, windows, 1) if windows else axes(moments, WINDOWS_S, 2)
    plain: Axes = (grid[0], (0.0,), (1.0,))
    paper = moments.features(grid[0][0] if len(grid[0]) == 1 else MODE[0], 0.0, 1.0, {})
    tables = {w: _indicators(moments.through(w)) for w in grid[0]}
    out = {
        name: np.full(len(y), np.nan)
        for name in ("LE, the paper's a, b, c", REFERENCE, "correlated LE, fitted", "logistic regression", "noisy-OR")
    }
    for train, test in GroupKFold(folds).split(y[:, None], y, moments.group):
        known = frozenset(names[g] for g in set(moments.group[train].tolist()))
        predictions = (
            predict(paper.of(test), 1.6, 2.0, 1.2, 0.0),
            _eq_1(moments, {}, plain, train, test),
            _eq_1(moments, lifts(known), grid, train, test),
            _in_best_window(_logistic, tables, y, train, test),
            _in_best_window(_noisy_or, tables, y, train, test),
        )
        for name, p in zip(out, predictions, strict=True):
            out[name][test] = np.clip(p, TINY, 1.0 - TINY)
    errors = {name: (p - y) ** 2 for name, p in out.items()}
    rng = np.random.default_rng([0x6376, seed])
    members = [np.flatnonzero(moments.group == g) for g in range(len(names))]
    draws = [np.concatenate([members[g] for g in rng.integers(0, len(names), len(names))]) for _ in range(500)]
    scores = []
    for name, p in out.items():
        gap = errors[name] - errors[REFERENCE]
        low, high = np.quantile([gap[d].mean() for d in draws], (0.025, 0.975))
        scores.append(Score(name, float(errors[name].mean()), _loss(p, y), float(gap.mean()), float(low), float(high)))
    return scores, out, y


def _eq_1(moments: Moments, lifts: Values, grid: Axes, train: Chosen, test: Chosen) -> Array:
    """Eq. 1 with all of the grid and a, b, c (and kappa, where anything lifts) fitted to some, on others."""
    key = best(Surface(moments, lifts, train), grid)
    x = moments.features(*key, lifts)
    found = fit(x.of(train))
    return predict(x.of(test), found.a, found.b, found.c, found.kappa)


def _in_best_window(
    model: Callable[[Array, Array, Array], Array], tables: Mapping[float, Array], y: Array, train: Chosen, test: Chosen
) -> Array:
    """What a model says of some moments through the window in which it fits the others best."""
    both = np.concatenate([train, test])
    said = [model(table[train], y[train], table[both]) for table in tables.values()]
    losses = [_loss(p[: len(train)], y[train]) for p in said]
    return said[int(np.argmin(losses))][len(train) :]


def _loss(p: Array, y: Array) -> float:
    clipped = np.clip(p, TINY, 1.0 - TINY)
    return float(-np.log(np.where(y > 0.5, clipped, 1.0 - clipped)).mean())


def reliability(p: Array, y: Array, bins: int = 10) -> list[Bin]:
    """Bins of equal numbers of moments."""
    from scipy.stats import binomtest

    order = np.argsort(p, kind="stable")
    found = []
    for chosen in np.array_split(order, bins):
        if len(chosen):
            k, n = int(y[chosen].sum()), len(chosen)
            interval = binomtest(k, n).proportion_ci(0.95, "wilson")
            found.append(Bin(float(p[chosen].mean()), k / n, float(interval.low), float(interval.high), n))
    return found


def _indicators(moments: Sequence[Landmark]) -> Array:
    """Occurrences of each kind, moment by moment."""
    kinds = {k: i for i, k in enumerate(sorted({s.kind for x in moments for s in x.seen}))}
    table = np.zeros((len(moments), max(len(kinds), 1)))
    for n, x in enumerate(moments):
        for s in x.seen:
            table[n, kinds[s.kind]] += s.occurrences
    return table


def _logistic(x: Array, y: Array, new: Array) -> Array:
    from sklearn.linear_model import LogisticRegression

    model = LogisticRegression(C=1.0, solver="newton-cholesky").fit(np.minimum(x, 3.0), y > 0.5)
    return np.asarray(model.predict_proba(np.minimum(new, 3.0))[:, 1])


def _noisy_or(counts: Array, y: Array, new: Array) -> Array:
    """P = 1 - (1 - leak) prod over present kinds of (1 - p_k), by maximum likelihood in w = -ln(1 - p) >= 0."""
    from scipy.optimize import minimize

    ones = _with_leak(counts)

    def objective(w: Array) -> tuple[float, Array]:
        s = ones @ w
        p = np.clip(-np.expm1(-s), TINY, 1.0 - TINY)
        slope = np.where(y > 0.5, -(1.0 - p) / p, 1.0)
        loss = -np.log(np.where(y > 0.5, p, 1.0 - p)).sum() + 0.01 * float(w @ w)
        return float(loss), ones.T @ slope + 0.02 * w

    start = np.full(ones.shape[1], 0.05)
    bounds = [(1e-9, 10.0)] * len(start)
    found = minimize(objective, start, jac=True, method="SLSQP", bounds=bounds, options={"ftol": 1e-9, "maxiter": 500})
    return np.asarray(-np.expm1(-(_with_leak(new) @ found.x)))


def _with_leak(counts: Array) -> Array:
    return np.column_stack([np.ones(len(counts)), counts > 0.0]).astype(float)
