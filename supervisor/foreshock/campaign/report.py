"""Writes what a campaign found into its folder: two Parquet files and one HTML page."""

from __future__ import annotations

from pathlib import Path

import msgspec

from foreshock.campaign.engine import Campaign
from foreshock.campaign.export import flat_result, flat_row, write_parquet
from foreshock.campaign.page import write_page
from foreshock.campaign.results import ArmResult, results_of

__all__ = ["write_results"]


def write_results(campaign: Campaign) -> tuple[list[ArmResult], list[Path]]:
    """Judge what was run so far and write runs.parquet, results.parquet and report.html.

    Returns:
        The results, and the files.

    Raises:
        MissingExtraError: pyarrow, jinja2 or scipy is not installed.
    """
    rows = campaign.rows()
    results = results_of(campaign.plan, rows)
    metadata = {"campaign": campaign.plan.spec.id, "identity": msgspec.json.encode(campaign.plan.identity).decode()}
    paths = [campaign.folder / name for name in ("runs.parquet", "results.parquet", "report.html")]
    write_parquet(paths[0], [flat_row(r) for r in rows], metadata)
    write_parquet(paths[1], [flat_result(r) for r in results], metadata)
    write_page(paths[2], campaign, rows, results)
    return results, paths
