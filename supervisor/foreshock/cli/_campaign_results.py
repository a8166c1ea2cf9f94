"""How the results of a campaign, and of a comparison, are printed."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from foreshock.campaign.compare import Change, Comparison
from foreshock.campaign.export import flat_result
from foreshock.campaign.results import ArmResult, frequency, shown
from foreshock.campaign.spec import CampaignSpec
from foreshock.cli.output import console, notes, table

__all__ = ["print_changes", "print_limits", "print_results", "results_json"]


def results_json(results: Sequence[ArmResult]) -> list[dict[str, Any]]:
    """Results as one level of keys, as in results.parquet."""
    return [flat_result(r) for r in results]


def print_results(spec: CampaignSpec, results: Sequence[ArmResult]) -> None:
    """The table of arms, overall and per mode; of the campaign's metrics those that fit a line, the report has all."""
    columns = {
        "accidents": ("accidents",),
        "difference": ("difference", "p"),
        "prevented": ("prevented", "caused"),
        "lead-time": ("lead (s)",),
        "false-interventions": ("false/h",),
        "reduced-speed": ("slow",),
        "brier": ("Brier",),
        "failures": ("no result",),
    }
    wanted = [c for metric in spec.metrics for c in columns.get(metric, ())]
    printed = [(r, _cells(r)) for r in shown(results)]
    # a column that says nothing takes the room of one that does
    wanted = [c for c in wanted if any(cells[c] not in ("–", "0") for _, cells in printed)]
    rows = [(r.scope.name or "overall", r.arm, *(cells[c] for c in wanted)) for r, cells in printed]
    reference = spec.reference_arm
    against = f", paired with {reference.id}" if reference is not None else ""
    table(f"{spec.id}: 95% intervals{against}", "part", "arm", *wanted, rows=rows, right=tuple(wanted))


def _cells(r: ArmResult) -> Mapping[str, str]:
    d, lead = r.difference, r.lead_quartiles_s
    told = d is not None and d.n > 0
    return {
        "accidents": str(r.accidents),
        "difference": f"{100 * d.difference:+.0f} ({100 * d.low:+.0f}..{100 * d.high:+.0f})" if d and told else "–",
        "p": f"{d.p:.2g}" if d and told else "–",
        "prevented": f"{r.prevented.k}/{r.prevented.n}" if d is not None else "–",
        "caused": str(r.caused) if d is not None else "–",
        "lead (s)": f"{lead[1]:.2f}" if lead is not None else "–",
        "false/h": frequency(r.false),
        "slow": f"{100 * r.reduced.share:.0f}%" if r.reduced is not None else "–",
        "Brier": f"{r.brier.score:.3f}" if r.brier is not None else "–",
        "no result": str(r.failures),
    }


def print_changes(changes: Sequence[Change]) -> None:
    """What differs, worst first, and how much was compared."""
    same = sum(c.p >= 1.0 and not c.worse for c in changes)
    console.print(
        f"{len(changes)} results compared, {len(changes) - same} with any sign of getting worse", markup=False
    )
    rows = [
        (
            c.scope.name or "overall",
            c.arm,
            c.metric,
            *(_value(c, v) for v in (c.before, c.after)),
            f"{c.n}{' pairs' if c.paired else ''}",
            f"{c.p:.2g}",
            "worse" if c.worse else "",
        )
        for c in sorted(changes, key=lambda c: c.p)
        if c.p < 1.0
    ]
    columns = ("part", "arm", "metric", "before", "after", "runs", "p", "")
    if rows:
        table(
            "Second against first; p one-sided, adjusted by Holm", *columns, rows=rows, right=("before", "after", "p")
        )


def print_limits(found: Comparison, extent: Sequence[Mapping[str, Any]]) -> None:
    """Say what was not compared, what is missing, and what else differs."""
    lines = [f"{e['folder']}: {e['done']} of {e['planned']} runs are there" for e in extent if e["done"] < e["planned"]]
    lines += [f"not compared: {name} {', '.join(ids)}" for name, ids in found.not_compared.items() if ids]
    lines += [
        f"the second lacks {m.runs} runs of the first: {', '.join(filter(None, (m.scenario, m.arm, m.fault)))}"
        for m in found.missing
    ]
    lines += [f"differs: {line}" for line in found.differs]
    for line in lines:
        notes.print(line, markup=False, soft_wrap=True)


def _value(change: Change, value: float) -> str:
    if math.isnan(value):
        return "–"
    return f"{value:.2f} s" if change.metric == "lead-time" else f"{100 * value:.1f}%"
