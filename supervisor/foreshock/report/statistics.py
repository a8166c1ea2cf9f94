"""Each detector's statistic against its threshold over time: what an integrator tunes by."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import jinja2
import numpy as np
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


def statistics_figure(series: Mapping[str, Sequence[float]]) -> Figure:
    """One panel per kind and subject: statistic, threshold, and where the kind is present; trust below."""
    names = sorted(k.removeprefix("stat:") for k in series if k.startswith("stat:"))
    figure = Figure(figsize=(11, 1.4 + 1.5 * (len(names) + 1)), layout="constrained")
    panels = figure.subplots(len(names) + 1, 1, sharex=True, squeeze=False)[:, 0]
    t = np.array(series["t_s"])
    for panel, name in zip(panels, names, strict=False):
        present = np.nan_to_num(np.array(series[f"present:{name}"])) > 0.5
        panel.fill_between(t, 0, 1, where=present, transform=panel.get_xaxis_transform(), color="#f6c6c0", lw=0)
        panel.plot(t, series[f"stat:{name}"], lw=0.9, color="#1f6fb2")
        panel.plot(t, series[f"threshold:{name}"], lw=1.0, ls="--", color="#c0392b")
        panel.set_title(name, fontsize=9, loc="left")
        panel.grid(alpha=0.25, lw=0.5)
    panels[-1].plot(t, series["trust"], lw=1.2, color="#2a9d5c", label="trust")
    panels[-1].plot(t, series["control_trust"], lw=0.9, ls=":", color="#2a9d5c", label="control trust")
    panels[-1].set_ylim(-0.02, 1.05)
    panels[-1].legend(fontsize=8, loc="lower left")
    panels[-1].set_xlabel("t (s)")
    panels[-1].grid(alpha=0.25, lw=0.5)
    return figure


def write_statistics(path: Path, title: str, series: Mapping[str, Sequence[float]], notes: Sequence[str] = ()) -> None:
    """Write one HTML file with the figure inside."""
    page = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure = picture(statistics_figure(series))
    path.write_text(page.from_string(PAGE).render(title=title, notes=notes, figure=figure))
