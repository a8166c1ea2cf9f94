"""Shares and frequencies with their 95% intervals."""

from __future__ import annotations

import math

import msgspec

__all__ = ["Frequency", "Rate", "per_hour", "wilson"]


class Rate(msgspec.Struct, frozen=True):
    """The rate k/n, with the 95% Wilson interval."""

    k: int
    n: int
    low: float
    high: float

    def __str__(self) -> str:
        return f"{self.k}/{self.n} ({100 * self.low:.0f}–{100 * self.high:.0f}%)" if self.n else "–"


class Frequency(msgspec.Struct, frozen=True):
    """So many events in so many hours, with the exact 95% Poisson interval per hour."""

    k: int
    hours: float
    low: float
    high: float

    @property
    def per_hour(self) -> float:
        """Events per hour; NaN of no time at all."""
        return self.k / self.hours if self.hours else math.nan

    def __str__(self) -> str:
        if not self.hours:
            return "–"
        return f"{self.per_hour:.2f} ({self.low:.2f}–{self.high:.2f}) in {self.hours:.1f} h"


def wilson(k: int, n: int) -> Rate:
    """The rate k/n with its 95% Wilson score interval (scipy.stats.binomtest)."""
    if n == 0:
        return Rate(0, 0, 0.0, 1.0)
    from scipy.stats import binomtest

    interval = binomtest(k, n).proportion_ci(0.95, "wilson")
    return Rate(k, n, float(interval.low), float(interval.high))


def per_hour(k: int, hours: float) -> Frequency:
    """So many events in so many hours with their exact 95% Poisson interval (chi-square quantiles; Garwood, 1936)."""
    if hours == 0.0:
        return Frequency(k, 0.0, 0.0, math.inf)
    from scipy.stats import chi2

    low = float(chi2.ppf(0.025, 2 * k)) / 2.0 if k else 0.0
    return Frequency(k, hours, low / hours, float(chi2.ppf(0.975, 2 * k + 2)) / 2.0 / hours)
