"""The pictures of a report on events, drawn by matplotlib without a display."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize, TwoSlopeNorm
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from numpy.typing import NDArray

from foreshock.events.analyse import Analysis
from foreshock.events.association import Association
from foreshock.events.pairs import Matrix
from foreshock.events.synthetic import OVERLAP

__all__ = ["association_figure", "matrix_figure", "overlap_figure"]

RATE, COUNT, LIFT = "Blues", "Greens", "RdBu_r"
CELL, FRAME, GREY = 0.27, "#c0392b", "#8a8a8a"
"""Inches per cell; colour of the frame around what the paper ties, and of lines."""


def _figure(width: float, height: float, title: str, synthetic: bool) -> tuple[Figure, Axes]:
    figure = Figure(figsize=(width, height), layout="constrained")
    axes = figure.subplots()
    axes.set_title(f"{title}{'  (SYNTHETIC)' if synthetic else ''}", loc="left", fontsize=11, fontweight="bold")
    return figure, axes


def _cells(
    axes: Axes,
    values: NDArray[np.float64],
    rows: Sequence[str],
    columns: Sequence[str],
    colours: str,
    norm: Normalize,
    text: Sequence[Sequence[str]],
    size: float = 6.5,
) -> None:
    """A heat map with a number in each cell; NaN stays empty."""
    grid = [np.arange(len(names) + 1) - 0.5 for names in (columns, rows)]
    picture = axes.pcolormesh(*grid, values, cmap=colours, norm=norm, edgecolors="white", lw=0.5)
    axes.invert_yaxis()
    axes.set_xticks(range(len(columns)), columns, rotation=90, fontsize=8)
    axes.set_yticks(range(len(rows)), rows, fontsize=8)
    axes.tick_params(length=0)
    axes.spines[:].set_visible(False)
    axes.set_facecolor("#f4f4f1")
    for i, line in enumerate(text):
        for j, word in enumerate(line):
            if word:
                r, g, b, _ = picture.cmap(norm(values[i, j]))
                dark = 0.299 * r + 0.587 * g + 0.114 * b < 0.55
                axes.text(j, i, word, ha="center", va="center", fontsize=size, color="white" if dark else "#222222")


def association_figure(a: Association, titles: dict[str, str], which: str, synthetic: bool) -> Figure:
    """P(name | outcome) or P(outcome | name) in percent; frames mark what the paper ties.

    Args:
        a: of classes, or of kinds.
        titles: of outcomes and names.
        which: ``given_outcome`` or ``given_name``.
        synthetic: whether any event is.
    """
    rates = [t.given_outcome if which == "given_outcome" else t.given_name for t in a.ties]
    flat = [r.k / r.n if r.n else math.nan for r in rates]
    values = np.array(flat).reshape(len(a.outcomes), len(a.names)).T
    text = [["" if math.isnan(v) or v == 0 else f"{100 * v:.0f}" for v in line] for line in values]
    large = len(a.names) <= 12
    width, height = (8.6, 3.4) if large else (9.6, 1.9 + CELL * len(a.names))
    what = "outcome" if which == "given_outcome" else "precursor"
    given = f"P({'precursor' if what == 'outcome' else 'outcome'} | {what}) in %"
    figure, axes = _figure(width, height, given, synthetic)
    outcomes = [f"{o} {titles.get(o, '')}".strip() for o in a.outcomes]
    names = [titles.get(n, n) for n in a.names]
    _cells(axes, values, names, outcomes, RATE, Normalize(0, 1), text, 8.5 if large else 7)
    for k, tie in enumerate(a.ties):
        if tie.tied:
            o, n = divmod(k, len(a.names))
            axes.add_patch(Rectangle((o - 0.5, n - 0.5), 1, 1, fill=False, ec=FRAME, lw=1.6, zorder=3))
    return figure


def matrix_figure(
    m: Matrix, title: str, titles: dict[str, str], synthetic: bool, breaks: Sequence[int] = (), *, ratio: bool = False
) -> Figure:
    """Kinds against kinds: counts, or a ratio around 1 on a logarithmic scale of colour.

    Args:
        m: what to draw.
        title: of the picture.
        titles: of kinds.
        synthetic: whether any event is.
        breaks: indices at which a class begins, where a line is drawn.
        ratio: whether values are ratios.
    """
    n = len(m.names)
    values = np.array([[math.nan if v is None else v for v in row] for row in m.values], float).reshape(n, n)
    size = 3.2 + CELL * n
    figure, axes = _figure(size, size - 0.4, title, synthetic)
    names = [titles.get(k, k) for k in m.names]
    for at in breaks:
        axes.axhline(at - 0.5, color=GREY, lw=0.9)
        axes.axvline(at - 0.5, color=GREY, lw=0.9)
    if ratio:
        np.fill_diagonal(values, math.nan)
        shown = np.log2(np.where(values > 0, values, math.nan))
        text = [["" if math.isnan(v) or v == 0 else f"{v:.1f}" if v < 10 else f"{v:.0f}" for v in r] for r in values]
        _cells(axes, shown, names, names, LIFT, TwoSlopeNorm(0, -4, 4), text, 6)
        return figure
    most = float(np.nanmax(values[~np.eye(n, dtype=bool)])) if n > 1 else 1.0
    text = [["" if not v else f"{v:.0f}" for v in row] for row in values]
    _cells(axes, np.where(values > 0, values, math.nan), names, names, COUNT, Normalize(0, max(most, 1.0)), text, 7)
    return figure


def overlap_figure(a: Analysis) -> Figure:
    """Share of accidents with two precursors within a window, over its length, with 95% intervals."""
    figure, axes = _figure(8.6, 3.3, "Accidents with two or more precursors within a window", a.synthetic > 0)
    w = [p.window_s for p in a.overlap]
    for label, colour, rates in (
        ("both present within it", "#1f6fb2", [p.present for p in a.overlap]),
        ("both begin within it", "#d98a00", [p.begun for p in a.overlap]),
    ):
        if not rates or not rates[0].n:
            continue
        axes.plot(w, [100 * r.k / r.n for r in rates], color=colour, lw=1.8, marker="o", ms=3.5, label=label)
        axes.fill_between(
            w, [100 * r.low for r in rates], [100 * r.high for r in rates], color=colour, alpha=0.15, lw=0
        )
    axes.axhline(100 * OVERLAP, color=GREY, lw=1, ls="--", label=f"paper: {OVERLAP:.0%}")
    axes.set_xlabel("length of the window (s)")
    axes.set_ylabel("accidents (%)")
    axes.set_ylim(0, 100)
    axes.grid(alpha=0.25, lw=0.5)
    axes.legend(frameon=False, loc="lower right", fontsize=9)
    return figure
