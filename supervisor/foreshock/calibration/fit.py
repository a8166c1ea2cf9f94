"""Maximum likelihood with a weak prior: a, b, c and kappa from labelled moments.

    minimise  -sum_i [y_i ln P_i + (1 - y_i) ln(1 - P_i)] + sum_k ((u_k - u0_k) / s_k)^2 / 2

over u = (ln a, b, ln c, ln kappa), with the paper's values as u0 (kappa: 1). The prior decides where the data do not:
c shows only where few occurrences are seen. Intervals are 95%, by the sandwich H^-1 (sum over groups g g') H^-1, since
the moments of one run are not independent.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray

from foreshock.calibration.features import Features
from foreshock.errors import BadInputError

__all__ = ["Fitted", "fit", "predict"]

Array = NDArray[np.float64]
TINY = 1e-6
"""A predicted probability is kept this far from 0 and 1: an accident without any precursor is bad, not impossible."""
START = {"a": np.log(1.6), "b": 2.0, "c": np.log(1.2), "kappa": 0.0}
SPREAD = {"a": 1.0, "b": 2.0, "c": 1.0, "kappa": 1.5}
LIMITS = {"a": (-3.0, 3.0), "b": (-3.0, 12.0), "c": (-4.0, 4.0), "kappa": (-7.0, 3.0)}


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


def fit(x: Features, *, lift: bool = True) -> Fitted:
    """Fit to labelled moments.

    Args:
        x: of the moments; those with nothing in the window say nothing of the parameters.
        lift: fit kappa too; else it is 0.

    Raises:
        BadInputError: no moment with evidence, or all of them have one outcome.
    """
    from scipy.optimize import minimize

    used = x.of(x.q > 0.0)
    if len(used.y) == 0 or used.y.min() == used.y.max():
        raise BadInputError("events", "moments with evidence must include some before an accident and some without one")
    names = ("a", "b", "c", "kappa") if lift and used.lift.any() else ("a", "b", "c")
    start = np.array([START[n] for n in names], float)
    spread = np.array([SPREAD[n] for n in names], float)

    def losses(u: Array) -> Array:
        p = predict(used, *_point(u))
        return np.asarray(-np.log(np.where(used.y > 0.5, p, 1.0 - p)))

    def objective(u: Array) -> float:
        return float(losses(u).sum() + 0.5 * (((u - start) / spread) ** 2).sum())

    best = minimize(objective, start, method="L-BFGS-B", bounds=[LIMITS[n] for n in names])
    u = np.asarray(best.x, float)
    bread = np.linalg.pinv(_hessian(objective, u))
    slopes = _slopes(losses, u)
    by_group = np.zeros((int(used.group.max()) + 1, len(u)))
    np.add.at(by_group, used.group, slopes)
    spread_of = np.sqrt(np.diag(bread @ (by_group.T @ by_group) @ bread))
    intervals = {}
    for k, name in enumerate(names):
        low, high = u[k] - 1.96 * spread_of[k], u[k] + 1.96 * spread_of[k]
        intervals[name] = (float(low), float(high)) if name == "b" else (float(np.exp(low)), float(np.exp(high)))
    point = _point(u)
    return Fitted(*point, intervals, float(losses(u).mean()), len(used.y), int(used.y.sum()))


def _point(u: Array) -> _Point:
    return _Point(float(np.exp(u[0])), float(u[1]), float(np.exp(u[2])), float(np.exp(u[3])) if len(u) > 3 else 0.0)


STEP = 1e-4


def _slopes(f: Callable[[Array], Array], u: Array) -> Array:
    """Slopes d f_i / d u_k by central differences."""
    eye = STEP * np.eye(len(u))
    return np.stack([(f(u + e) - f(u - e)) / (2.0 * STEP) for e in eye], axis=-1)


def _hessian(f: Callable[[Array], float], u: Array) -> Array:
    """Second derivatives by central differences."""
    n, h = len(u), 1e-3
    out = np.empty((n, n))
    eye = h * np.eye(n)
    for i in range(n):
        for j in range(i + 1):
            plus, minus = (
                f(u + eye[i] + eye[j]) + f(u - eye[i] - eye[j]),
                f(u + eye[i] - eye[j]) + f(u - eye[i] + eye[j]),
            )
            out[i, j] = out[j, i] = (plus - minus) / (4.0 * h * h)
    return out
