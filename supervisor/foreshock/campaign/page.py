"""A campaign as one HTML file: no script, no network; every point in it leads to the command that runs it again."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

import msgspec

from foreshock.campaign.engine import Campaign
from foreshock.campaign.ledger import Row
from foreshock.campaign.results import ArmResult, acted_s, frequency, shown
from foreshock.errors import MissingExtraError

__all__ = ["write_page"]

COLOURS = ("#7a7a7a", "#d98a00", "#1f6fb2", "#2a9d5c", "#8e44ad", "#c0392b", "#16a085", "#7f5539", "#34495e", "#b5179e")


class _Dot(msgspec.Struct, frozen=True):
    """A point of a figure, with a bar through it if low and high are given, in the figure's units; and its target."""

    x: float
    y: float
    colour: str
    target: str
    text: str
    low: float | None = None
    high: float | None = None


def write_page(path: Path, campaign: Campaign, rows: Sequence[Row], results: Sequence[ArmResult]) -> None:
    """Write the report.

    Args:
        path: the HTML file.
        campaign: that it is of.
        rows: its runs.
        results: of results_of.

    Raises:
        MissingExtraError: jinja2 is not installed.
    """
    try:
        import jinja2
    except ImportError as e:
        raise MissingExtraError("report", f"needs {e.name}", "; run: pip install 'foreshock[campaign]'") from e
    spec = campaign.plan.spec
    colours = {a.id: COLOURS[k % len(COLOURS)] for k, a in enumerate(spec.arms)}
    source = files("foreshock").joinpath("data/campaign.html.j2").read_text()
    page = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    page.filters["frequency"] = frequency
    path.write_text(
        page.from_string(source).render(
            spec=spec,
            total=len(campaign.plan.cases),
            command=f"foreshock campaign rerun {shlex.quote(str(campaign.folder))}",
            colours=colours,
            reference=spec.reference_arm,
            rows=rows,
            groups=_groups(rows),
            acted={r.key: acted_s(r, spec.arm(r.arm)) for r in rows},
            failures=[r for r in rows if not r.ok],
            identity=campaign.plan.identity,
            main=shown(results),
            parts=[r for r in results if r.scope.kind in ("scenario", "factor")],
            rates=_rates(shown(results), colours, rows),
            leads=_leads(campaign, rows, colours),
            maps=_maps(rows),
        )
    )


def _groups(rows: Sequence[Row]) -> dict[str, list[Row]]:
    found: dict[str, list[Row]] = {}
    for row in rows:
        found.setdefault(row.scenario, []).append(row)
    return found


def _rates(results: Sequence[ArmResult], colours: dict[str, str], rows: Sequence[Row]) -> dict[str, Any]:
    """Accident rates with their intervals: one line per arm, in blocks for the whole, each mode and each fault."""
    first = {r.mode: r.scenario for r in reversed(rows)}
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
        share = r.accidents.k / r.accidents.n
        target = f"s-{first[r.scope.name]}" if r.scope.kind == "mode" else "runs"
        dots.append(
            _Dot(share, y, colours[r.arm], target, f"{name}, {r.arm}: {r.accidents}", r.accidents.low, r.accidents.high)
        )
    return {"labels": labels, "dots": dots, "height": y + 1.5}


def _leads(campaign: Campaign, rows: Sequence[Row], colours: dict[str, str]) -> dict[str, Any] | None:
    """Lead times, one dot per run, one line per arm."""
    spec = campaign.plan.spec
    reference = spec.reference_arm
    if reference is None:
        return None
    at_s = {
        (r.scenario, r.point, r.replicate, r.fault): r.accident_s
        for r in rows
        if r.arm == reference.id and r.accident_s is not None
    }
    lines = {a.id: k for k, a in enumerate(spec.arms) if a.kind != "none"}
    found = []
    for r in rows:
        t = acted_s(r, spec.arm(r.arm))
        accident_s = at_s.get((r.scenario, r.point, r.replicate, r.fault))
        if t is None or accident_s is None or r.arm not in lines:
            continue
        lead_s = accident_s - t
        jitter = (int(r.key[:4], 16) / 65535.0 - 0.5) * 0.7  # a run lies where it lay
        text = f"{r.scenario}, {r.arm}, seed {r.seed}: {lead_s:.2f} s"
        found.append(_Dot(lead_s, lines[r.arm] + jitter, colours[r.arm], f"r-{r.key}", text))
    if not found:
        return None
    low, high = min(0.0, *(d.x for d in found)), max(0.1, *(d.x for d in found))
    return {"dots": found, "labels": [(k, arm) for arm, k in lines.items()], "low": low, "high": high}


def _maps(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """Of each scenario a map: a line per arm, a column per seed, point and fault, a square per run."""
    maps = []
    for scenario, mine in _groups(rows).items():
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
