"""The ranking of arms, and what faults do, in words: for the page, and as Markdown for the docs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TypeVar

import msgspec

from foreshock.campaign.fault_effects import FaultEffect
from foreshock.campaign.plan import Plan
from foreshock.campaign.ranking import Duel, Standing
from foreshock.campaign.results import ArmResult, Scope, frequency

__all__ = ["Bout", "bouts", "duration", "fault_table", "markdown", "worth_telling"]


Part = TypeVar("Part", Standing, "Bout")
# fmt: off
FAULT_COLUMNS = (
    "fault", "arm", "accidents", "without it", "in", "false interventions", "without it", "minimal risk", "no result",
    "shown",
)
# fmt: on


class Bout(msgspec.Struct, frozen=True):
    """An arm that stands for Foreshock in one part: its figures, and what it wins and loses against whom."""

    scope: Scope
    result: ArmResult
    wins: tuple[str, ...]
    loses: tuple[str, ...]


def duration(seconds: float) -> str:
    """A time for people."""
    return f"{seconds:.2f}" if math.isfinite(seconds) else "not reached"


def bouts(duels: Sequence[Duel], results: Sequence[ArmResult]) -> list[Bout]:
    """Wins and losses by part and arm; what is not significant is neither."""
    by = {(r.scope, r.arm): r for r in results}
    found = []
    for scope, arm in dict.fromkeys((d.scope, d.arm) for d in duels):
        mine = [d for d in duels if (d.scope, d.arm) == (scope, arm)]
        found.append(Bout(scope, by[scope, arm], _said(mine, "wins"), _said(mine, "loses")))
    return found


def _said(duels: Sequence[Duel], verdict: str) -> tuple[str, ...]:
    rivals: dict[str, list[str]] = {}
    for d in duels:
        if d.verdict == verdict:
            rivals.setdefault(d.rival, []).append(f"{d.metric} {_figures(d)}")
    return tuple(f"{rival}: {', '.join(found)}" for rival, found in rivals.items())


def _figures(duel: Duel) -> str:
    if duel.metric == "lead time":
        return f"({duel.mine:.2f} against {duel.theirs:.2f} s)"
    return f"({100 * duel.mine:.0f} against {100 * duel.theirs:.0f}%)"


def markdown(plan: Plan, total: tuple[int, int], standings: Sequence[Standing], found: Sequence[Bout]) -> str:
    """Both tables, with what they rest on.

    Args:
        plan: of the campaign.
        total: runs that gave a result, and runs that are planned.
        standings: of standings_of.
        found: of bouts.
    """
    spec = plan.spec
    reference = spec.reference_arm
    lines = [
        f"Campaign `{spec.id}`, seeds from {spec.seed}: {total[0]} of {total[1]} runs gave a result. Reference: "
        f"{f'`{reference.id}`' if reference else 'no arm'}. Brackets are 95% intervals.",
        "",
        "First places by the figures alone, of arms that ran in all scenarios of the part"
        f"{', without faults' if spec.faults else ''}; the last two columns are of arms that decide and act.",
        "",
        "| part | fewest accidents | fewest false interventions per hour | least time at reduced speed, as commanded |",
        "|---|---|---|---|",
    ]
    for s in worth_telling(standings):
        cells = [f"{_names(arms)}: {figure}" if arms else "–" for arms, figure in (s.accidents, s.false, s.reduced)]
        lines.append(f"| {s.scope.name or 'overall'} | {' | '.join(cells)} |")
    lines += [
        "",
        "Arms that act by Foreshock's protection levels against all others, on the same seeds: what is significantly "
        "better or worse at 5%, corrected by Holm for all comparisons.",
        "",
        "| part | Foreshock as | accidents | false per hour | reduced speed, as commanded | better than "
        "| **loses to** |",
        "|---|---|---|---|---|---|---|",
    ]
    for b in worth_telling(found):
        r = b.result
        wins, loses = ("; ".join(x) or "nobody" for x in (b.wins, b.loses))
        cells = [f"`{r.arm}`", str(r.accidents), frequency(r.false), str(r.reduced or "–"), wins, loses]
        lines.append(f"| {b.scope.name or 'overall'} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def fault_table(effects: Sequence[FaultEffect]) -> str:
    """What each fault does, as Markdown; empty of no faults."""
    if not effects:
        return ""
    lines = [
        "",
        "Each fault against the same runs without it: what is significantly worse at 5% (exact McNemar test, corrected "
        "by Holm for all faults). False interventions are runs that intervened although the reference's run came to no "
        "harm; at minimal risk the supervisor noticed the fault and gave up. More accidents: the fault is neither "
        "noticed nor endured. More false interventions alone: it fails closed, at the price of a stop.",
        "",
        f"| {' | '.join(FAULT_COLUMNS)} |",
        "|---" * len(FAULT_COLUMNS) + "|",
    ]
    for e in effects:
        where = "; ".join(f"`{scenario}` {rate.k}/{rate.n}" for scenario, rate in e.where.items()) or "–"
        shown = ", ".join(f"**{x}**" if x == "more accidents" else x for x in e.effects)
        cells = [e.fault, f"`{e.arm}`", str(e.accidents), f"{e.accidents_without.k}/{e.accidents_without.n}", where]
        cells += [str(e.false), f"{e.false_without.k}/{e.false_without.n}", str(e.minimal_risk), str(e.failures), shown]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def worth_telling(found: Sequence[Part]) -> list[Part]:
    """Without the whole where it has only one part."""
    several = len({s.scope for s in found if s.scope.kind == "mode"}) > 1
    return [s for s in found if several or s.scope.kind == "mode"]


def _names(arms: Sequence[str]) -> str:
    return ", ".join(f"`{a}`" for a in arms)
