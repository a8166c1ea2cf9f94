"""Maximum likelihood with a weak prior: a, b, c and kappa from labelled moments, through one window.

    minimise  -sum_i [y_i ln P_i + (1 - y_i) ln(1 - P_i)] + sum_k ((u_k - u0_k) / s_k)^2 / 2

over u = (ln a, b, ln c, ln kappa), with the paper's values as u0 (kappa: 1). The prior decides where the data do not:
c shows only where few occurrences are seen. Intervals are 95%, by the sandwich H^-1 (sum over groups g g') H^-1, since
the moments of one run are not independent; they hold for the given window, R and presence.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray

from foreshock.calibration.features import Features
from foreshock.errors import BadInputError

__all__ = ["TINY", "Fitted", "Minimum", "fit", "minimum", "predict"]

Array = NDArray[np.float64]
TINY = 1e-6
"""A predicted probability is kept this far from 0 and 1: an accident without any precursor is bad, not impossible."""
START = {"a": np.log(1.6), "b": 2.0, "c": np.log(1.2), "kappa": 0.0}
SPREAD = {"a": 1.0, "b": 2.0, "c": 1.0, "kappa": 1.5}
LIMITS = {"a": (-3.0, 3.0), "b": (-3.0, 12.0), "c": (-4.0, 4.0), "kappa": (-7.0, 3.0)}
KAPPAS = (-2.0, 0.0, 1.0)
"""Values of ln kappa to start from: b and kappa can trade, so that there are two minima."""


class Fitted(msgspec.Struct, frozen=True):
    """Parameters with their 95% intervals, and the mean log loss on the moments they were fitted to."""

    a: float
    b: float
    c: float
    kappa: float
    intervals: dict[str, tuple[float, float]]
    log_loss: float
    n: int
    events: int


class Minimum(NamedTuple):
    """Where the penalised loss is least: u, its value there, and the losses of the moments without the penalty."""

    u: Array
    loss: float
    losses: Array


class _Point(NamedTuple):
    a: float
    b: float
    c: float
    kappa: float


def predict(x: Features, a: float, b: float, c: float, kappa: float) -> Array:
    """P of Eq. 1 on the effective numbers."""
    logit = -a * (x.m + kappa * x.lift - b)
    p = -np.expm1(-c * x.q) / (1.0 + np.exp(np.minimum(logit, 700.0)))
    return np.asarray(np.clip(np.where(x.q > 0.0, p, 0.0), TINY, 1.0 - TINY))


def minimum(used: Features, *, lift: bool = True) -> Minimum:
    """The least penalised loss; where all moments have one outcome, or there are none, the prior keeps it finite.

    Args:
        used: of moments with evidence.
        lift: with kappa; else it is 0.
    """
    from scipy.optimize import minimize

    names = _names(used, lift=lift)
    start, spread = _prior(names)

    # most moments of a grid hold what the one before held: each is worked out once and counts as often as it is there
    rows, times = np.unique(np.column_stack([used.m, used.q, used.lift, used.y]), axis=0, return_counts=True)
    once = Features(rows[:, 0], rows[:, 1], rows[:, 2], rows[:, 3], np.zeros(len(rows), np.int64))

    def objective(u: Array) -> tuple[float, Array]:
        away = (u - start) / spread
        losses, slopes = _losses(once, u), _slopes(once, u)
        return float(times @ losses + 0.5 * (away**2).sum()), times @ slopes + away / spread

    bounds = [LIMITS[n] for n in names]
    starts = [start] if len(names) < 4 else [np.array([*start[:3], k]) for k in KAPPAS]
    # L-BFGS-B asks BLAS for threads on every step, which takes ten times as long where a core is busy
    ends = [minimize(objective, u, jac=True, method="SLSQP", bounds=bounds, options={"ftol": 1e-7}) for u in starts]
    best = min(ends, key=lambda end: float(end.fun))
    u = np.asarray(best.x, float)
    return Minimum(u, float(best.fun), _losses(used, u))


def fit(x: Features, *, lift: bool = True) -> Fitted:
    """Fit to labelled moments.

    Args:
        x: of the moments; those with nothing in the window say nothing of the parameters.
        lift: fit kappa too; else it is 0.

    Raises:
        BadInputError: no moment with evidence, or all of them have one outcome.
    """
    used = x.of(x.q > 0.0)
    if len(used.y) == 0 or used.y.min() == used.y.max():
        raise BadInputError("events", "moments with evidence must include some before an accident and some without one")
    names = _names(used, lift=lift)
    spread = _prior(names)[1]
    u, _, losses = minimum(used, lift=lift)
    bread = np.linalg.pinv(_jacobian(lambda v: _slopes(used, v).sum(axis=0), u) + np.diag(spread**-2.0))
    by_group = np.zeros((int(used.group.max()) + 1, len(u)))
    np.add.at(by_group, used.group, _slopes(used, u))
    spread_of = np.sqrt(np.diag(bread @ (by_group.T @ by_group) @ bread))
    intervals = {}
    for k, name in enumerate(names):
        low, high = u[k] - 1.96 * spread_of[k], u[k] + 1.96 * spread_of[k]
        intervals[name] = (float(low), float(high)) if name == "b" else (float(np.exp(low)), float(np.exp(high)))
    return Fitted(*_point(u), intervals, float(losses.mean()), len(used.y), int(used.y.sum()))


def _names(used: Features, *, lift: bool) -> tuple[str, ...]:
    return ("a", "b", "c", "kappa") if lift and used.lift.any() else ("a", "b", "c")


def _prior(names: tuple[str, ...]) -> tuple[Array, Array]:
    return np.array([START[n] for n in names], float), np.array([SPREAD[n] for n in names], float)


def _point(u: Array) -> _Point:
    return _Point(float(np.exp(u[0])), float(u[1]), float(np.exp(u[2])), float(np.exp(u[3])) if len(u) > 3 else 0.0)


def _losses(x: Features, u: Array) -> Array:
    p = predict(x, *_point(u))
    return np.asarray(-np.log(np.where(x.y > 0.5, p, 1.0 - p)))


def _slopes(x: Features, u: Array) -> Array:
    """Slopes d loss_i / d u_k, moments x parameters.

    With P = S L: d ln P = d ln S + d ln L and d ln(1 - P) = -P / (1 - P) d ln P.
    """
    a, b, c, kappa = _point(u)
    p = predict(x, a, b, c, kappa)
    z = a * (x.m + kappa * x.lift - b)
    rest = 1.0 / (1.0 + np.exp(np.clip(z, -700.0, 700.0)))
    cq = c * x.q
    saturation = cq / np.expm1(np.clip(cq, 1e-300, 700.0))
    columns = [rest * z, -a * rest, saturation, a * kappa * rest * x.lift]
    sign = np.where(x.y > 0.5, -1.0, p / (1.0 - p))
    sign = np.where((p > TINY) & (p < 1.0 - TINY), sign, 0.0)
    return np.asarray(sign[:, None] * np.stack(columns[: len(u)], axis=-1))


def _jacobian(f: Callable[[Array], Array], u: Array) -> Array:
    """Slopes by central differences, made symmetric: the second derivatives of what f is the gradient of."""
    h = 1e-4
    rows = np.stack([(f(u + e) - f(u - e)) / (2.0 * h) for e in h * np.eye(len(u))])
    return np.asarray(0.5 * (rows + rows.T))
