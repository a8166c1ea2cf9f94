"""Panels with two axes for the report of a campaign, in pixels: Pareto, ROC, precision-recall, reliability."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

import msgspec

from foreshock.campaign.forecast import BINS, bin_of, precision_recall, roc
from foreshock.campaign.ledger import Row
from foreshock.campaign.looks import Look
from foreshock.campaign.outcomes import Outcomes
from foreshock.campaign.plan import Plan
from foreshock.campaign.results import ArmResult, Scope, forecasts, frequency

__all__ = ["Mark", "Panel", "forecast_panels", "front_of", "pareto_panel"]

LEFT, TOP, RIGHT, BOTTOM = 46.0, 24.0, 12.0, 40.0
DASH = "4 3"
SHARES = ((0.0, "0"), (0.25, "0.25"), (0.5, "0.5"), (0.75, "0.75"), (1.0, "1"))


class Mark(msgspec.Struct, frozen=True):
    """A point that leads to a run, with its intervals as bars (x1, y1, x2, y2); a ring if it is on the front.

    label is a text beside it, and how far below its first place.
    """

    x: float
    y: float
    look: Look
    target: str
    text: str
    bars: tuple[tuple[float, float, float, float], ...] = ()
    ring: bool = False
    label: tuple[str, float] | None = None


class Panel(msgspec.Struct, frozen=True):
    """A figure: ticks are places and texts, lines are points, colour and dashes."""

    title: str
    width: float
    height: float
    x_label: str
    y_label: str
    x_ticks: tuple[tuple[float, str], ...]
    y_ticks: tuple[tuple[float, str], ...]
    lines: tuple[tuple[str, str, str], ...]
    marks: tuple[Mark, ...]
    left: float = LEFT
    top: float = TOP
    right: float = RIGHT
    bottom: float = BOTTOM


class _Frame:
    """Maps the unit square onto a panel."""

    def __init__(self, width: float, height: float) -> None:
        self.width, self.height = width, height

    def x(self, share: float) -> float:
        return LEFT + share * (self.width - LEFT - RIGHT)

    def y(self, share: float) -> float:
        return self.height - BOTTOM - share * (self.height - TOP - BOTTOM)

    def line(self, points: Sequence[tuple[float, float]], colour: str, dash: str = DASH) -> tuple[str, str, str]:
        return " ".join(f"{self.x(x):.1f},{self.y(y):.1f}" for x, y in points), colour, dash

    def panel(
        self,
        title: str,
        labels: tuple[str, str],
        lines: Sequence[tuple[str, str, str]],
        marks: Sequence[Mark],
        x_ticks: Sequence[tuple[float, str]] = SHARES,
    ) -> Panel:
        across = tuple((self.x(v), text) for v, text in x_ticks)
        up = tuple((self.y(v), text) for v, text in SHARES)
        return Panel(title, self.width, self.height, *labels, across, up, tuple(lines), tuple(marks))


def front_of(points: Mapping[str, tuple[float, float]]) -> set[str]:
    """Those that no other beats: as good in both, and better in one. Smaller is better."""
    return {
        name
        for name, (x, y) in points.items()
        if not any(u <= x and v <= y and (u, v) != (x, y) for u, v in points.values())
    }


def pareto_panel(
    scope: Scope,
    results: Sequence[ArmResult],
    rows: Sequence[Row],
    plan: Plan,
    looks: Mapping[str, Look],
    size: tuple[float, float],
) -> Panel | None:
    """Accident rate against false interventions per hour, of the arms that act, and of none.

    Arms that ran in only some of the part's scenarios are left out; arms at one place are drawn side by side.

    Args:
        scope: the part.
        results: of it.
        rows: runs of it.
        plan: of the campaign.
        looks: by arm.
        size: width and height.
    """
    kinds = {a.id: a.kind for a in plan.spec.arms}
    most = max((r.scenarios for r in results), default=0)
    known = [
        r
        for r in results
        if r.accidents.n
        and r.scenarios == most
        and (kinds[r.arm] == "none" or (kinds[r.arm] != "shadow" and r.false is not None and r.false.hours > 0.0))
    ]
    if not any(kinds[r.arm] != "none" for r in known):
        return None  # nothing to hold against it
    outcomes = Outcomes(plan, rows)
    at = {r.arm: (r.false.per_hour if r.false is not None else 0.0, r.accidents.k / r.accidents.n) for r in known}
    front = front_of(at)
    highs = [r.false.high for r in known if r.false is not None]
    most_x = math.log10(1.0 + max([1.0, *highs]))

    def across(per_hour: float) -> float:
        return math.log10(1.0 + per_hour) / most_x

    frame = _Frame(*size)
    marks = []
    for k, r in enumerate(known):
        x, y = at[r.arm]
        aside = 7.0 * [at[other.arm] for other in known[:k]].count((x, y))
        at_x = frame.x(across(x)) + aside
        bars = [(at_x, frame.y(r.accidents.low), at_x, frame.y(r.accidents.high))]
        if r.false is not None:
            bars += [(frame.x(across(r.false.low)), frame.y(y), frame.x(across(r.false.high)), frame.y(y))]
        mine = [row for row in rows if row.arm == r.arm]
        shows = [row for row in mine if row.accident] + [row for row in mine if outcomes.false(row)] + mine
        text = f"{r.arm}: accidents {r.accidents}; false interventions per hour {frequency(r.false)}"
        place = at_x, frame.y(y), looks[r.arm], f"r-{shows[0].key}"
        marks.append(Mark(*place, text, tuple(bars), r.arm in front))
    steps = sorted(at[name] for name in front)
    line = frame.line([(across(x), y) for x, y in steps], "#444")
    ticks = [(across(v), f"{v:g}") for v in (0, 1, 10, 100, 1000, 10000) if across(v) <= 1.0]
    labels = ("false interventions per hour", "accident rate")
    return frame.panel(scope.name or "overall", labels, [line] if len(steps) > 1 else [], marks, ticks)


def forecast_panels(
    results: Sequence[ArmResult], rows: Sequence[Row], looks: Mapping[str, Look], size: tuple[float, float]
) -> list[Panel]:
    """ROC, precision-recall and reliability of P of the shadow arms of a part; none where P cannot be judged.

    Args:
        results: of the part.
        rows: its runs.
        looks: by arm.
        size: width and height of a panel.
    """
    told = {r.arm: forecasts([row for row in rows if row.arm == r.arm]) for r in results if r.brier is not None}
    curved = {r.arm: told[r.arm] for r in results if r.discrimination is not None}
    frame = _Frame(*size)
    panels = []
    if curved:
        diagonal = frame.line([(0.0, 0.0), (1.0, 1.0)], "#bbb")
        labels = ("false positive rate", "true positive rate")
        panels.append(_curves(frame, "ROC", labels, curved, looks, roc, [diagonal]))
        n = next(iter(curved.values()))
        base = sum(bool(r.accident) for r in n) / len(n)
        level = frame.line([(0.0, base), (1.0, base)], "#bbb")
        labels = ("recall", "precision")
        panels.append(_curves(frame, "Precision-recall", labels, curved, looks, precision_recall, [level]))
    if told:
        panels.append(_reliability(frame, results, told, looks))
    return panels


def _curves(
    frame: _Frame,
    title: str,
    labels: tuple[str, str],
    told: Mapping[str, Sequence[Row]],
    looks: Mapping[str, Look],
    curve: Callable[[Sequence[float], Sequence[bool]], list[tuple[float, float, float]]],
    lines: Sequence[tuple[str, str, str]],
) -> Panel:
    """A curve per arm: each of its points leads to a run with just this P."""
    drawn, marks = list(lines), []
    for arm, rows in told.items():
        points = curve([r.peak_p or 0.0 for r in rows], [bool(r.accident) for r in rows])
        drawn.append(frame.line([(x, y) for x, y, _ in points], looks[arm].colour, looks[arm].dash))
        keys = {r.peak_p: r.key for r in rows}
        for x, y, t in points:
            if t in keys:
                text = f"{arm}: P ≥ {t:.3f}: {labels[0]} {x:.2f}, {labels[1]} {y:.2f}"
                marks.append(Mark(frame.x(x), frame.y(y), looks[arm], f"r-{keys[t]}", text))
    return frame.panel(title, labels, drawn, marks)


def _reliability(
    frame: _Frame, results: Sequence[ArmResult], told: Mapping[str, Sequence[Row]], looks: Mapping[str, Look]
) -> Panel:
    """Share of accidents against mean P, by bins of P, with the number of runs in each."""
    marks = []
    arms = [r for r in results if r.arm in told]
    for k, result in enumerate(arms):
        for b in result.reliability:
            x, y = frame.x(b.mean), frame.y(b.rate.k / b.rate.n)
            shift = 3.0 * (k - (len(arms) - 1) / 2.0)  # two models' bars beside each other
            inside = [r for r in told[result.arm] if bin_of(r.peak_p or 0.0) == round(b.low * BINS)]
            key = min((abs((r.peak_p or 0.0) - b.mean), r.key) for r in inside)[1]
            bar = (x + shift, frame.y(b.rate.low), x + shift, frame.y(b.rate.high))
            text = f"{result.arm}: P in {b.low:.1f}–{b.high:.1f}, mean {b.mean:.3f}: accidents {b.rate}"
            label = (str(b.rate.n), 12.0 * k)
            marks.append(Mark(x + shift, y, looks[result.arm], f"r-{key}", text, (bar,), False, label))
    diagonal = frame.line([(0.0, 0.0), (1.0, 1.0)], "#bbb")
    return frame.panel("Reliability", ("mean highest P", "share with the accident"), [diagonal], marks)
