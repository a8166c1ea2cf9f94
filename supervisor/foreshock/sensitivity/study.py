"""A parameter set under study: from values of its factors to what the timelines do."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from functools import lru_cache
from typing import Literal, NamedTuple

import msgspec

from foreshock.evidence import Window
from foreshock.risk import CorrelatedRisk, IndependentRisk, Link, LogisticExponential, Pair, RiskModel, RiskParameters
from foreshock.sensitivity.factors import Factor, factors_of, mean_lift, mean_r
from foreshock.sensitivity.outcome import Outcome, outcome
from foreshock.sensitivity.timeline import SEVERITY, Timeline, timelines_of
from foreshock.sensitivity.trajectory import Moment, trajectory
from foreshock.taxonomy import Taxonomy
from foreshock.trust import Gates

__all__ = ["OUTPUTS", "Output", "Study"]

Outcomes = Mapping[str, Outcome]
"""By id of the timeline."""


class Output(NamedTuple):
    """One number of what the timelines do: id, words for people, timeline that it is of, and how it is read."""

    id: str
    title: str
    timeline: str
    of: Callable[[Outcome], float]


OUTPUTS = (
    Output("p-first", "P at the first precursor", "cascade", lambda o: o.p_at[0]),
    Output("p-second", "P at the second", "cascade", lambda o: o.p_at[1]),
    Output("p-third", "P at the third", "cascade", lambda o: o.p_at[2]),
    Output("p-isolated", "peak P, isolated", "isolated", lambda o: o.peak),
    Output("p-peak", "peak P, cascade", "cascade", lambda o: o.peak),
    Output("gate", "time to gate (s)", "cascade", lambda o: o.gate_s),
    Output("opens", "gate opens (0, 1)", "cascade", lambda o: float(o.opened)),
    Output("recovery", "time to recovery (s)", "cascade", lambda o: o.recovery_s),
)
ON_P = Output("gate-on-p", "time to gate on P* (s)", "cascade", lambda o: o.gate_on_p_s)
"""In the correlated model only; in the other P is its own bound."""


class Study:
    """The cascade of one accident mode, run with any values of a model's parameters.

    Args:
        parameters: the nominal values; its kinds are ids. The independent model uses a, b, c and the window.
        model: of the risk.
        kinds: of the cascade, in order: three ids.
        taxonomy: that they belong to.
        gate: of trust; the paper's 0.3.
    """

    def __init__(
        self,
        parameters: RiskParameters,
        model: Literal["independent", "correlated"],
        kinds: Sequence[str],
        taxonomy: Taxonomy,
        gate: float = Gates().protective,
    ) -> None:
        self.model, self.kinds = model, tuple(kinds)
        self.parameters = _about(parameters, self.kinds)
        self.timelines = timelines_of(self.kinds)
        self.factors: list[Factor] = factors_of(parameters, kinds, gate, SEVERITY, model == "correlated")
        self.outputs: tuple[Output, ...] = (*OUTPUTS, ON_P) if model == "correlated" else OUTPUTS
        self.nominal = {f.id: f.nominal for f in self.factors}
        self._r, self._lift = mean_r(parameters, kinds), mean_lift(parameters, kinds)
        # only what is on the timelines: overall P does not depend on modes, and the estimate is the faster for it
        mine = tuple(k for k in taxonomy.kinds if k.id in self.kinds)
        self._taxonomy = msgspec.structs.replace(taxonomy, kinds=mine, modes=())

    def outcomes(self, values: Mapping[str, float] | None = None, only: Collection[str] = ()) -> dict[str, Outcome]:
        """What the timelines do.

        Args:
            values: of factors that differ from their nominal value.
            only: ids of timelines; all if empty.
        """
        v = self.nominal | dict(values or {})
        model = self.risk(v)
        window = Window(v["window"], v["window"] * v["recurrence"])
        return {
            t.id: outcome(t, _moments(t, window, v.get("severity", SEVERITY)), model, v["gate"])
            for t in self.timelines
            if not only or t.id in only
        }

    def answers(self, values: Mapping[str, float]) -> dict[str, float]:
        """Every output, by id."""
        found = self.outcomes(values, {o.timeline for o in self.outputs})
        return {o.id: o.of(found[o.timeline]) for o in self.outputs}

    def risk(self, values: Mapping[str, float]) -> RiskModel:
        """The risk model of these values of all factors.

        r and J are means over pairs: all r are shifted together, clipped to 0..1, and all J, clipped at 0, with their
        intervals, so that the nominal values give the parameter set itself.
        """
        v, p = values, self.parameters
        if self.model == "independent":
            return IndependentRisk(LogisticExponential(v["a"], v["b"], v["c"]), self._taxonomy)

        def r(x: float) -> float:
            return min(max(x + v["r"] - self._r, 0.0), 1.0)

        def j(x: float) -> float:
            return max(x + v["lift"] - self._lift, 0.0)

        moved = msgspec.structs.replace(
            p,
            a=v["a"],
            b=v["b"],
            c=v["c"],
            kappa=v["kappa"],
            presence=v["presence"],
            correlation=tuple(Pair(x.kinds, r(x.r), r(x.low), r(x.high)) for x in p.correlation),
            cascade=tuple(Link(x.first, x.then, j(x.lift), j(x.low), j(x.high)) for x in p.cascade),
        )
        return CorrelatedRisk(moved, self._taxonomy)


@lru_cache(maxsize=64)
def _moments(timeline: Timeline, window: Window, severity: float) -> tuple[Moment, ...]:
    """Most rows of a Saltelli sample share window and severity with the row before."""
    return trajectory(timeline.of_severity(severity), window)


def _about(p: RiskParameters, kinds: tuple[str, ...]) -> RiskParameters:
    """The parameters of these kinds alone, with every pair and every consecutive link named, if need be with 0."""
    pairs = {frozenset(x.kinds): x for x in p.correlation}
    links = {(x.first, x.then): x for x in p.cascade if x.first in kinds and x.then in kinds}
    for i, kind in enumerate(kinds):
        for other in kinds[:i]:
            pairs.setdefault(frozenset((kind, other)), Pair((other, kind), 0.0, 0.0, 0.0))
        if i:
            links.setdefault((kinds[i - 1], kind), Link(kinds[i - 1], kind, 0.0, 0.0, 0.0))
    mine = tuple(x for names, x in pairs.items() if names <= set(kinds))
    return msgspec.structs.replace(p, correlation=mine, cascade=tuple(links.values()))
