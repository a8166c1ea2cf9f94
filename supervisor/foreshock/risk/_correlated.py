"""Eq. 1 on effective numbers: the extension to correlated precursors that the paper leaves as future work.

    m* = Choquet(s; mu) + kappa * lift      s_i = w_i (p0 + (1 - p0) severity_i), w_i the window's weight, p0 presence
    q* = Choquet(q; mu)
    P* = LE(m*, q*)

mu is the effective number of independent kinds (_capacity), lift that of the ordered cascades (_cascade). R = I,
kappa = 0 and full severity give Eq. 1 exactly; a duplicate adds nothing.

A wrong R would hide risk. lower takes the upper end of every r and the lower end of every J; upper is the larger of
Eq. 1 on the plain counts and of P* at R = I with the upper end of every J: mu and the lift fall as R grows, so that
no R inside its interval, nor any other, gives more.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from foreshock.risk._capacity import Capacity, choquet
from foreshock.risk._cascade import Element, Links, cascade_lift
from foreshock.risk._estimator import Counted, GroupedRisk, Judged
from foreshock.risk._le import LogisticExponential
from foreshock.risk._parameters import RiskParameters
from foreshock.taxonomy import Taxonomy

__all__ = ["CorrelatedRisk"]


class CorrelatedRisk(GroupedRisk):
    """P* with its bounds.

    Args:
        parameters: checked against the taxonomy.
        taxonomy: kinds, classes and modes.
    """

    def __init__(self, parameters: RiskParameters, taxonomy: Taxonomy) -> None:
        p = parameters
        self._model = LogisticExponential(p.a, p.b, p.c)
        self._kappa, self._presence = p.kappa, p.presence
        r = {pair.kinds: pair.r for pair in p.correlation}
        most = {pair.kinds: pair.high for pair in p.correlation}
        self._mu, self._mu_low = Capacity(r), Capacity(most)
        self._links = _links({(k.first, k.then): k.lift for k in p.cascade}, self._mu)
        self._links_low = _links({(k.first, k.then): k.low for k in p.cascade}, self._mu_low)
        self._links_high = _links({(k.first, k.then): k.high for k in p.cascade}, Capacity({}))
        super().__init__(taxonomy)

    def judge(self, members: Sequence[Counted]) -> Judged:
        """P* and its bounds."""
        kinds = [one.kind for one in members]
        p0 = self._presence
        strengths = [one.weight * (p0 + (1.0 - p0) * one.severity) for one in members]
        counts = [one.occurrences for one in members]
        elements = [Element(one.kind, s, one.onsets_ns) for one, s in zip(members, strengths, strict=True)]
        le = self._model.of_counts
        total, q_all = math.fsum(strengths), math.fsum(counts)
        lift_high = self._kappa * cascade_lift(elements, self._links_high)
        upper = max(le(math.fsum([one.weight for one in members]), q_all), le(total + lift_high, q_all))
        m, q = self._effective(kinds, strengths, counts, elements, self._mu, self._links)
        low = le(*self._effective(kinds, strengths, counts, elements, self._mu_low, self._links_low))
        p = le(m, q)
        return Judged(p, min(low, p), max(upper, p), m, q)

    def _effective(
        self,
        kinds: Sequence[str],
        strengths: Sequence[float],
        counts: Sequence[float],
        elements: Sequence[Element],
        mu: Capacity,
        links: Links,
    ) -> tuple[float, float]:
        """m* and q*."""
        if mu.correlated(kinds):
            m, q = choquet(strengths, kinds, mu), choquet(counts, kinds, mu)
        else:
            m, q = math.fsum(strengths), math.fsum(counts)
        return m + self._kappa * cascade_lift(elements, links), q


def _links(lifts: dict[tuple[str, str], float], mu: Capacity) -> Links:
    """(1 - r_ij) J_ij by first and second kind."""
    links: dict[str, dict[str, float]] = {}
    for (first, then), lift in lifts.items():
        weight = (1.0 - mu.correlation(first, then)) * lift
        if weight > 0.0:
            links.setdefault(first, {})[then] = weight
    return links
