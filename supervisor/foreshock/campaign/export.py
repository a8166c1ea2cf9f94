"""Runs and results as Parquet files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import msgspec

from foreshock.campaign.forecast import precision_recall, roc
from foreshock.campaign.ledger import Row
from foreshock.campaign.outcomes import Outcomes
from foreshock.campaign.ranking import Duel
from foreshock.campaign.results import ArmResult, forecasts, scopes_of
from foreshock.campaign.trace import Trace
from foreshock.errors import MissingExtraError
from foreshock.session.rates import Rate

__all__ = ["flat_duel", "flat_forecasts", "flat_result", "flat_row", "flat_trace", "write_parquet"]


def flat_row(row: Row, outcomes: Outcomes) -> dict[str, Any]:
    """A run as one level of columns: ``parameter.<name>`` and ``first_s.<kind>`` for what is a table.

    Beside the ledger's columns stands what the run counts as: ``intervened_s``, ``lead_s``, ``safe_after_s`` (infinite:
    not reached), ``false_intervention`` and ``reduced_share``.
    """
    tables = {"parameter": row.parameters, "first_s": row.first_s}
    flat = {k: v for k, v in msgspec.to_builtins(row).items() if k not in ("parameters", "first_s", "log")}
    flat |= {
        "intervened_s": outcomes.acted_s(row),
        "lead_s": outcomes.lead_s(row),
        "safe_after_s": outcomes.safe_after_s(row),
        "false_intervention": outcomes.false(row),
        "reduced_share": outcomes.reduced(row),
    }
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
        flat |= {"lead_s.n": len(result.lead_s)}
        flat |= dict(zip(("lead_s.q1", "lead_s.median", "lead_s.q3"), lead, strict=True))
    if result.false is not None:
        flat |= {f"false.{k}": getattr(result.false, k) for k in ("k", "hours", "per_hour", "low", "high")}
        flat |= _flat_rate("false_runs", result.disturbed)
    if result.safe is not None and (quartiles := result.safe.quartiles_s) is not None:
        flat |= dict(zip(("safe_s.q1", "safe_s.median", "safe_s.q3"), quartiles, strict=True))
        flat |= {"safe_s.n": len(result.safe.values_s), "safe_s.reached": result.safe.reached}
    if result.reduced is not None:
        flat |= {f"reduced.{k}": v for k, v in msgspec.to_builtins(result.reduced).items()}
    if result.brier is not None:
        flat |= {f"brier.{k}": v for k, v in msgspec.to_builtins(result.brier).items()}
    if result.discrimination is not None:
        told = msgspec.to_builtins(result.discrimination)
        difference = told.pop("difference") or {}
        flat |= {f"discrimination.{k}": v for k, v in told.items()}
        flat |= {f"discrimination.difference.{k}": v for k, v in difference.items()}
    return flat


def flat_forecasts(results: Sequence[ArmResult], rows: Sequence[Row]) -> list[dict[str, Any]]:
    """Points of the curves of P: ``figure`` is roc, precision-recall or reliability; x and y are what its axes show."""
    belongs = dict(scopes_of(rows))
    found: list[dict[str, Any]] = []
    for r in results:
        at = {"scope": r.scope.kind, "name": r.scope.name, "arm": r.arm}
        if r.discrimination is not None:
            told = forecasts([row for row in rows if row.arm == r.arm and belongs[r.scope](row)])
            p, happened = [row.peak_p or 0.0 for row in told], [bool(row.accident) for row in told]
            for figure, curve in (("roc", roc), ("precision-recall", precision_recall)):
                found += [at | {"figure": figure, "x": x, "y": y, "threshold": t} for x, y, t in curve(p, happened)]
        for b in r.reliability:
            rate = {"k": b.rate.k, "n": b.rate.n, "low": b.rate.low, "high": b.rate.high}
            found.append(at | {"figure": "reliability", "x": b.mean, "y": b.rate.k / b.rate.n} | rate)
    return found


def flat_trace(trace: Trace) -> dict[str, Any]:
    """A line of the traceability table as one level of columns."""
    flat = {k: v for k, v in msgspec.to_builtins(trace).items() if k not in ("accidents", "prevented")}
    for name, rate in (("accidents", trace.accidents), ("prevented", trace.prevented)):
        flat |= _flat_rate(name, rate) if rate is not None else {}
    return flat


def flat_duel(duel: Duel) -> dict[str, Any]:
    """A duel as one level of columns."""
    flat = msgspec.to_builtins(duel)
    scope = flat.pop("scope")
    return {"scope": scope["kind"], "name": scope["name"], **flat, "verdict": duel.verdict}


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
