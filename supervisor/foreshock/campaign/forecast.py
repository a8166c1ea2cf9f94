"""How good P is as a forecast, judged in shadow: Brier score, reliability, ROC and precision-recall.

The forecast of a run is the highest P of the mode before the accident, or before the end; what is forecast is the
scenario's accident. Where the supervisor acts, what happens is no test of its forecast.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from statistics import NormalDist
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from foreshock.errors import MissingExtraError
from foreshock.session.rates import Rate, wilson

__all__ = [
    "BINS",
    "AucDifference",
    "Bin",
    "Brier",
    "Discrimination",
    "auc_difference",
    "bin_of",
    "brier",
    "discrimination",
    "precision_recall",
    "reliability",
    "roc",
]

Z = NormalDist().inv_cdf(0.975)
BINS = 10
Floats = NDArray[np.float64]


class Brier(msgspec.Struct, frozen=True):
    """Mean squared error of P against what happened, with its 95% interval (normal approximation).

    base is the score of always saying the observed rate.
    """

    score: float
    low: float
    high: float
    base: float
    n: int


class Bin(msgspec.Struct, frozen=True):
    """Runs whose P lies in [low, high): their mean P, and how many of them had the accident."""

    low: float
    high: float
    mean: float
    rate: Rate


class AucDifference(msgspec.Struct, frozen=True):
    """AUC minus that of another forecast of the same runs, with its 95% interval and test (DeLong)."""

    other: str
    difference: float
    low: float
    high: float
    p: float


class Discrimination(msgspec.Struct, frozen=True):
    """How well P tells runs with the accident from those without.

    Attributes:
        auc: area under the ROC curve: the chance that P is higher in a run with the accident than in one without.
        low: of its 95% interval.
        high: of it.
        precision: average precision: area under the precision-recall curve, by steps.
        accidents: runs with the accident.
        others: runs without.
        difference: to the campaign's first shadow arm, on the same runs; None for that arm itself.
    """

    auc: float
    low: float
    high: float
    precision: float
    accidents: int
    others: int
    difference: AucDifference | None = None


def brier(p: Sequence[float], happened: Sequence[bool]) -> Brier | None:
    """The score; None of no runs."""
    n = len(p)
    if not n:
        return None
    errors = [(x - y) ** 2 for x, y in zip(p, happened, strict=True)]
    score, rate = sum(errors) / n, sum(happened) / n
    half = Z * math.sqrt(sum((e - score) ** 2 for e in errors) / (n - 1) / n) if n > 1 else 1.0
    return Brier(score, max(score - half, 0.0), min(score + half, 1.0), rate * (1.0 - rate), n)


def reliability(p: Sequence[float], happened: Sequence[bool]) -> tuple[Bin, ...]:
    """Ten bins of P of equal width, those without runs left out; the rates have Wilson intervals."""
    found = []
    for k in range(BINS):
        inside = [(x, y) for x, y in zip(p, happened, strict=True) if bin_of(x) == k]
        if inside:
            n = len(inside)
            mean = sum(x for x, _ in inside) / n
            found.append(Bin(k / BINS, (k + 1) / BINS, mean, wilson(sum(y for _, y in inside), n)))
    return tuple(found)


def bin_of(p: float) -> int:
    """Number of the bin that P lies in, from 0; 1 belongs to the last."""
    return min(int(p * BINS), BINS - 1)


def _metrics() -> Any:
    try:
        from sklearn import metrics
    except ImportError as e:
        raise MissingExtraError("ROC", f"needs {e.name}", "; run: pip install 'foreshock[campaign]'") from e
    return metrics


def roc(p: Sequence[float], happened: Sequence[bool]) -> list[tuple[float, float, float]]:
    """False positive rate, true positive rate and threshold of P, from (0, 0, inf) on (scikit-learn)."""
    curve = _metrics().roc_curve(happened, p, drop_intermediate=False)
    return list(zip(*(c.tolist() for c in curve), strict=True))


def precision_recall(p: Sequence[float], happened: Sequence[bool]) -> list[tuple[float, float, float]]:
    """Recall, precision and threshold of P, from recall 1 down; the last has no threshold: inf (scikit-learn)."""
    precision, recall, thresholds = (c.tolist() for c in _metrics().precision_recall_curve(happened, p))
    return list(zip(recall, precision, [*thresholds, math.inf], strict=True))


def discrimination(p: Sequence[float], happened: Sequence[bool]) -> Discrimination | None:
    """AUC with DeLong's interval, and average precision; None unless there are runs with and without the accident.

    The variance is that of DeLong, DeLong and Clarke-Pearson (Biometrics 44, 1988). Where P separates the runs
    perfectly, or perfectly the wrong way, that variance is 0 and says nothing: of min(m, n) disjoint pairs, which are
    independent, all are then in order, and the end of the interval is Wilson's for so many of so many.
    """
    x, y = _split(p, happened)
    if not len(x) or not len(y):
        return None
    of_x, of_y = _placements(x, y)
    auc = float(of_x.mean())
    half = Z * math.sqrt(_variance(of_x) + _variance(of_y))
    low, high = max(auc - half, 0.0), min(auc + half, 1.0)
    pairs = min(len(x), len(y))
    if auc in (0.0, 1.0) or pairs == 1:
        bound = wilson(round(auc * pairs), pairs)
        low, high = min(low, bound.low), max(high, bound.high)
    return Discrimination(auc, low, high, float(_metrics().average_precision_score(happened, p)), len(x), len(y))


def auc_difference(
    other: str, p: Sequence[float], before: Sequence[float], happened: Sequence[bool]
) -> AucDifference | None:
    """AUC of p minus that of another forecast of the same runs.

    None without two runs of either kind, and where the variance is 0, which says nothing: both tell them apart alike.

    Args:
        other: what the other forecast is called.
        p: of each run.
        before: of the other forecast, of the same runs.
        happened: whether they had the accident.
    """
    (x, y), (u, v) = _split(p, happened), _split(before, happened)
    if len(x) < 2 or len(y) < 2:
        return None
    (of_x, of_y), (of_u, of_v) = _placements(x, y), _placements(u, v)
    difference = float(of_x.mean() - of_u.mean())
    spread = math.sqrt(_variance(of_x - of_u) + _variance(of_y - of_v))
    if not spread:
        return None
    p_value = 2.0 * NormalDist().cdf(-abs(difference) / spread)
    low, high = max(difference - Z * spread, -1.0), min(difference + Z * spread, 1.0)
    return AucDifference(other, difference, low, high, p_value)


def _split(p: Sequence[float], happened: Sequence[bool]) -> tuple[Floats, Floats]:
    values, truth = np.asarray(p, dtype=float), np.asarray(happened, dtype=bool)
    return values[truth], values[~truth]


def _placements(x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Of each x the share of y below it, of each y the share of x above it; ties count half."""
    return _share_below(x, y), 1.0 - _share_below(y, x)


def _share_below(x: Floats, y: Floats) -> Floats:
    """Of each x the share of y below it by rank, since a table of all pairs would not fit for 10^5 runs."""
    ranked = np.sort(y)
    found = (np.searchsorted(ranked, x, "left") + np.searchsorted(ranked, x, "right")) / (2.0 * len(y))
    return np.asarray(found, dtype=np.float64)


def _variance(placements: Floats) -> float:
    """Of their mean."""
    return float(placements.var(ddof=1)) / len(placements) if len(placements) > 1 else 0.0
