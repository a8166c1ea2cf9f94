"""Shares of time and times that may not be over yet."""

from __future__ import annotations

import math
from collections.abc import Sequence

import msgspec

__all__ = ["TimeShare", "Times", "share_of_time"]


class TimeShare(msgspec.Struct, frozen=True):
    """Share of the time of n runs, with its 95% interval over runs; hours is the whole time."""

    share: float
    low: float
    high: float
    n: int
    hours: float

    def __str__(self) -> str:
        if not self.n:
            return "–"
        return f"{100 * self.share:.1f}% ({100 * self.low:.1f}–{100 * self.high:.1f}%)"


class Times(msgspec.Struct, frozen=True):
    """Times from one moment to another, sorted; infinite where the second did not come before the run ended."""

    values_s: tuple[float, ...]

    @property
    def reached(self) -> int:
        """Those that ended."""
        return sum(math.isfinite(v) for v in self.values_s)

    @property
    def quartiles_s(self) -> tuple[float, float, float] | None:
        """Quartiles by inverse of the empirical distribution, which may be infinite; None of no times."""
        n = len(self.values_s)
        if not n:
            return None
        low, middle, high = (self.values_s[math.ceil(q * n) - 1] for q in (0.25, 0.5, 0.75))
        return low, middle, high


def share_of_time(parts_s: Sequence[float], wholes_s: Sequence[float]) -> TimeShare:
    """The ratio estimate R = sum of parts / sum of wholes.

    Its variance is n / (n - 1) * sum (part - R whole)^2 / (sum of wholes)^2 (Cochran, Sampling Techniques, 3rd ed.,
    6.3), the interval that of Student's t with n - 1 degrees of freedom, within 0 and 1; of a single run it is all of
    it. Where no run differs from the others that variance says nothing: by the rule of three up to 3 / n of the runs
    may be of any other kind.
    """
    n, whole = len(parts_s), sum(wholes_s)
    if not n or not whole:
        return TimeShare(math.nan, 0.0, 1.0, 0, 0.0)
    share = sum(parts_s) / whole
    if n == 1:
        return TimeShare(share, 0.0, 1.0, 1, whole / 3600.0)
    rest = sum((p - share * w) ** 2 for p, w in zip(parts_s, wholes_s, strict=True))
    if rest <= (1e-9 * whole) ** 2:
        others = min(3.0 / n, 1.0)
        return TimeShare(share, share * (1.0 - others), share + (1.0 - share) * others, n, whole / 3600.0)
    from scipy.stats import t

    half = float(t.ppf(0.975, n - 1)) * math.sqrt(n / (n - 1) * rest) / whole
    low, high = max(share - half, 0.0), min(share + half, 1.0)
    return TimeShare(share, low, high, n, whole / 3600.0)
