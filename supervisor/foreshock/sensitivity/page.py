"""The sensitivity report: one HTML file with the claims, the tornado plots and the Sobol indices."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path

import jinja2

from foreshock._picture import picture
from foreshock.sensitivity.local import LOW, Perturbed
from foreshock.sensitivity.plots import sobol_figure, timelines_figure, tornado_figure
from foreshock.sensitivity.sobol import Indices
from foreshock.sensitivity.study import Study

__all__ = ["write_sensitivity_report"]

PAIRS = 6
"""Interactions shown for each output, the largest of those beyond their interval."""


def write_sensitivity_report(
    path: Path, study: Study, local: Sequence[Perturbed], indices: Sequence[Indices], samples: int, command: str
) -> None:
    """Write the report.

    Args:
        path: the HTML file.
        study: what was perturbed.
        local: one at a time.
        indices: global.
        samples: N.
        command: what reproduces it.
    """
    source = files("foreshock").joinpath("data/sensitivity.html.j2").read_text()
    page = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    pairs = {
        i.output: sorted((x for x in i.interactions if x.second > x.second_half), key=lambda x: -x.second)[:PAIRS]
        for i in indices
        if i.interactions
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(
        page.from_string(source).render(
            study=study,
            local=local,
            indices=indices,
            pairs=pairs,
            titles={o.id: o.title for o in study.outputs},
            symbols={f.id: f.symbol for f in study.factors},
            samples=samples,
            low=LOW,
            command=command,
            timelines=picture(timelines_figure(study, study.outcomes())),
            tornado=picture(tornado_figure(study, local)),
            sobol=picture(sobol_figure(study, indices)),
        )
    )
