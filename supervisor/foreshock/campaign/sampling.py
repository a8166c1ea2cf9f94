"""Points of a campaign: samples of the unit cube, mapped by each factor's quantile function."""

from __future__ import annotations

import itertools
import math
import zlib
from collections.abc import Sequence
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

from foreshock.campaign.spec import CampaignSpec, Factor
from foreshock.errors import MissingExtraError

__all__ = ["points_of", "quantile"]


def quantile(factor: Factor, u: float) -> float:
    """The factor's value at probability u in (0, 1): F^-1(u)."""
    if factor.values is not None:
        return factor.values[min(int(u * len(factor.values)), len(factor.values) - 1)]
    if factor.uniform is not None:
        low, high = factor.uniform
        return low + u * (high - low)
    if factor.log_uniform is not None:
        low, high = factor.log_uniform
        return low * math.exp(u * math.log(high / low))
    mean, sd = factor.normal or (0.0, 0.0)
    return NormalDist(mean, sd).inv_cdf(u)


def points_of(spec: CampaignSpec, factors: Sequence[Factor], scenario: str) -> list[dict[str, float]]:
    """Parameter values of every point of a scenario.

    Args:
        spec: says how points are chosen; the sampler's seed is the campaign's with the scenario's id.
        factors: those that this scenario has; without any there is one point.
        scenario: its id.

    Raises:
        MissingExtraError: the sampler needs scipy, which is not installed.
    """
    if not factors:
        return [{}]
    cube = _grid(factors) if spec.sampler == "grid" else _sampled(spec, len(factors), scenario)
    return [{f.parameter: quantile(f, float(u)) for f, u in zip(factors, row, strict=True)} for row in cube]


def _grid(factors: Sequence[Factor]) -> list[tuple[float, ...]]:
    counts = [len(f.values) if f.values is not None else f.levels for f in factors]
    return list(itertools.product(*([(k + 0.5) / n for k in range(n)] for n in counts)))


def _sampled(spec: CampaignSpec, dimension: int, scenario: str) -> NDArray[np.float64]:
    n = spec.points or 1
    rng = np.random.default_rng([0x706F696E74, spec.seed, zlib.crc32(scenario.encode())])
    if spec.sampler == "monte-carlo":
        cube = rng.random((n, dimension))
    else:
        try:
            from scipy.stats import qmc
        except ImportError as e:
            raise MissingExtraError(
                "sampler", f"{spec.sampler!r} needs {e.name}", "; run: pip install 'foreshock[campaign]'"
            ) from e
        engine = qmc.LatinHypercube if spec.sampler == "latin-hypercube" else qmc.Sobol
        cube = engine(dimension, rng=rng).random(n)
    least: float = np.nextafter(0.0, 1.0)
    return np.clip(cube, least, np.nextafter(1.0, 0.0))  # a quantile at 0 or 1 may be infinite
