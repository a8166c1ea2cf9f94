"""The calibration report: one HTML file with scores, reliability, fitted parameters, their profiles, R and J."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib.resources import files
from pathlib import Path

import jinja2
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from foreshock._picture import picture
from foreshock.calibration.compare import Bin, Score
from foreshock.calibration.profile import Profile
from foreshock.risk import RiskParameters

__all__ = ["write_calibration_report"]

COLOURS = ("#8a8a8a", "#d98a00", "#1f6fb2", "#2a9d5c", "#8e44ad")


def write_calibration_report(
    path: Path,
    parameters: RiskParameters,
    scores: Sequence[Score],
    bins: Mapping[str, Sequence[Bin]],
    n: int,
    profiles: Sequence[Profile] = (),
) -> None:
    """Write the report.

    Args:
        path: the HTML file.
        parameters: that were fitted to everything.
        scores: out of fold.
        bins: of the reliability diagram, by model.
        n: number of labelled moments.
        profiles: of what was fitted by profile likelihood.
    """
    source = files("foreshock").joinpath("data/calibration.html.j2").read_text()
    page = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(
        page.from_string(source).render(
            p=parameters,
            scores=scores,
            n=n,
            profiles=profiles,
            reliability=picture(_reliability(bins)),
            curves=picture(_curves(profiles)) if profiles else "",
            correlation=picture(_correlation(parameters)) if parameters.correlation else "",
            cascade=picture(_cascade(parameters)) if parameters.cascade else "",
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


LABELS = {"window_s": "window in s", "rho": "rho, the scale of R", "presence": "presence"}


def _curves(profiles: Sequence[Profile]) -> Figure:
    """D over each scalar: its interval is where the curve lies below the line."""
    figure = Figure(figsize=(3.7 * len(profiles), 3.3), layout="constrained")
    panels = figure.subplots(1, len(profiles), squeeze=False)[0]
    for panel, p in zip(panels, profiles, strict=True):
        x, y = np.array(p.curve).T
        panel.axvspan(p.low, p.high, color="#1f6fb2", alpha=0.13, lw=0)
        panel.axhline(p.limit, color="#8a8a8a", lw=0.9, ls="--")
        panel.axvline(p.best, color="#1f6fb2", lw=0.9)
        panel.plot(x, y, "o-", ms=3, lw=1.2, color="#1f6fb2")
        panel.set_ylim(-0.25 * p.limit, 4.0 * p.limit)
        margin = 0.03 * (x[-1] - x[0])
        panel.set_xlim(x[0] - margin, x[-1] + margin)
        panel.set_xlabel(LABELS[p.name])
        panel.set_title(f"{p.best:.2f}  ({p.low:.2f} to {p.high:.2f})", fontsize=9)
        panel.grid(alpha=0.25, lw=0.5)
    panels[0].set_ylabel("D: loss above the least")
    return figure


def _correlation(p: RiskParameters) -> Figure:
    kinds = sorted({k for pair in p.correlation for k in pair.kinds})
    return _heat_map(
        p.matrix(kinds), kinds, "Blues", 1.0, "R: correlation of the statistics in nominal runs, times rho"
    )


def _cascade(p: RiskParameters) -> Figure:
    kinds = sorted({k for link in p.cascade for k in (link.first, link.then)})
    j = np.zeros((len(kinds), len(kinds)))
    for link in p.cascade:
        j[kinds.index(link.first), kinds.index(link.then)] = link.lift
    return _heat_map(j, kinds, "Oranges", max(1.0, float(j.max())), "J: lift of the row's kind before the column's")


def _heat_map(values: NDArray[np.float64], kinds: Sequence[str], colours: str, most: float, title: str) -> Figure:
    """A number in each cell off the diagonal that is not 0."""
    n = len(kinds)
    figure = Figure(figsize=(2.6 + 0.5 * n, 2.2 + 0.45 * n), layout="constrained")
    axes = figure.subplots()
    shown = values.copy()
    np.fill_diagonal(shown, np.nan)
    axes.imshow(shown, vmin=0.0, vmax=most, cmap=colours)
    axes.set_facecolor("#ececea")
    size = 7.5 if n <= 12 else 5.5
    for i in range(n):
        for j in range(n):
            if i != j and values[i, j] >= 0.005:
                colour = "white" if values[i, j] > 0.6 * most else "#1b1b1b"
                axes.text(j, i, f"{values[i, j]:.2f}", ha="center", va="center", fontsize=size, color=colour)
    axes.set_xticks(range(n), kinds, rotation=40, ha="right", rotation_mode="anchor", fontsize=8)
    axes.set_yticks(range(n), kinds, fontsize=8)
    axes.tick_params(length=0)
    axes.spines[:].set_visible(False)
    figure.suptitle(title, fontsize=9)
    return figure
