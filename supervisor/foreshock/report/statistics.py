"""Each detector's statistic against its threshold over time: what an integrator tunes by."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import jinja2
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from foreshock._picture import picture

__all__ = ["statistics_figure", "write_statistics"]

PAGE = """<!doctype html>
<html lang="en"><meta charset="utf-8"><title>{{ title }}</title>
<style>body { font: 15px/1.5 system-ui, sans-serif; max-width: 1100px; margin: 2em auto; padding: 0 1em; color: #222 }
img { max-width: 100% } code { background: #f3f3f3; padding: 0 .3em }</style>
<h1>{{ title }}</h1>
{% for note in notes %}<p>{{ note }}</p>
{% endfor %}
<img alt="statistics and thresholds over time" src="{{ figure }}">
</html>
"""


def statistics_figure(series: Mapping[str, Sequence[float]], units: Mapping[str, str]) -> Figure:
    """One panel per kind and subject, in its unit: statistic, threshold, where the kind is present; trust below."""
    names = sorted(k.removeprefix("stat:") for k in series if k.startswith("stat:"))
    figure = Figure(figsize=(11, 1.4 + 1.5 * (len(names) + 1)), layout="constrained")
    panels = figure.subplots(len(names) + 1, 1, sharex=True, squeeze=False)[:, 0]
    t = np.array(series["t_s"])
    for panel, name in zip(panels, names, strict=False):
        present = np.nan_to_num(np.array(series[f"present:{name}"])) > 0.5
        across = panel.get_xaxis_transform()
        panel.fill_between(t, 0, 1, where=present, transform=across, color="#f6c6c0", lw=0, label="present")
        panel.plot(t, series[f"stat:{name}"], lw=0.9, color="#1f6fb2", label="statistic")
        panel.plot(t, series[f"threshold:{name}"], lw=1.0, ls="--", color="#c0392b", label="threshold")
        panel.set_title(name, fontsize=9, loc="left")
        panel.set_ylabel(_unit(units[name]), fontsize=9)
        _legend(panel)
        panel.grid(alpha=0.25, lw=0.5)
    panels[-1].plot(t, series["trust"], lw=1.2, color="#2a9d5c", label="trust")
    panels[-1].plot(t, series["control_trust"], lw=0.9, ls=":", color="#2a9d5c", label="control trust")
    panels[-1].set_ylim(-0.02, 1.05)
    panels[-1].set_ylabel(_unit("1"), fontsize=9)
    panels[-1].set_title("overall", fontsize=9, loc="left")
    _legend(panels[-1])
    panels[-1].set_xlabel("t (s)")
    panels[-1].grid(alpha=0.25, lw=0.5)
    return figure


def _legend(panel: Axes) -> None:
    """Above the panel, where it covers nothing."""
    panel.legend(fontsize=8, loc="lower right", bbox_to_anchor=(1.0, 1.0), borderaxespad=0.0, ncols=3, frameon=False)


def _unit(unit: str) -> str:
    return "dimensionless" if unit == "1" else unit


def write_statistics(
    path: Path,
    title: str,
    series: Mapping[str, Sequence[float]],
    units: Mapping[str, str],
    notes: Sequence[str] = (),
) -> None:
    """Write one HTML file with the figure inside."""
    page = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure = picture(statistics_figure(series, units))
    path.write_text(page.from_string(PAGE).render(title=title, notes=notes, figure=figure))
