"""Profile likelihood of window, scale of R and presence: what the data say of each when all else is fitted anew.

    D(theta) = min over everything else of loss(theta, ...) - loss at the best,    loss penalised as in fit

The loss is that of all moments: of those without evidence, whose P is 0 by Eq. 1, at the share that ended in an
accident, since only then are windows comparable that leave different moments without evidence. The 95% interval is
{theta : D <= 1.92 max(1, lambda)}, 1.92 being half the 0.95 quantile of chi2 with 1 degree of freedom. lambda is the
design effect, sum over groups of d_g^2 over 2 D, with d_g the share of group g in D: 1 for independent moments, more
where many moments of one run say the same (Chandler and Bate 2007, doi:10.1093/biomet/asm015).
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray

from foreshock.calibration.features import Values
from foreshock.calibration.fit import Minimum, minimum
from foreshock.calibration.moments import Moments

__all__ = ["NAMES", "WINDOWS_S", "Axes", "Key", "Profile", "Surface", "axes", "best", "profiles", "refined"]

Array = NDArray[np.float64]
Key = tuple[float, float, float]
"""window_s, rho, presence."""
Axes = tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]
"""Values that are tried of each, sorted; one value is not fitted."""
NAMES = ("window_s", "rho", "presence")
DROP = 1.92
WINDOWS_S = tuple(0.25 * k for k in range(2, 13))
"""0.5 to 3 s: the paper's overlap is 0.5 to 1.5 s."""
SHARES = tuple(0.125 * k for k in range(9))
FINER = 5
"""The steps beside the best value are divided by this, once."""
MODE = (1.5, 1.0, 1.0)
"""Where the prior is largest: the paper's window, R as nominal statistics gave it, every precursor at full strength."""
WIDTHS = (float(np.log(2.0)), 0.5, 0.5)
"""Of the prior: of ln window, of rho, of presence."""


class Profile(msgspec.Struct, frozen=True):
    """Of one scalar: its best value, 95% interval, and D over the values that were tried.

    Attributes:
        name: window_s, rho or presence.
        best: where the loss is least.
        low: lower end of the interval; the first value of the curve if D stays below the limit.
        high: upper end, likewise.
        effect: the design effect, at least 1.
        limit: of D inside the interval.
        curve: (value, D), sorted.
    """

    name: str
    best: float
    low: float
    high: float
    effect: float
    limit: float
    curve: tuple[tuple[float, float], ...]


class _Height(NamedTuple):
    """Penalised loss, and without the penalty its share by group."""

    loss: float
    by_group: Array


class Surface:
    """The loss at each (window_s, rho, presence), least over a, b, c and kappa; each is worked out once.

    Args:
        moments: labelled.
        lifts: J by (first, then).
        chosen: numbers of the moments that count; all by default.
        lift: with kappa.
    """

    def __init__(
        self, moments: Moments, lifts: Values, chosen: NDArray[np.int64] | None = None, *, lift: bool = True
    ) -> None:
        self._moments, self._lifts, self._lift = moments, lifts, lift
        self._chosen = np.arange(len(moments.y)) if chosen is None else chosen
        self._known: dict[Key, _Height] = {}

    def at(self, key: Key) -> _Height:
        """The height there."""
        if key not in self._known:
            self._known[key] = self._height(key)
        return self._known[key]

    def _height(self, key: Key) -> _Height:
        x = self._moments.features(*key, self._lifts).of(self._chosen)
        seen = x.q > 0.0
        found: Minimum = minimum(x.of(seen), lift=self._lift)
        losses = np.empty(len(x.y))
        losses[seen] = found.losses
        unseen = x.y[~seen]
        share = (unseen.sum() + 0.5) / (len(unseen) + 1.0)
        losses[~seen] = -np.log(np.where(unseen > 0.5, share, 1.0 - share))
        away = ((np.log(key[0] / MODE[0])) / WIDTHS[0], (key[1] - MODE[1]) / WIDTHS[1], (key[2] - MODE[2]) / WIDTHS[2])
        penalty = 0.5 * sum(float(z) ** 2 for z in away)
        by_group = np.zeros(len(self._moments.groups))
        np.add.at(by_group, x.group, losses)
        return _Height(found.loss + float(losses[~seen].sum()) + penalty, by_group)


def axes(moments: Moments, windows: Sequence[float] = WINDOWS_S, step: int = 1) -> Axes:
    """Values to try: windows, and the rho and presence that the events can tell anything of.

    Args:
        moments: labelled.
        windows: in s; a single one is kept.
        step: take every so many of the values; more for a coarser grid.
    """
    tried = tuple(sorted(set(windows)))
    rho = SHARES[::step] if moments.correlated else (1.0,)
    presence = SHARES[::step] if any(moments.graded(w) for w in tried) else (1.0,)
    return (tried[::step], rho, presence)


def best(surface: Surface, grid: Axes, start: Key | None = None) -> Key:
    """The lowest point: one axis after the other over all its values, until none of them gains.

    Args:
        surface: of losses.
        grid: values of each axis.
        start: where to begin; by default nearest to where the prior is largest.
    """
    here = start or (_nearest(grid[0], MODE[0]), _nearest(grid[1], MODE[1]), _nearest(grid[2], MODE[2]))
    while True:
        before = here
        for k, values in enumerate(grid):
            here = min([here, *(_moved(here, k, v) for v in values)], key=lambda key: surface.at(key).loss)
        if here == before:
            return here


def refined(surface: Surface, grid: Axes, here: Key, kept: Sequence[str] = ()) -> tuple[Axes, Key]:
    """The grid with finer steps beside its lowest point, and the lowest point of that.

    Args:
        surface: of losses.
        grid: values of each axis.
        here: the lowest point of it.
        kept: names of axes that stay as they are.
    """
    finer = []
    for name, values, v in zip(NAMES, grid, here, strict=True):
        if name in kept:
            finer.append(values)
            continue
        k = values.index(v)
        ends = itertools.pairwise(values[max(k - 1, 0) : k + 2])
        between = [round(a + (b - a) * n / FINER, 6) for a, b in ends for n in range(1, FINER)]
        finer.append(tuple(sorted({*values, *between})))
    fine: Axes = (finer[0], finer[1], finer[2])
    return fine, best(surface, fine, here)


def profiles(surface: Surface, fine: Axes, coarse: Axes, top: Key) -> dict[str, Profile]:
    """The profile of every axis that has more than one value, by name.

    Args:
        surface: of losses.
        fine: values of each axis at which it is profiled.
        coarse: values that the others take meanwhile, beside their best.
        top: the lowest point.
    """
    w, rho, presence = (tuple(sorted({*values, best})) for values, best in zip(coarse, top, strict=True))
    others: Axes = (w, rho, presence)
    return {NAMES[k]: _profile(surface, v, others, top, k) for k, v in enumerate(fine) if len(v) > 1}


def _profile(surface: Surface, values: Sequence[float], grid: Axes, top: Key, axis: int) -> Profile:
    middle = values.index(top[axis])
    lowest: dict[float, Key] = {top[axis]: top}
    for side in (values[middle + 1 :], values[:middle][::-1]):
        here = top
        for v in side:
            here = _descended(surface, grid, _moved(here, axis, v), axis)
            lowest[v] = here
    peak = surface.at(top)
    drops = {v: max(surface.at(key).loss - peak.loss, 0.0) for v, key in lowest.items()}
    shares = {v: surface.at(key).by_group - peak.by_group for v, key in lowest.items()}
    effect = _design_effect(drops, shares, top[axis])
    limit = DROP * effect
    low = _end(values[middle::-1], drops, limit)
    high = _end(values[middle:], drops, limit)
    return Profile(NAMES[axis], top[axis], low, high, effect, limit, tuple((v, drops[v]) for v in values))


def _descended(surface: Surface, grid: Axes, here: Key, held: int) -> Key:
    """Downhill by single steps along the axes that are not held."""
    while True:
        near = [here]
        for k, values in enumerate(grid):
            if k != held:
                n = values.index(here[k])
                near += [_moved(here, k, v) for v in (*values[max(n - 1, 0) : n], *values[n + 1 : n + 2])]
        lower = min(near, key=lambda key: surface.at(key).loss)
        if lower == here:
            return here
        here = lower


def _design_effect(drops: Mapping[float, float], shares: Mapping[float, Array], top: float) -> float:
    """Lambda, from the values nearest to the best: those beside it, and all others with D up to ten times the limit."""
    values = sorted(drops)
    k = values.index(top)
    beside = {*values[max(k - 1, 0) : k], *values[k + 1 : k + 2]}
    some = [v for v in values if v != top and (v in beside or drops[v] <= 10.0 * DROP)]
    total = 2.0 * sum(drops[v] for v in some)
    return max(1.0, sum(float(shares[v] @ shares[v]) for v in some) / total) if total > 0.0 else 1.0


def _end(outward: Sequence[float], drops: Mapping[float, float], limit: float) -> float:
    """Where D first passes the limit on the way out; sqrt(D) is taken as linear between two values."""
    for a, b in itertools.pairwise(outward):
        if drops[b] > limit:
            near, far = np.sqrt(min(drops[a], limit)), np.sqrt(drops[b])
            return float(a + (b - a) * (np.sqrt(limit) - near) / (far - near))
    return float(outward[-1])


def _nearest(values: Sequence[float], to: float) -> float:
    return min(values, key=lambda v: abs(v - to))


def _moved(key: Key, axis: int, value: float) -> Key:
    moved = (*key[:axis], value, *key[axis + 1 :])
    return (moved[0], moved[1], moved[2])
