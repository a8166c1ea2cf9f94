"""The calibration report: one HTML file with scores, reliability, fitted parameters, R and J."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib.resources import files
from pathlib import Path

import jinja2
import numpy as np
from matplotlib.figure import Figure

from foreshock._picture import picture
from foreshock.calibration.compare import Bin, Score
from foreshock.risk import RiskParameters

__all__ = ["write_calibration_report"]

COLOURS = ("#8a8a8a", "#d98a00", "#1f6fb2", "#2a9d5c", "#8e44ad")


def write_calibration_report(
    path: Path, parameters: RiskParameters, scores: Sequence[Score], bins: Mapping[str, Sequence[Bin]], n: int
) -> None:
    """Write the report.

    Args:
        path: the HTML file.
        parameters: that were fitted to everything.
        scores: out of fold.
        bins: of the reliability diagram, by model.
        n: number of labelled moments.
    """
    source = files("foreshock").joinpath("data/calibration.html.j2").read_text()
    page = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(
        page.from_string(source).render(
            p=parameters,
            scores=scores,
            n=n,
            reliability=picture(_reliability(bins)),
            correlation=picture(_heat_map(parameters)) if parameters.correlation else "",
        )
    )


def _reliability(bins: Mapping[str, Sequence[Bin]]) -> Figure:
    figure = Figure(figsize=(3.4 * len(bins), 3.7), layout="constrained")
    panels = figure.subplots(1, len(bins), sharex=True, sharey=True, squeeze=False)[0]
    for panel, (name, mine), colour in zip(panels, bins.items(), COLOURS, strict=False):
        x, y = np.array([b.predicted for b in mine]), np.array([b.observed for b in mine])
        error = np.clip([[b.observed - b.low for b in mine], [b.high - b.observed for b in mine]], 0.0, None)
        panel.plot([0, 1], [0, 1], color="#bbbbbb", lw=0.8, ls="--")
        panel.errorbar(x, y, error, fmt="o-", ms=4, lw=1.2, color=colour, ecolor=colour, capsize=2)
        panel.set_title(name, fontsize=9)
        panel.set_xlabel("predicted P")
        panel.grid(alpha=0.25, lw=0.5)
        panel.set_xlim(-0.03, 1.03)
        panel.set_ylim(-0.03, 1.03)
    panels[0].set_ylabel("share that ended in the accident")
    return figure


def _heat_map(p: RiskParameters) -> Figure:
    kinds = sorted({k for pair in p.correlation for k in pair.kinds})
    figure = Figure(figsize=(2.6 + 0.5 * len(kinds), 2.0 + 0.45 * len(kinds)), layout="constrained")
    axes = figure.subplots()
    r = p.matrix(kinds)
    axes.imshow(r, vmin=0.0, vmax=1.0, cmap="Blues")
    for i in range(len(kinds)):
        for j in range(len(kinds)):
            if i != j and r[i, j] > 0.0:
                colour = "white" if r[i, j] > 0.6 else "#1b1b1b"
                axes.text(j, i, f"{r[i, j]:.2f}", ha="center", va="center", fontsize=7, color=colour)
    axes.set_xticks(range(len(kinds)), kinds, rotation=40, ha="right", fontsize=8)
    axes.set_yticks(range(len(kinds)), kinds, fontsize=8)
    axes.set_title("R: correlation of the statistics in nominal runs", fontsize=9)
    return figure
