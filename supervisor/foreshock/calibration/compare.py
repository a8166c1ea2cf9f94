"""Cross-validation by fold group: Brier score and log loss of the models that one could have used instead."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import msgspec
import numpy as np
from numpy.typing import NDArray

from foreshock.calibration.features import features
from foreshock.calibration.fit import TINY, fit, predict
from foreshock.calibration.landmarks import Landmark
from foreshock.errors import BadInputError

__all__ = ["Bin", "Score", "compare", "reliability"]

Array = NDArray[np.float64]


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
    moments: Sequence[Landmark],
    correlation: Mapping[tuple[str, str], float],
    lifts: Callable[[frozenset[str]], Mapping[tuple[str, str], float]],
    folds: int = 5,
    seed: int = 0,
) -> tuple[list[Score], dict[str, Array], Array]:
    """Scores of every model on the same folds, its out-of-fold predictions, and the labels.

    Args:
        moments: labelled.
        correlation: r of pairs of kinds, from nominal runs, which hold no label.
        lifts: J from the events of these groups only, so that no fold has seen its own accidents.
        folds: number of folds; every group is in one.
        seed: of the bootstrap.

    Raises:
        BadInputError: fewer groups than folds.
    """
    from sklearn.model_selection import GroupKFold

    plain = features(moments, {}, {})
    names = sorted({x.group for x in moments})
    if len(names) < folds:
        raise BadInputError("--folds", f"{folds} folds of {len(names)} groups")
    table = _indicators(moments)
    y = plain.y
    out = {
        name: np.full(len(y), np.nan)
        for name in ("LE, the paper's a, b, c", REFERENCE, "correlated LE, fitted", "logistic regression", "noisy-OR")
    }
    for train, test in GroupKFold(folds).split(table, y, plain.group):
        known = frozenset(names[g] for g in set(plain.group[train].tolist()))
        rich = features(moments, correlation, lifts(known))
        independent, correlated = fit(plain.of(train), lift=False), fit(rich.of(train))
        predictions = (
            predict(plain.of(test), 1.6, 2.0, 1.2, 0.0),
            predict(plain.of(test), independent.a, independent.b, independent.c, 0.0),
            predict(rich.of(test), correlated.a, correlated.b, correlated.c, correlated.kappa),
            _logistic(table[train], y[train], table[test]),
            _noisy_or(table[train] > 0.0, y[train], table[test] > 0.0),
        )
        for name, p in zip(out, predictions, strict=True):
            out[name][test] = np.clip(p, TINY, 1.0 - TINY)
    errors = {name: (p - y) ** 2 for name, p in out.items()}
    rng = np.random.default_rng([0x6376, seed])
    members = [np.flatnonzero(plain.group == g) for g in range(len(names))]
    draws = [np.concatenate([members[g] for g in rng.integers(0, len(names), len(names))]) for _ in range(500)]
    scores = []
    for name, p in out.items():
        gap = errors[name] - errors[REFERENCE]
        low, high = np.quantile([gap[d].mean() for d in draws], (0.025, 0.975))
        loss = -np.log(np.where(y > 0.5, p, 1.0 - p)).mean()
        scores.append(Score(name, float(errors[name].mean()), float(loss), float(gap.mean()), float(low), float(high)))
    return scores, out, y


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

    model = LogisticRegression(C=1.0, max_iter=2000).fit(np.minimum(x, 3.0), y > 0.5)
    return np.asarray(model.predict_proba(np.minimum(new, 3.0))[:, 1])


def _noisy_or(x: NDArray[np.bool_], y: Array, new: NDArray[np.bool_]) -> Array:
    """P = 1 - (1 - leak) prod over present kinds of (1 - p_k), by maximum likelihood in w = -ln(1 - p) >= 0."""
    from scipy.optimize import minimize

    ones = np.column_stack([np.ones(len(x)), x]).astype(float)

    def objective(w: Array) -> tuple[float, Array]:
        s = ones @ w
        p = np.clip(-np.expm1(-s), TINY, 1.0 - TINY)
        slope = np.where(y > 0.5, -(1.0 - p) / p, 1.0)
        loss = -np.log(np.where(y > 0.5, p, 1.0 - p)).sum() + 0.01 * float(w @ w)
        return float(loss), ones.T @ slope + 0.02 * w

    start = np.full(ones.shape[1], 0.05)
    best = minimize(objective, start, jac=True, method="L-BFGS-B", bounds=[(1e-9, 10.0)] * len(start))
    return np.asarray(-np.expm1(-(np.column_stack([np.ones(len(new)), new]).astype(float) @ best.x)))
