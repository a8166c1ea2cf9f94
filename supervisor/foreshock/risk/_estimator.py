"""What every risk model shares: precursors grouped by mode and class, judged only where a group changed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import NamedTuple, Protocol

from foreshock.records import Attribution, Explanation, Precursor, RiskEstimate
from foreshock.taxonomy import Taxonomy

__all__ = ["Counted", "GroupedRisk", "Judged", "RiskModel"]


class Counted(NamedTuple):
    """All of a precursor that its risk depends on."""

    kind: str
    subject: str
    weight: float
    occurrences: float
    severity: float
    onsets_ns: tuple[int, ...]


def _counted(p: Precursor) -> Counted:
    return Counted(p.kind, p.subject, p.weight, p.occurrences, p.severity, p.onsets_ns or (p.onset_ns,))


class Judged(NamedTuple):
    """P of a group with its bounds, and the m and q behind P."""

    probability: float
    lower: float
    upper: float
    m: float
    q: float


class RiskModel(Protocol):
    """Precursors to a RiskEstimate."""

    def modes_of(self, kind: str) -> Sequence[str]:
        """Accident modes that a kind counts for."""

    def estimate(self, precursors: Sequence[Precursor]) -> RiskEstimate:
        """The risk of these precursors; each (kind, subject) is one of them."""

    def explain(self, precursors: Sequence[Precursor], gate: float, mode: str = "") -> Explanation:
        """Why P is what it is."""


NONE = Judged(0.0, 0.0, 0.0, 0.0, 0.0)


class GroupedRisk:
    """A precursor counts overall, for its class, and for every mode that Tables 2 and 3 tie its kind to.

    A group whose members are those of the last call keeps its figures: they stay the same from tick to tick but for an
    onset, a recurrence, an expiry, or a severity that rises.

    Args:
        taxonomy: kinds, classes and modes.
    """

    def __init__(self, taxonomy: Taxonomy) -> None:
        self._modes = {k.id: taxonomy.modes_of(k.id) for k in taxonomy.kinds}
        self._groups = {k.id: ("", "/" + k.class_, *self._modes[k.id]) for k in taxonomy.kinds}
        self._codes = taxonomy.codes
        self._classes = tuple(c.id for c in taxonomy.classes)
        self._before: Sequence[tuple[object, ...]] = []
        self._members: Mapping[str, Sequence[Counted]] = {}
        self._judged: dict[str, Judged] = {}
        self._last = self._assembled()

    def judge(self, members: Sequence[Counted]) -> Judged:
        """P of one group; at least one member."""
        raise NotImplementedError

    def modes_of(self, kind: str) -> Sequence[str]:
        """Accident modes that a kind counts for."""
        return self._modes[kind]

    def estimate(self, precursors: Sequence[Precursor]) -> RiskEstimate:
        """The risk of these precursors; each (kind, subject) is one of them."""
        counted = [
            (p.kind, p.subject, p.weight, p.occurrences, p.severity, p.onsets_ns or (p.onset_ns,)) for p in precursors
        ]
        if counted != self._before:
            self._before = counted
            members: dict[str, list[Counted]] = {}
            for p in precursors:
                one = _counted(p)
                for group in self._groups[p.kind]:
                    if group in members:
                        members[group].append(one)
                    else:
                        members[group] = [one]
            old, judged = self._members, self._judged
            self._judged = {
                group: judged[group] if old.get(group) == mine else self.judge(mine) for group, mine in members.items()
            }
            self._members = members
            self._last = self._assembled()
        last = self._last
        # copies: whoever writes into an estimate must not move that of the next tick
        return RiskEstimate(
            last.probability,
            last.lower,
            last.upper,
            last.m,
            last.q,
            last.by_mode.copy(),
            last.by_class.copy(),
            last.counts.copy(),
            last.upper_by_mode.copy(),
            last.upper_by_class.copy(),
        )

    def explain(self, precursors: Sequence[Precursor], gate: float, mode: str = "") -> Explanation:
        """Leave-one-out shares, and the smallest set that keeps trust below the gate.

        P is the upper bound, which actions are taken on by default. Sets of up to three are searched; where none is
        enough, precursors are taken away one by one, the weakest first, as long as the rest is enough.

        Args:
            precursors: those of a decision.
            gate: of trust.
            mode: code of an accident mode; ``""`` for overall.
        """
        mine = [_counted(p) for p in precursors if not mode or mode in self._modes[p.kind]]
        whole = self._upper(mine)
        shares = [
            Attribution(one.kind, one.subject, whole - self._upper(mine[:k] + mine[k + 1 :]))
            for k, one in enumerate(mine)
        ]
        shares.sort(key=lambda a: (-a.share, a.kind, a.subject))
        return Explanation(mode, whole, tuple(shares), gate, self._smallest(mine, gate))

    def _upper(self, members: Sequence[Counted]) -> float:
        return self.judge(members).upper if members else 0.0

    def _smallest(self, members: Sequence[Counted], gate: float) -> tuple[tuple[str, str], ...]:
        def enough(chosen: Sequence[Counted]) -> bool:
            return not (1.0 - self._upper(chosen) >= gate)

        if not enough(members):
            return ()
        for size in range(min(len(members), 4)):
            for chosen in combinations(members, size):
                if enough(chosen):
                    return tuple((c.kind, c.subject) for c in chosen)
        left = list(members)
        for one in sorted(members, key=lambda c: (c.weight * c.severity, c.occurrences, c.kind, c.subject)):
            without = [c for c in left if c is not one]
            if enough(without):
                left = without
        return tuple((c.kind, c.subject) for c in left)

    def _assembled(self) -> RiskEstimate:
        of = self._judged
        overall = of.get("", NONE)
        modes = {code: of.get(code, NONE) for code in self._codes}
        classes = {id_: of.get("/" + id_, NONE) for id_ in self._classes}
        return RiskEstimate(
            overall.probability,
            overall.lower,
            overall.upper,
            overall.m,
            overall.q,
            {code: j.probability for code, j in modes.items()},
            {id_: j.probability for id_, j in classes.items()},
            {code: (j.m, j.q) for code, j in modes.items()},
            {code: j.upper for code, j in modes.items()},
            {id_: j.upper for id_, j in classes.items()},
        )
