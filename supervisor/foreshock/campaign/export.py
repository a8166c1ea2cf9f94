"""Runs and results as Parquet files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import msgspec

from foreshock.campaign.ledger import Row
from foreshock.campaign.results import ArmResult
from foreshock.errors import MissingExtraError
from foreshock.session.rates import Rate

__all__ = ["flat_result", "flat_row", "write_parquet"]


def flat_row(row: Row) -> dict[str, Any]:
    """A run as one level of columns: ``parameter.<name>`` and ``first_s.<kind>`` for what is a table."""
    tables = {"parameter": row.parameters, "first_s": row.first_s}
    flat = {k: v for k, v in msgspec.to_builtins(row).items() if k not in ("parameters", "first_s", "log")}
    return flat | {f"{name}.{k}": v for name, table in tables.items() for k, v in table.items()}


def flat_result(result: ArmResult) -> dict[str, Any]:
    """A result as one level of columns."""
    flat: dict[str, Any] = {
        "scope": result.scope.kind,
        "name": result.scope.name,
        "arm": result.arm,
        "runs": result.runs,
        "failures": result.failures,
        "harmed": result.harmed,
        "caused": result.caused,
    }
    for name, rate in (("accidents", result.accidents), ("prevented", result.prevented)):
        flat |= _flat_rate(name, rate)
    if result.difference is not None:
        flat |= {f"difference.{k}": v for k, v in msgspec.to_builtins(result.difference).items()}
    if (lead := result.lead_quartiles_s) is not None:
        flat |= dict(zip(("lead_s.q1", "lead_s.median", "lead_s.q3"), lead, strict=True))
    if result.false is not None:
        flat |= {f"false.{k}": getattr(result.false, k) for k in ("k", "hours", "per_hour", "low", "high")}
    if result.brier is not None:
        flat |= {f"brier.{k}": v for k, v in msgspec.to_builtins(result.brier).items()}
    return flat


def _flat_rate(name: str, rate: Rate) -> dict[str, Any]:
    return {f"{name}.{k}": getattr(rate, k) for k in ("k", "n", "low", "high")}


def write_parquet(path: Path, rows: Sequence[dict[str, Any]], metadata: dict[str, str]) -> None:
    """Write rows; a column that a row lacks is null there.

    Raises:
        MissingExtraError: pyarrow is not installed.
    """
    try:
        import pyarrow as pa
        from pyarrow import parquet
    except ImportError as e:
        raise MissingExtraError("Parquet", f"needs {e.name}", "; run: pip install 'foreshock[campaign]'") from e
    names = list(dict.fromkeys(k for row in rows for k in row))
    table = pa.table({k: [row.get(k) for row in rows] for k in names})
    parquet.write_table(table.replace_schema_metadata(metadata), path)
