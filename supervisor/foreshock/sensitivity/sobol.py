"""Global sensitivity: Sobol indices by SALib."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import msgspec
import numpy as np
from numpy.typing import NDArray

__all__ = ["Index", "sobol_indices"]


class Index(msgspec.Struct, frozen=True):
    """Of one parameter: first-order and total index with the half widths of their 95% intervals (bootstrap).

    The first-order index is the share of the variance that the parameter explains by itself; the total one adds all of
    its interactions.
    """

    name: str
    first: float
    first_half: float
    total: float
    total_half: float


def sobol_indices(
    f: Callable[[dict[str, float]], Mapping[str, float]],
    ranges: Mapping[str, tuple[float, float]],
    samples: int,
    seed: int,
    done: Callable[[], None] | None = None,
) -> dict[str, list[Index]]:
    """Indices of every output of f; an output that never varies has none (all 0).

    Args:
        f: of the parameters by name; gives outputs by name.
        ranges: of the parameters, uniform.
        samples: N, a power of two; f is evaluated N (D + 2) times.
        seed: of the scrambled Sobol sequence and of the bootstrap.
        done: told after every evaluation.
    """
    from SALib.analyze import sobol as analysis
    from SALib.sample import sobol as sampling

    names = list(ranges)
    problem = {"num_vars": len(names), "names": names, "bounds": [list(ranges[n]) for n in names]}
    rows: NDArray[np.float64] = sampling.sample(problem, samples, calc_second_order=False, seed=seed)
    found: dict[str, list[float]] = {}
    for row in rows:
        for name, value in f(dict(zip(names, map(float, row), strict=True))).items():
            found.setdefault(name, []).append(value)
        if done is not None:
            done()
    out = {}
    for name, values in found.items():
        y = np.asarray(values)
        if np.ptp(y) == 0.0:
            out[name] = [Index(n, 0.0, 0.0, 0.0, 0.0) for n in names]
            continue
        s = analysis.analyze(problem, y, calc_second_order=False, seed=seed)
        columns = [np.asarray(s[k], float) for k in ("S1", "S1_conf", "ST", "ST_conf")]
        out[name] = [Index(n, *(float(c[k]) for c in columns)) for k, n in enumerate(names)]
    return out
