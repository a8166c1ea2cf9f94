"""From hazard to result: hazard, accident mode, scenario, arm, and what is shown of it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, TypeAlias

import msgspec

from foreshock.campaign.ledger import Row
from foreshock.campaign.outcomes import Outcomes
from foreshock.campaign.plan import Plan
from foreshock.campaign.results import ArmResult
from foreshock.session.rates import Rate
from foreshock.taxonomy import builtin_taxonomy

__all__ = ["Trace", "traces_of"]

Verdict: TypeAlias = Literal[
    "reference",
    "fewer accidents",
    "more accidents",
    "no difference shown",
    "accident",
    "no harm",
    "false interventions",
    "not shown",
    "not applicable",
]


class Trace(msgspec.Struct, frozen=True):
    """One line of the traceability table, of runs without faults.

    Attributes:
        hazard: of the mode, with the clauses of the standards.
        mode: code.
        title: of the mode.
        scenario: id; empty where the campaign has none of the mode.
        expect: what the scenario is for; empty likewise.
        arm: id; empty likewise.
        planned: runs of the campaign.
        done: of them, those with a result.
        accidents: runs with the accident.
        interventions: false ones: runs that intervened while the reference's run came to no harm.
        prevented: of the accidents under the reference, those that did not happen here.
        verdict: ``fewer accidents`` and ``more accidents`` are those whose 95% interval of the paired difference leaves
            out 0; ``not shown`` has no run with a result, or no accident under the reference that could be prevented;
            ``not applicable`` is an arm that does not run in the scenario; of a harmless scenario ``no harm``,
            ``false interventions`` or ``accident``.
        key: of a run that shows it; empty for none.
    """

    hazard: str
    mode: str
    title: str
    scenario: str
    expect: str
    arm: str
    planned: int
    done: int
    accidents: Rate | None
    interventions: int
    prevented: Rate | None
    verdict: Verdict
    key: str


def traces_of(plan: Plan, rows: Sequence[Row], results: Sequence[ArmResult]) -> list[Trace]:
    """Every mode of the taxonomy, in its order, with every scenario and arm of the campaign.

    Args:
        plan: of the campaign.
        rows: what was run of it.
        results: of results_of.
    """
    outcomes = Outcomes(plan, rows)
    of_scenario = {(r.scope.name, r.arm): r for r in results if r.scope.kind == "scenario"}
    planned: dict[tuple[str, str], int] = {}
    for case in (c for c in plan.cases if not c.fault):
        planned[case.scenario, case.arm] = planned.get((case.scenario, case.arm), 0) + 1
    mine: dict[tuple[str, str], list[Row]] = {}
    for row in (r for r in rows if not r.fault):
        mine.setdefault((row.scenario, row.arm), []).append(row)
    found = []
    for mode in builtin_taxonomy().modes:
        at = (mode.hazard, mode.code, mode.title)
        scenarios = [s for s in plan.scenarios.values() if s.mode == mode.code]
        if not scenarios:
            found.append(Trace(*at, "", "", "", 0, 0, None, 0, None, "not shown", ""))
        for s in scenarios:
            for arm in plan.spec.arms:
                runs, result = mine.get((s.id, arm.id), []), of_scenario.get((s.id, arm.id))
                n = planned.get((s.id, arm.id), 0)
                false = [r for r in runs if outcomes.false(r)]
                verdict = _verdict(result, len(false), n, outcomes, s.id)
                bad = [r for r in runs if r.accident]
                key = next((r.key for r in (*bad, *false, *runs)), "")
                told = None if result is None else result.accidents
                prevented = None if result is None or result.difference is None else result.prevented
                done = 0 if result is None else result.runs
                found.append(Trace(*at, s.id, s.expect, arm.id, n, done, told, len(false), prevented, verdict, key))
    return found


def _verdict(result: ArmResult | None, false: int, planned: int, outcomes: Outcomes, scenario: str) -> Verdict:
    if not planned:
        return "not applicable"
    if result is None or not result.runs:
        return "not shown"
    if scenario in outcomes.harmless:
        return "accident" if result.accidents.k else "false interventions" if false else "no harm"
    if outcomes.reference is not None and result.arm == outcomes.reference.id:
        return "reference"
    d = result.difference
    if d is None or not d.n:
        return "not shown"
    if d.low > 0.0:
        return "more accidents"
    if d.high < 0.0:
        return "fewer accidents"
    return "no difference shown" if result.prevented.n else "not shown"
