"""An analysis as tables of text, for a terminal."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import msgspec

from foreshock.events.analyse import Analysis
from foreshock.session.rates import Rate

__all__ = ["TextTable", "headline", "text_tables"]


class TextTable(msgspec.Struct, frozen=True):
    """Title, columns and rows; the first left columns are words, the others numbers."""

    title: str
    columns: tuple[str, ...]
    rows: Sequence[tuple[str, ...]]
    left: int


def headline(a: Analysis) -> str:
    """What was counted, in one line; it begins with SYNTHETIC if any event is."""
    chosen = ", ".join(f"{name}'s for {n}" for name, n in a.coders.items())
    drawn = f"SYNTHETIC ({a.synthetic} of {a.events} events were drawn by a generator): " if a.synthetic else ""
    counts = f"{a.events} events, {a.accidents} of them accidents, {a.precursors} precursors"
    return f"{drawn}{counts}; of {a.rows} codings one counts for each event: {chosen or 'none'}"


def text_tables(a: Analysis) -> list[TextTable]:
    """The main results beside the paper's; every title says so if any event is synthetic."""
    tables = [_modes(a), _classes(a), _ties(a), _overlap(a), _cascades(a), _pairs(a), _agreement(a)]
    mark = "SYNTHETIC: " if a.synthetic else ""
    return [msgspec.structs.replace(t, title=mark + t.title) for t in tables]


def _share(rate: Rate) -> str:
    return f"{100 * rate.k / rate.n:.1f}" if rate.n else "–"


def _span(rate: Rate) -> str:
    return f"{100 * rate.low:.1f}–{100 * rate.high:.1f}" if rate.n else "–"


def _maybe(value: float | None, form: str) -> str:
    return "–" if value is None else format(value, form)


def _modes(a: Analysis) -> TextTable:
    rows = [
        (m.code, m.title, str(m.rate.k), _share(m.rate), _span(m.rate), str(m.paper_n), f"{m.paper_percent:.1f}")
        for m in a.modes
    ]
    columns = ("code", "mode", "n", "%", "95%", "paper n", "paper %")
    return TextTable("Accident modes beside Table 1", columns, rows, 2)


def _classes(a: Analysis) -> TextTable:
    rows = [(c.title, str(c.rate.k), _share(c.rate), _span(c.rate), f"{100 * c.paper_share:.0f}") for c in a.classes]
    columns = ("class", "n", "%", "95%", "paper %")
    return TextTable("Precursor classes beside section 3.2.2", columns, rows, 1)


def _ties(a: Analysis) -> TextTable:
    rows = [
        (
            t.outcome,
            t.name,
            "yes" if t.tied else "",
            str(t.given_outcome),
            str(t.given_name),
            _maybe(t.lift, ".2f"),
            f"{t.q_value:.2g}",
        )
        for t in a.by_class.ties
        if t.tied or t.q_value < 0.05
    ]
    columns = ("outcome", "class", "Table 2", "P(class | outcome)", "P(outcome | class)", "lift", "q")
    return TextTable("Association: pairs of Table 2, and others with q < 0.05", columns, rows, 3)


def _overlap(a: Analysis) -> TextTable:
    rows = [(f"{p.window_s:.1f}", str(p.begun), str(p.present)) for p in a.overlap[::5]]
    columns = ("window (s)", "both begin within it", "both present within it")
    return TextTable("Accidents with two or more precursors (paper: 73%)", columns, rows, 0)


def _cascades(a: Analysis) -> TextTable:
    rows = [
        (c.code, " → ".join(c.cascade), str(c.complete), str(c.in_order), _maybe(c.by_chance, ".0%"))
        for c in a.cascades
    ]
    columns = ("mode", "cascade", "complete", "in order", "by chance")
    return TextTable("Cascades of Table 3: order, of accidents with two or more of the kinds", columns, rows, 2)


def _pairs(a: Analysis, most: int = 10) -> TextTable:
    names, both, before = a.cooccurrence.names, a.cooccurrence.values, a.order.values
    found = []
    for i, j in combinations(range(len(names)), 2):
        if n := both[i][j]:
            turned = (before[j][i] or 0) > (before[i][j] or 0)
            found.append((-n, *((j, i) if turned else (i, j))))
    rows = [
        (names[i], names[j], f"{-n:.0f}", f"{before[i][j]:.0f}", _maybe(a.lift.values[i][j], ".1f"))
        for n, i, j in sorted(found)[:most]
    ]
    columns = ("first", "second", "events", "first before second", "lift")
    return TextTable("Pairs of kinds that occur together most often", columns, rows, 2)


def _agreement(a: Analysis) -> TextTable:
    rows = [
        (
            ", ".join(g.coders),
            k.field,
            _maybe(k.kappa, ".2f"),
            f"{_maybe(k.low, '.2f')}–{_maybe(k.high, '.2f')}",
            str(k.decisions),
        )
        for g in a.agreement
        for k in g.kappas
    ]
    columns = ("coders", "field", "kappa", "95%", "decisions")
    return TextTable("Agreement: Cohen's kappa (paper: 0.86 for precursors)", columns, rows, 2)
