"""Figures of the report of a campaign that have a line per arm: accident rates, lead times, and the map of all runs."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import msgspec

from foreshock.campaign.ledger import Row
from foreshock.campaign.looks import Look
from foreshock.campaign.outcomes import Outcomes
from foreshock.campaign.plan import Plan
from foreshock.campaign.results import ArmResult, scopes_of

__all__ = ["groups_of", "lead_figure", "maps_of", "rate_figure"]


class _Dot(msgspec.Struct, frozen=True):
    """A point of a figure, with a bar through it if low and high are given, in the figure's units; and its target."""

    x: float
    y: float
    look: Look
    target: str
    text: str
    low: float | None = None
    high: float | None = None


def groups_of(rows: Sequence[Row]) -> dict[str, list[Row]]:
    """Runs by scenario."""
    found: dict[str, list[Row]] = {}
    for row in rows:
        found.setdefault(row.scenario, []).append(row)
    return found


def rate_figure(results: Sequence[ArmResult], looks: Mapping[str, Look], rows: Sequence[Row]) -> dict[str, Any]:
    """Accident rates with their intervals: one line per arm, in blocks for the whole, each mode and each fault.

    A point leads to a run with the accident, or to any run behind it where there is none.
    """
    belongs = dict(scopes_of(rows))
    labels: list[tuple[float, str, str]] = []
    dots: list[_Dot] = []
    y, before = 0.0, None
    for r in results:
        if not r.accidents.n:
            continue
        y += 1.0 if r.scope == before else 1.8
        name = r.scope.name or "overall"
        labels.append((y, r.arm, name if r.scope != before else ""))
        before = r.scope
        mine = [row for row in rows if row.arm == r.arm and belongs[r.scope](row)]
        key = next(row.key for row in (*(row for row in mine if row.accident), *mine))
        share = r.accidents.k / r.accidents.n
        text = f"{name}, {r.arm}: {r.accidents}"
        dots.append(_Dot(share, y, looks[r.arm], f"r-{key}", text, r.accidents.low, r.accidents.high))
    return {"labels": labels, "dots": dots, "height": y + 1.5}


def lead_figure(
    plan: Plan, rows: Sequence[Row], results: Sequence[ArmResult], looks: Mapping[str, Look]
) -> dict[str, Any] | None:
    """Lead times, one dot per run, one line per arm, with the quartiles of the whole; None if there are none."""
    outcomes = Outcomes(plan, rows)
    arms = [a.id for a in plan.spec.arms if a.kind != "none"]
    lines = {arm: k for k, arm in enumerate(arms)}
    found = []
    for r in rows:
        lead_s = outcomes.lead_s(r)
        if lead_s is None or r.arm not in lines or r.fault:
            continue
        jitter = (int(r.key[:4], 16) / 65535.0 - 0.5) * 0.5  # a run lies where it lay
        text = f"{r.scenario}, {r.arm}, seed {r.seed}: {lead_s:.2f} s"
        found.append(_Dot(lead_s, lines[r.arm] + jitter, looks[r.arm], f"r-{r.key}", text))
    if not found:
        return None
    quartiles = {r.arm: r.lead_quartiles_s for r in results if r.scope.kind == "overall" and r.lead_quartiles_s}
    boxes = [(lines[arm], *q) for arm, q in quartiles.items() if arm in lines]
    low, high = min(0.0, *(d.x for d in found)), max(0.1, *(d.x for d in found))
    labels = [(k, arm) for arm, k in lines.items()]
    step = next(s for s in (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, math.inf) if (high - low) / s <= 8.0)
    ticks = [k * step for k in range(math.ceil(low / step), math.floor(high / step) + 1)] if step < math.inf else [0.0]
    figure = {"dots": found, "labels": labels, "low": low, "high": high, "boxes": boxes, "lines": len(lines)}
    return figure | {"ticks": ticks}


def maps_of(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """Of each scenario a map: a line per arm, a column per seed, point and fault, a square per run."""
    maps = []
    for scenario, mine in groups_of(rows).items():
        arms = list(dict.fromkeys(r.arm for r in mine))
        seats = {seat: k for k, seat in enumerate(dict.fromkeys((r.point, r.replicate, r.fault) for r in mine))}
        squares = []
        for r in mine:
            values = ", ".join(f"{k} = {v:.4g}" for k, v in r.parameters.items())
            what = r.outcome if r.ok else f"{r.status}: {r.detail}"
            text = "; ".join(filter(None, (r.arm, f"seed {r.seed}", values, r.fault, what)))
            squares.append((seats[r.point, r.replicate, r.fault], arms.index(r.arm), _fate(r), f"r-{r.key}", text))
        maps.append({"scenario": scenario, "arms": arms, "columns": len(seats), "squares": squares})
    return maps


def _fate(row: Row) -> str:
    if not row.ok:
        return "failed"
    return "accident" if row.accident else "event" if row.event_s is not None else "calm"
