"""Global sensitivity: Sobol indices by SALib, with intervals, and with what half of the samples would have given."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import combinations

import msgspec
import numpy as np
from numpy.typing import NDArray
from SALib.analyze import sobol as analysis
from SALib.sample import sobol as sampling

from foreshock.errors import ConfigError

__all__ = ["Index", "Indices", "Interaction", "sobol_indices"]

RESAMPLES = 200
"""Bootstrap of the intervals."""


class Index(msgspec.Struct, frozen=True):
    """Of one factor for one output.

    Attributes:
        factor: id.
        first: share of the variance that it explains by itself (S1). An estimate of 0 can come out slightly negative.
        first_half: half width of the 95% interval.
        total: share that is lost if it is fixed: by itself and in all its interactions (ST).
        total_half: half width of the 95% interval.
        first_before: first, from the first half of the samples.
        total_before: total, from the first half of the samples.
    """

    factor: str
    first: float
    first_half: float
    total: float
    total_half: float
    first_before: float
    total_before: float


class Interaction(msgspec.Struct, frozen=True):
    """Share of the variance that two factors explain only together (S2), with the half width of its 95% interval."""

    factors: tuple[str, str]
    second: float
    second_half: float


class Indices(msgspec.Struct, frozen=True):
    """Of one output.

    Attributes:
        output: id.
        mean: of the output over the ranges.
        deviation: its standard deviation; 0 if it never varies, and then there are no indices.
        quantiles: 5%, 50% and 95%.
        factors: indices, one a factor.
        interactions: by pairs, where they were asked for.
        moved: largest change of any index, first or total, from half of the samples to all.
    """

    output: str
    mean: float
    deviation: float
    quantiles: tuple[float, float, float]
    factors: tuple[Index, ...]
    interactions: tuple[Interaction, ...]
    moved: float


def sobol_indices(
    f: Callable[[Mapping[str, float]], Mapping[str, float]],
    ranges: Mapping[str, tuple[float, float]],
    samples: int,
    seed: int,
    done: Callable[[], None] | None = None,
    *,
    second_order: bool = False,
) -> list[Indices]:
    """Indices of every output of f (Saltelli et al. 2010, doi:10.1016/j.cpc.2009.09.018, as in SALib).

    Args:
        f: of the factors by name; gives outputs by name.
        ranges: of the factors, uniform and independent.
        samples: N, a power of two from 16; f is evaluated N (D + 2) times, N (2D + 2) with second order.
        seed: of the scrambled Sobol sequence and of the bootstrap.
        done: told after every evaluation.
        second_order: find the interactions of pairs too.

    Raises:
        ConfigError: samples is not a power of two, or too few.
    """
    if samples < 16 or samples & (samples - 1):
        near = max(16, 1 << max(samples, 1).bit_length() - 1)
        raise ConfigError("samples", f"{samples} is not a power of two from 16", f"; take {near}")
    names = list(ranges)
    problem = {"num_vars": len(names), "names": names, "bounds": [list(ranges[n]) for n in names]}
    rows: NDArray[np.float64] = sampling.sample(problem, samples, calc_second_order=second_order, seed=seed)
    found: dict[str, list[float]] = {}
    for row in rows:
        for name, value in f(dict(zip(names, map(float, row), strict=True))).items():
            found.setdefault(name, []).append(value)
        if done is not None:
            done()
    return [_of(name, np.asarray(values), problem, seed, second_order) for name, values in found.items()]


def _of(name: str, y: NDArray[np.float64], problem: Mapping[str, object], seed: int, second_order: bool) -> Indices:
    low, middle, high = (float(q) for q in np.quantile(y, (0.05, 0.5, 0.95)))
    if _constant(y):
        return Indices(name, float(y.mean()), 0.0, (low, middle, high), (), (), 0.0)
    factors: Sequence[str] = problem["names"]  # type: ignore[assignment]  # SALib's problem is a plain dict
    s = _analysed(y, problem, seed, second_order)
    # the rows of one base sample stand together, and half of a Sobol sequence of 2^k points is one of 2^(k-1)
    half = y[: len(y) // 2]
    before: Mapping[str, NDArray[np.float64]] = {k: np.zeros(len(factors)) for k in ("S1", "ST")}
    if not _constant(half):
        before = _analysed(half, problem, seed, second_order)
    columns = [s["S1"], s["S1_conf"], s["ST"], s["ST_conf"], before["S1"], before["ST"]]
    indices = tuple(Index(n, *(float(c[k]) for c in columns)) for k, n in enumerate(factors))
    pairs: tuple[Interaction, ...] = ()
    if second_order:
        pairs = tuple(
            Interaction((factors[j], factors[k]), float(s["S2"][j, k]), float(s["S2_conf"][j, k]))
            for j, k in combinations(range(len(factors)), 2)
        )
    moved = max(max(abs(i.first - i.first_before), abs(i.total - i.total_before)) for i in indices)
    return Indices(name, float(y.mean()), float(y.std()), (low, middle, high), indices, pairs, moved)


def _constant(y: NDArray[np.float64]) -> bool:
    """Whether it varies by no more than rounding."""
    return float(np.ptp(y)) <= 1e-12 * max(1.0, float(np.abs(y).max()))


def _analysed(
    y: NDArray[np.float64], problem: Mapping[str, object], seed: int, second_order: bool
) -> Mapping[str, NDArray[np.float64]]:
    # SALib takes seed 0 for no seed at all
    found: Mapping[str, NDArray[np.float64]] = analysis.analyze(
        problem, y, calc_second_order=second_order, num_resamples=RESAMPLES, seed=seed + 1
    )
    return found
