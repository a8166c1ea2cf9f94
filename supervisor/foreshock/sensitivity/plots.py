"""The pictures of a sensitivity analysis."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure

from foreshock.sensitivity.local import Perturbed
from foreshock.sensitivity.sobol import Index

__all__ = ["sobol_figure", "tornado_figure"]

FIRST, TOTAL, LOW, HIGH = "#1f6fb2", "#c9d9e8", "#d98a00", "#1f6fb2"


def tornado_figure(found: Sequence[Perturbed]) -> Figure:
    """Change of P at each precursor, by perturbation."""
    base, rest = found[0], found[1:]
    figure = Figure(figsize=(11.0, 0.36 * len(rest) + 1.4), layout="constrained")
    panels = figure.subplots(1, 3, sharey=True)
    for panel, field, title in zip(panels, ("p_first", "p_second", "p_third"), ("one", "two", "three"), strict=True):
        start = getattr(base.outcome, field)
        change = np.array([getattr(p.outcome, field) - start for p in rest])
        panel.barh(range(len(rest)), change, color=[LOW if c < 0.0 else HIGH for c in change])
        panel.axvline(0.0, color="#333333", lw=0.8)
        panel.set_title(f"P with {title} of the cascade: {start:.2f}", fontsize=10)
        panel.set_xlabel("change of P")
        panel.grid(axis="x", alpha=0.3, lw=0.5)
    panels[0].set_yticks(range(len(rest)), [f"{p.name} = {p.value:g}" for p in rest], fontsize=9)
    panels[0].invert_yaxis()
    return figure


def sobol_figure(indices: Mapping[str, Sequence[Index]]) -> Figure:
    """First-order and total indices of each output, with 95% intervals."""
    figure = Figure(figsize=(3.6 * len(indices), 4.0), layout="constrained")
    panels = figure.subplots(1, len(indices), sharey=True, squeeze=False)[0]
    for panel, (title, mine) in zip(panels, indices.items(), strict=True):
        y = np.arange(len(mine))
        panel.barh(y + 0.2, [i.total for i in mine], 0.4, color=TOTAL, xerr=[i.total_half for i in mine], label="total")
        panel.barh(y - 0.2, [i.first for i in mine], 0.4, color=FIRST, xerr=[i.first_half for i in mine], label="first")
        panel.set_title(title, fontsize=10)
        panel.set_xlim(-0.2, 1.05)
        panel.grid(axis="x", alpha=0.3, lw=0.5)
        panel.set_xlabel("share of the variance")
    panels[0].set_yticks(range(len(mine)), [i.name for i in mine], fontsize=9)
    panels[0].invert_yaxis()
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=2, frameon=False)
    return figure
