"""A campaign as one HTML file: no script, no network; every point in it leads to the command that runs it again."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

from foreshock.campaign.engine import Campaign
from foreshock.campaign.fault_effects import fault_effects
from foreshock.campaign.figures import groups_of, lead_figure, maps_of, rate_figure
from foreshock.campaign.ledger import Row
from foreshock.campaign.looks import Look, looks_of
from foreshock.campaign.outcomes import Outcomes
from foreshock.campaign.panels import Panel, forecast_panels, pareto_panel
from foreshock.campaign.ranking import Duel, Standing
from foreshock.campaign.results import ArmResult, frequency, scopes_of, shown
from foreshock.campaign.trace import Trace
from foreshock.campaign.verdicts import bouts, duration, worth_telling
from foreshock.errors import MissingExtraError

__all__ = ["write_page"]

LARGE, SMALL = (400.0, 320.0), (290.0, 230.0)


def write_page(
    path: Path,
    campaign: Campaign,
    rows: Sequence[Row],
    results: Sequence[ArmResult],
    traces: Sequence[Trace],
    ranking: tuple[Sequence[Standing], Sequence[Duel]],
) -> None:
    """Write the report.

    Args:
        path: the HTML file.
        campaign: that it is of.
        rows: its runs.
        results: of results_of.
        traces: of traces_of.
        ranking: of standings_of and duels_of.

    Raises:
        MissingExtraError: jinja2, matplotlib or scikit-learn is not installed.
    """
    try:
        import jinja2
    except ImportError as e:
        raise MissingExtraError("report", f"needs {e.name}", "; run: pip install 'foreshock[campaign]'") from e
    plan, spec = campaign.plan, campaign.plan.spec
    looks = looks_of(a.id for a in spec.arms)
    outcomes = Outcomes(plan, rows)
    source = files("foreshock").joinpath("data/campaign.html.j2").read_text()
    page = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    page.filters |= {"frequency": frequency, "duration": duration}
    main = shown(results)
    path.write_text(
        page.from_string(source).render(
            spec=spec,
            total=len(plan.cases),
            command=f"foreshock campaign rerun {shlex.quote(str(campaign.folder))}",
            looks=looks,
            reference=spec.reference_arm,
            rows=rows,
            groups=groups_of(rows),
            acted={r.key: outcomes.acted_s(r) for r in rows},
            failures=[r for r in rows if not r.ok],
            identity=plan.identity,
            whole=[r for r in main if r.scope == main[0].scope],
            rest=[r for r in main if r.scope != main[0].scope],
            acting={a.id for a in spec.arms if a.acts},
            faults=fault_effects(plan, rows),
            parts=[r for r in results if r.scope.kind in ("scenario", "factor")],
            partial=_partial(results),
            rates=rate_figure(main, looks, rows),
            leads=lead_figure(plan, rows, results, looks),
            maps=maps_of(rows),
            traces=_matrix(traces),
            untested=[t for t in traces if not t.scenario],
            standings=worth_telling(ranking[0]),
            bouts=worth_telling(bouts(ranking[1], results)),
            **_panels(campaign, rows, main, looks),
        )
    )


def _partial(results: Sequence[ArmResult]) -> dict[str, int]:
    """Arms that ran in only some of the scenarios, and in how many."""
    whole = {r.arm: r.scenarios for r in results if r.scope.kind == "overall"}
    most = max(whole.values(), default=0)
    return {arm: n for arm, n in whole.items() if n < most}


def _matrix(traces: Sequence[Trace]) -> list[tuple[str, str, str, dict[str, list[Trace]]]]:
    """Of the modes that have scenarios: code, title, hazard, and of each scenario the arms."""
    modes: dict[str, tuple[str, str, str, dict[str, list[Trace]]]] = {}
    for t in traces:
        if t.scenario:
            scenarios = modes.setdefault(t.mode, (t.mode, t.title, t.hazard, {}))[3]
            scenarios.setdefault(t.scenario, []).append(t)
    return list(modes.values())


def _panels(
    campaign: Campaign, rows: Sequence[Row], main: Sequence[ArmResult], looks: dict[str, Look]
) -> dict[str, Any]:
    """Pareto and forecast panels: large ones of the first part, small ones of the modes."""
    pareto: list[Panel] = []
    forecast: list[tuple[str, list[ArmResult], list[Panel]]] = []
    belongs = dict(scopes_of(rows))
    parts = [s for s in dict.fromkeys(r.scope for r in main) if s.kind != "fault"]
    for k, scope in enumerate(parts):
        mine = [r for r in main if r.scope == scope]
        runs = [r for r in rows if belongs[scope](r)]
        size = SMALL if k else LARGE
        if (panel := pareto_panel(scope, mine, runs, campaign.plan, looks, size)) is not None:
            pareto.append(panel)
        if panels := forecast_panels(mine, runs, looks, size):
            forecast.append((scope.name or "overall", [r for r in mine if r.brier is not None], panels))
    return {"pareto": pareto, "forecast": forecast}
