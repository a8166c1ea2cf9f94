"""The analysis of a table of events as one HTML file: no script, no network, pictures inline."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path

from foreshock._picture import picture
from foreshock.errors import MissingExtraError
from foreshock.events._problem import Problem
from foreshock.events.analyse import Analysis
from foreshock.events.schema import NO_ACCIDENT
from foreshock.session.rates import Rate
from foreshock.taxonomy import Taxonomy, builtin_taxonomy

__all__ = ["write_events_report"]


def write_events_report(
    path: Path,
    analysis: Analysis,
    taxonomy: Taxonomy | None = None,
    *,
    title: str = "Events and their precursors",
    problems: Sequence[Problem] = (),
    command: str = "",
) -> None:
    """Write the report; where any event is synthetic, it says so at its head and on each picture.

    Args:
        path: the HTML file.
        analysis: what to show.
        taxonomy: titles of modes, classes and kinds; the paper's by default.
        title: the report's heading.
        problems: rows that were left out.
        command: what reproduces it.

    Raises:
        MissingExtraError: jinja2 or matplotlib is not installed.
        OSError: it cannot be written.
    """
    try:
        import jinja2

        from foreshock.events import _heatmaps as draw
    except ImportError as e:
        raise MissingExtraError(str(path), f"needs {e.name}", "; run: pip install 'foreshock[analysis]'") from e
    a, full = analysis, taxonomy or builtin_taxonomy()
    titles = {m.code: m.title for m in full.modes} | {c.id: c.title for c in full.classes}
    titles |= {k.id: k.title for k in full.kinds} | {NO_ACCIDENT: "(no accident)"}
    fake = a.synthetic > 0
    pictures = {"overlap": picture(draw.overlap_figure(a))}
    for name, ties, which in (
        ("class_given_outcome", a.by_class, "given_outcome"),
        ("class_given_name", a.by_class, "given_name"),
        ("kind_given_outcome", a.by_kind, "given_outcome"),
    ):
        if ties.names:
            pictures[name] = picture(draw.association_figure(ties, titles, which, fake))
    for name, matrix, text, ratio in (
        ("cooccurrence", a.cooccurrence, "Events with both kinds", False),
        ("lift", a.lift, "Lift of two kinds in one event", True),
        ("order", a.order, "Events in which the row's kind begins before the column's", False),
    ):
        if matrix.names:
            classes = [full.class_of(kind) for kind in matrix.names]
            breaks = [k for k in range(1, len(classes)) if classes[k] != classes[k - 1]]
            pictures[name] = picture(draw.matrix_figure(matrix, text, titles, fake, breaks, ratio=ratio))
    page = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    page.filters |= {"share": _share, "interval": _interval}
    source = files("foreshock").joinpath("data/events.html.j2").read_text()
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(
        page.from_string(source).render(
            title=title, a=a, titles=titles, pictures=pictures, problems=problems, command=command
        )
    )


def _share(rate: Rate) -> str:
    return f"{100 * rate.k / rate.n:.1f}" if rate.n else "–"


def _interval(rate: Rate) -> str:
    return f"{100 * rate.low:.1f}–{100 * rate.high:.1f}" if rate.n else "–"
