"""The pictures of a sensitivity analysis, drawn by matplotlib without a display."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from foreshock.sensitivity.local import Perturbed
from foreshock.sensitivity.outcome import Outcome
from foreshock.sensitivity.sobol import Indices
from foreshock.sensitivity.study import Output, Study

__all__ = ["sobol_figure", "timelines_figure", "tornado_figure"]

RISK, BOUND, GREY = "#c0392b", "#e0998f", "#8a8a8a"
BELOW, ABOVE = "#d98a00", "#1f6fb2"
FIRST, TOTAL = "#1f6fb2", "#b9cfe4"
TORNADO = ("p-isolated", "p-third", "gate", "recovery")
GLOBAL = ("p-first", "p-second", "p-third", "gate", "opens", "recovery", "gate-on-p")


def timelines_figure(study: Study, outcomes: Mapping[str, Outcome]) -> Figure:
    """P and its bound over time at the nominal values, one panel a timeline, above the conditions that are present."""
    n = len(study.timelines)
    figure = Figure(figsize=(3.3 * n, 3.9), layout="constrained")
    axes = figure.subplots(2, n, sharex="col", sharey="row", height_ratios=(3.2, 1), squeeze=False)
    gate = study.nominal["gate"]
    for k, timeline in enumerate(study.timelines):
        o, top, bottom = outcomes[timeline.id], axes[0][k], axes[1][k]
        t = [0.0, *(x for x, _, _ in o.steps), o.steps[-1][0] + 0.4]
        p, upper = ([0.0, *(s[i] for s in o.steps), o.steps[-1][i]] for i in (1, 2))
        if study.model == "correlated":
            top.step(t, upper, where="post", color=BOUND, lw=1.4, ls="--", label="upper bound")
        top.step(t, p, where="post", color=RISK, lw=1.8, label="P")
        top.axhline(1.0 - gate, color=GREY, lw=0.8, ls=":")
        top.set_title(timeline.title.replace(", ", ",\n", 1), fontsize=9)
        top.set_ylim(-0.03, 1.05)
        for row, kind in enumerate(study.kinds):
            for e in timeline.episodes:
                if e.kind == kind:
                    bottom.barh(row, e.end_s - e.onset_s, 0.6, e.onset_s, color=GREY)
        bottom.set_ylim(len(study.kinds) - 0.4, -0.6)
        bottom.set_xlabel("time (s)")
        for a in (top, bottom):
            a.grid(alpha=0.25, lw=0.5)
    axes[0][0].set_ylabel("probability")
    axes[0][0].annotate(f"gate: T < {gate:g}", (0.1, 1.0 - gate), ha="left", va="bottom", fontsize=7)
    axes[1][0].set_yticks(range(len(study.kinds)), [k.replace("-", " ") for k in study.kinds], fontsize=7)
    if study.model == "correlated":
        axes[0][1].legend(loc="upper right", fontsize=7, frameon=False)
    return figure


def tornado_figure(study: Study, found: Sequence[Perturbed]) -> Figure:
    """Each output by factor: from its nominal value to that at either step, the widest swing on top."""
    outputs = {o.id: o for o in study.outputs}
    figure = Figure(figsize=(13.0, 0.34 * len(study.factors) + 1.7), layout="constrained")
    for panel, id_ in zip(figure.subplots(1, len(TORNADO)), TORNADO, strict=True):
        _tornado(panel, study, outputs[id_], found)
    return figure


def _tornado(panel: Axes, study: Study, output: Output, found: Sequence[Perturbed]) -> None:
    base = found[0].answers[output.id]
    ends: dict[str, list[tuple[float, float]]] = {f.id: [] for f in study.factors}
    for p in found[1:]:
        ends[p.factor].append((p.answers[output.id] - base, p.value))
    factors = sorted(study.factors, key=lambda f: -max((abs(change) for change, _ in ends[f.id]), default=0.0))
    for y, f in enumerate(factors):
        names: dict[float, list[str]] = {}
        # the widest first: two steps can move a time to the same side
        for change, value in sorted(ends[f.id], key=lambda e: -abs(e[0])):
            panel.barh(y, change, 0.66, base, color=BELOW if value < f.nominal else ABOVE)
            if abs(change) > 1e-9:
                names.setdefault(round(change, 9), []).append(f"{value:.3g}")
        for change, values in names.items():
            side, away = ("left", 3) if change > 0.0 else ("right", -3)
            at = (base + change, y)
            text = ", ".join(values)
            panel.annotate(text, at, (away, 0), textcoords="offset points", ha=side, va="center", fontsize=7)
    changes = [0.0, *(change for mine in ends.values() for change, _ in mine)]
    room = 0.22 * max(max(changes) - min(changes), 0.02)
    panel.set_xlim(base + min(changes) - room, base + max(changes) + room)
    panel.axvline(base, color="#333333", lw=0.9)
    panel.set_yticks(range(len(factors)), [f.symbol for f in factors], fontsize=8)
    panel.set_ylim(len(factors) - 0.4, -0.6)
    panel.tick_params(axis="x", labelsize=8)
    panel.locator_params(axis="x", nbins=5)
    panel.set_title(f"{output.title}: {base:.3g}", fontsize=9)
    panel.grid(axis="x", alpha=0.3, lw=0.5)


def sobol_figure(study: Study, indices: Sequence[Indices]) -> Figure:
    """First-order and total indices of each output with 95% intervals; hollow marks are from half of the samples."""
    by_id = {i.output: i for i in indices}
    titles = {o.id: o.title for o in study.outputs}
    shown = [by_id[id_] for id_ in GLOBAL if id_ in by_id]
    columns = 3 if len(shown) <= 6 else 4
    lines = -(-len(shown) // columns)
    figure = Figure(figsize=(13.0, lines * (0.3 * len(study.factors) + 1.1) + 0.4), layout="constrained")
    axes = figure.subplots(lines, columns, sharey=True, squeeze=False)
    for panel, mine in zip(axes.flat, shown, strict=False):
        panel.set_title(titles[mine.output], fontsize=9)
        panel.tick_params(axis="x", labelsize=8)
        panel.grid(axis="x", alpha=0.3, lw=0.5)
        if not mine.factors:
            panel.text(0.5, 0.5, "does not vary", transform=panel.transAxes, ha="center", va="center", color=GREY)
            continue
        # with few samples estimates and intervals reach far below 0 and above 1
        ends = [x for i in mine.factors for x in (i.first - i.first_half, i.total + i.total_half)]
        panel.set_xlim(min(-0.06, 1.05 * min(ends)), max(1.06, 1.05 * max(ends)))
        y = np.arange(len(mine.factors))
        for shift, colour, label, name in ((-0.19, FIRST, "first order", "first"), (0.19, TOTAL, "total", "total")):
            value, half, before = (
                np.array([getattr(i, n) for i in mine.factors]) for n in (name, f"{name}_half", f"{name}_before")
            )
            error = {"lw": 0.8, "capsize": 1.8, "ecolor": "#333333"}
            panel.barh(y + shift, value, 0.36, color=colour, label=label, xerr=half, error_kw=error)
            panel.plot(before, y + shift, "o", ms=3, mfc="white", mec="#333333", mew=0.7, label="half of the samples")
    for panel in axes.flat[len(shown) :]:
        panel.set_visible(False)
    for line in axes:
        line[0].set_yticks(range(len(study.factors)), [f.symbol for f in study.factors], fontsize=8)
    axes[0][0].invert_yaxis()
    keys: dict[str, Artist] = {}
    for panel in axes.flat:
        handles, labels = panel.get_legend_handles_labels()
        keys |= dict(zip(labels, handles, strict=True))
    figure.legend(list(keys.values()), list(keys), loc="outside lower center", ncols=3, frameon=False, fontsize=8)
    return figure
