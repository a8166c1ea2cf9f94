"""The figures of a report, drawn by matplotlib without a display."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from foreshock.session.run import Run
from foreshock.session.sweep import CellResult

__all__ = ["runs_figure", "sweep_figure"]

RISK, TRUST, CONTROL, COM, CAPTURE, GREY = "#c0392b", "#1f6fb2", "#7fb2dd", "#1b1b1b", "#d98a00", "#8a8a8a"
ARMS = ("#7a7a7a", "#d98a00", "#1f6fb2", "#2a9d5c", "#8e44ad")


def _column(run: Run, *names: str) -> NDArray[np.float64] | None:
    for name in names:
        if name in run.series:
            return np.asarray(run.series[name], float)
    return None


def _span(runs: Sequence[Run]) -> tuple[float, float]:
    """The stretch of time worth showing: around the first precursor and the last event."""
    firsts = [t for r in runs for t in r.first_s.values()]
    ends = [e.stamp_ns / 1e9 for r in runs for e in r.events]
    if not firsts:
        return 0.0, max(r.end_s for r in runs)
    return max(0.0, min(firsts) - 0.6), min(max(r.end_s for r in runs), max([*ends, max(firsts)]) + 1.2)


def runs_figure(runs: Sequence[tuple[str, Run]]) -> Figure:
    """Runs side by side: P and T, centre of mass and capture point in the support, interventions."""
    n = len(runs)
    figure = Figure(figsize=(5.0 * n + 1.0, 8.6), layout="constrained")
    axes = figure.subplots(3, n, sharex=True, sharey="row", squeeze=False, height_ratios=(3, 3, 2))
    low, high = _span([r for _, r in runs])
    axes[0][0].set_ylabel("probability, trust")
    axes[1][0].set_ylabel("lateral position (mm)")
    names = sorted({i.action for _, r in runs for i in r.interventions})
    for k, (label, run) in enumerate(runs):
        _risk(axes[0][k], run)
        _balance(axes[1][k], run)
        _actions(axes[2][k], run, names)
        outcome = run.outcome.replace("-", " ") if run.events else "upright"
        axes[0][k].set_title(f"{label}\n{outcome}", fontweight="bold", color=RISK if run.events else "#2a7d4f")
        axes[2][k].set_xlabel("time (s)")
        axes[2][k].set_xlim(low, high)
        for a in axes[:, k]:
            for e in run.events:
                a.axvline(e.stamp_ns / 1e9, color=RISK, lw=1.4, ls="--")
            for t in run.first_s.values():
                a.axvline(t, color=GREY, lw=0.8, ls=":")
            a.grid(alpha=0.25, lw=0.5)
    keys: dict[str, Artist] = {}
    for a in axes[:2].flat:
        handles, labels = a.get_legend_handles_labels()
        keys |= dict(zip(labels, handles, strict=True))
    figure.legend(list(keys.values()), list(keys), loc="outside lower center", ncols=len(keys), frameon=False)
    return figure


def _risk(a: Axes, run: Run) -> None:
    t = _column(run, "t_s")
    for name, colour, label in (
        ("p", RISK, "P"),
        ("trust", TRUST, "T = 1 − P"),
        ("control_trust", CONTROL, "control-level trust"),
    ):
        y = _column(run, name)
        if t is not None and y is not None:
            a.plot(t, y, color=colour, lw=1.6, label=label)
    for gate, label in ((0.6, "caution"), (0.3, "protective")):
        a.axhline(gate, color=GREY, lw=0.7, ls="--")
        a.annotate(label, (0.995, gate), xycoords=("axes fraction", "data"), ha="right", va="bottom", fontsize=7)
    for k, (kind, at) in enumerate(sorted(run.first_s.items(), key=lambda i: i[1])):
        a.annotate(kind, (at, 1.015 - 0.075 * (k % 4)), fontsize=7, ha="left", va="top", color="#444444")
    a.set_ylim(-0.03, 1.06)


def _balance(a: Axes, run: Run) -> None:
    t = _column(run, "t_s")
    if t is None:
        return
    lower = _column(run, "true:support_min_y", "seen:support_min_y_m")
    upper = _column(run, "true:support_max_y", "seen:support_max_y_m")
    if lower is not None and upper is not None:
        a.fill_between(t, 1e3 * lower, 1e3 * upper, color="#bcd7c2", alpha=0.6, lw=0, label="support polygon")
    for names, colour, label in (
        (("true:com_y", "seen:com_y_m"), COM, "centre of mass"),
        (("true:xi_y", "seen:capture_point_y_m"), CAPTURE, "capture point"),
    ):
        y = _column(run, *names)
        if y is not None:
            a.plot(t, 1e3 * y, color=colour, lw=1.4, label=label)
    a.set_ylim(-420, 420)


def _actions(a: Axes, run: Run, names: Sequence[str]) -> None:
    t = _column(run, "t_s")
    for k, name in enumerate(names):
        strength = _column(run, f"action:{name}")
        if t is None or strength is None:
            continue
        s = np.nan_to_num(strength)
        a.fill_between(t, k - 0.4 * s, k + 0.4 * s, color=TRUST, alpha=0.75, lw=0)
    a.set_yticks(range(len(names)), [n.replace("-", " ") for n in names], fontsize=8)
    a.set_ylim(-0.7, max(len(names), 1) - 0.3)
    if run.supervisor == "shadow" and run.interventions:
        a.set_title("decided, not applied", fontsize=8, color=GREY, loc="right", pad=2)
    if not run.interventions:
        a.text(0.5, 0.5, "no intervention", transform=a.transAxes, ha="center", va="center", color=GREY)


def sweep_figure(results: Sequence[CellResult]) -> Figure:
    """Fall rate per cell and arm with 95% intervals, one panel per factor."""
    factors = list(dict.fromkeys(r.cell.factor for r in results))
    arms = list(dict.fromkeys(r.arm for r in results))
    widths = [len({r.cell.label for r in results if r.cell.factor == f}) + 0.8 for f in factors]
    figure = Figure(figsize=(max(8.0, 1.25 * sum(widths)), 4.2), layout="constrained")
    panels = figure.subplots(1, len(factors), sharey=True, squeeze=False, width_ratios=widths)[0]
    for panel, factor in zip(panels, factors, strict=True):
        labels = list(dict.fromkeys(r.cell.label for r in results if r.cell.factor == factor))
        for k, arm in enumerate(arms):
            mine = {r.cell.label: r for r in results if r.cell.factor == factor and r.arm == arm}
            x = np.arange(len(labels)) + (k - (len(arms) - 1) / 2) * 0.26
            rate = np.array(
                [mine[label].falls.k / mine[label].falls.n if mine[label].falls.n else math.nan for label in labels]
            )
            low = np.array([mine[label].falls.low for label in labels])
            high = np.array([mine[label].falls.high for label in labels])
            panel.bar(x, 100 * rate, 0.24, color=ARMS[k % len(ARMS)], label=arm)
            bars = np.clip(100 * np.vstack([rate - low, high - rate]), 0, None)
            panel.errorbar(x, 100 * rate, bars, fmt="none", ecolor="#333333", lw=0.8, capsize=2)
        panel.set_xticks(range(len(labels)), labels, fontsize=8)
        panel.set_title(factor, fontsize=10)
        panel.grid(axis="y", alpha=0.3, lw=0.5)
    panels[0].set_ylabel("runs that fell (%)")
    panels[0].set_ylim(0, 104)
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=len(arms), fontsize=9)
    return figure
