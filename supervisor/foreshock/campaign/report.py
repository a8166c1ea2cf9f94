"""Writes what a campaign found into its folder: Parquet files and one HTML page; and its tables as Markdown."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import msgspec

from foreshock.campaign.engine import Campaign
from foreshock.campaign.export import flat_duel, flat_forecasts, flat_result, flat_row, flat_trace, write_parquet
from foreshock.campaign.fault_effects import fault_effects
from foreshock.campaign.outcomes import Outcomes
from foreshock.campaign.page import write_page
from foreshock.campaign.ranking import duels_of, standings_of
from foreshock.campaign.results import ArmResult, results_of
from foreshock.campaign.trace import traces_of
from foreshock.campaign.verdicts import bouts, fault_table, markdown

__all__ = ["ranking_of", "write_results"]


def write_results(campaign: Campaign) -> tuple[list[ArmResult], list[Path]]:
    """Judge what was run so far and write the Parquet files and report.html.

    Returns:
        The results, and the files.

    Raises:
        MissingExtraError: pyarrow, jinja2, scikit-learn or scipy is not installed.
    """
    plan, rows = campaign.plan, campaign.rows()
    results = results_of(plan, rows)
    traces, standings, duels = traces_of(plan, rows, results), standings_of(plan, results), duels_of(plan, rows)
    outcomes = Outcomes(plan, rows)
    metadata = {"campaign": plan.spec.id, "identity": msgspec.json.encode(plan.identity).decode()}
    tables = {
        "runs": [flat_row(r, outcomes) for r in rows],
        "results": [flat_result(r) for r in results],
        "forecasts": flat_forecasts(results, rows),
        "traceability": [flat_trace(t) for t in traces],
        "duels": [flat_duel(d) for d in duels],
    }
    paths = [campaign.folder / f"{name}.parquet" for name in tables]
    for path, table in zip(paths, tables.values(), strict=True):
        write_parquet(path, table, metadata)
    page = campaign.folder / "report.html"
    write_page(page, campaign, rows, results, traces, (standings, duels))
    return results, [*paths, page]


def ranking_of(campaign: Campaign, results: Sequence[ArmResult]) -> str:
    """Which arm wins where, where Foreshock loses, and what each fault does, as Markdown.

    Args:
        campaign: that it is of.
        results: of results_of.
    """
    plan, rows = campaign.plan, campaign.rows()
    total = sum(r.ok for r in rows), len(plan.cases)
    told = markdown(plan, total, standings_of(plan, results), bouts(duels_of(plan, rows), results))
    return told + fault_table(fault_effects(plan, rows))
