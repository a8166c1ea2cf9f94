"""One HTML file that holds everything: no script, no network, pictures inline."""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path

import jinja2

from foreshock._picture import picture
from foreshock.report.plots import runs_figure, sweep_figure
from foreshock.session.run import Run
from foreshock.session.sweep import CellResult

__all__ = ["write_report"]


def write_report(
    path: Path,
    title: str,
    runs: Sequence[tuple[str, Run]],
    sweep: Sequence[CellResult] = (),
    notes: Sequence[str] = (),
    command: str = "",
) -> None:
    """Write a report.

    Args:
        path: the HTML file.
        title: its heading.
        runs: label and run, shown side by side.
        sweep: results to tabulate and plot.
        notes: paragraphs on how to read it.
        command: what reproduces it.
    """
    source = files("foreshock").joinpath("data/report.html.j2").read_text()
    page = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    page.filters["median"] = statistics.median
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(
        page.from_string(source).render(
            title=title,
            runs=runs,
            sweep=sweep,
            notes=notes,
            command=command,
            runs_picture=picture(runs_figure(runs)),
            sweep_picture=picture(sweep_figure(sweep)) if sweep else "",
        )
    )
