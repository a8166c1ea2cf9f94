"""Eq. 1 on plain counts, as in the paper, which assumes that precursors are independent."""

from __future__ import annotations

import math
from collections.abc import Sequence

from foreshock.risk._estimator import Counted, GroupedRisk, Judged
from foreshock.risk._le import LogisticExponential
from foreshock.taxonomy import Taxonomy

__all__ = ["IndependentRisk"]


class IndependentRisk(GroupedRisk):
    """m is the number of precursors and q that of their occurrences; the bounds are P itself."""

    def __init__(self, model: LogisticExponential, taxonomy: Taxonomy) -> None:
        self._model = model
        super().__init__(taxonomy)

    def judge(self, members: Sequence[Counted]) -> Judged:
        """Eq. 1 on the sums."""
        m = math.fsum([one.weight for one in members])
        q = math.fsum([one.occurrences for one in members])
        p = self._model.of_counts(m, q)
        return Judged(p, p, p, m, q)
