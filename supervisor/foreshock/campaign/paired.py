"""Statistics of paired runs: the difference of two rates with interval and test; correction for many tests."""

from __future__ import annotations

import math
from collections.abc import Sequence
from statistics import NormalDist

import msgspec

__all__ = ["PairedDifference", "holm", "mcnemar", "paired_difference"]

Z = NormalDist().inv_cdf(0.975)


class PairedDifference(msgspec.Struct, frozen=True):
    """How the rate of an event differs between two arms on the same seeds.

    Attributes:
        n: pairs.
        only_first: pairs with the event in the first arm alone.
        only_second: in the second alone.
        difference: rate of the second minus rate of the first; NaN without pairs.
        low: of the 95% interval.
        high: of it.
        p: two-sided exact McNemar test that both rates are the same.
    """

    n: int
    only_first: int
    only_second: int
    difference: float
    low: float
    high: float
    p: float


def mcnemar(only_first: int, only_second: int, *, greater: bool = False) -> float:
    """Exact McNemar test on the discordant pairs: under the null, only_second ~ Binomial(n, 1/2) (McNemar, 1947).

    Args:
        only_first: pairs with the event in the first alone.
        only_second: in the second alone.
        greater: one-sided, that the second has more.
    """
    n = only_first + only_second
    if n == 0:
        return 1.0
    from scipy.stats import binomtest

    return float(binomtest(only_second, n, 0.5, alternative="greater" if greater else "two-sided").pvalue)


def paired_difference(first: Sequence[bool], second: Sequence[bool]) -> PairedDifference:
    """Difference of two paired proportions with its 95% interval by Bonett and Price.

    With p12 = (n12 + 1) / (n + 2), p21 = (n21 + 1) / (n + 2) of the discordant counts, the interval is
    p21 - p12 -+ z sqrt((p12 + p21 - (p21 - p12)^2) / (n + 2)), within [-1, 1]: Bonett and Price, Adjusted Wald
    confidence interval for a difference of binomial proportions based on paired data, J. Educ. Behav. Stat. 37 (2012).
    """
    n = len(first)
    b = sum(a and not c for a, c in zip(first, second, strict=True))
    c = sum(d and not a for a, d in zip(first, second, strict=True))
    if n == 0:
        return PairedDifference(0, 0, 0, math.nan, -1.0, 1.0, 1.0)
    p12, p21 = (b + 1) / (n + 2), (c + 1) / (n + 2)
    half = Z * math.sqrt((p12 + p21 - (p21 - p12) ** 2) / (n + 2))
    low, high = max(p21 - p12 - half, -1.0), min(p21 - p12 + half, 1.0)
    return PairedDifference(n, b, c, (c - b) / n, low, high, mcnemar(b, c))


def holm(p_values: Sequence[float]) -> list[float]:
    """P values adjusted so that the chance of any false alarm is that of one test (Holm, 1979)."""
    order = sorted(range(len(p_values)), key=p_values.__getitem__)
    adjusted = [1.0] * len(p_values)
    worst = 0.0
    for rank, k in enumerate(order):
        worst = max(worst, min(1.0, (len(p_values) - rank) * p_values[k]))
        adjusted[k] = worst
    return adjusted
