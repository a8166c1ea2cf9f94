"""The screen of ``foreshock top``: as many lines as the terminal has, and what is left out is counted."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Group
from rich.table import Table
from rich.text import Text

from foreshock.live import Status

__all__ = ["shares", "view"]

COLOURS = {"normal": "green", "caution": "yellow", "protective": "red", "minimal_risk": "bold red"}
BAR = 8
SIDE = 37
"""Columns of trust by mode; what is now has the rest."""
LEAST = (2, 2, 4, 2)
"""Lines that health, streams, trust and those turned away get on the smallest screen."""


def shares(room: int, wanted: Sequence[int], least: Sequence[int]) -> list[int]:
    """Lines for each section: its least, or less if it wants less; of the rest the first take first."""
    given = [min(pair) for pair in zip(wanted, least, strict=True)]
    rest = room - sum(given)
    for k, want in enumerate(wanted):
        more = max(0, min(want - given[k], rest))
        given[k] += more
        rest -= more
    return given


def view(s: Status, width: int, height: int | None = None) -> Group:
    """A screen of so many columns and lines; without a height everything, however long."""
    head, now, away, cut = _head(s), _now(s), _away(s), height is not None
    modes = sorted(s.trust_by_mode.items(), key=lambda item: item[1])
    labels = [max(1, len(items)) for items in now.values()]
    wanted = [len(s.health), len(s.streams), max(len(modes), sum(labels)), len(away)]
    # each section has one line of headings; peers and links have one line each
    used = len(head) + 2 + 3 + bool(away)
    n_health, n_streams, n_modes, n_away = wanted if height is None else shares(height - used, wanted, LEAST)
    sides = Table.grid(expand=True, padding=(0, 1))
    sides.add_column(width=SIDE)
    sides.add_column(ratio=1)
    sides.add_row(_modes(s, modes, n_modes), _table_of_now(now, shares(n_modes, labels, [1] * len(labels)), cut))
    parts: list[Table | Text] = [*head, sides, _streams(s, n_streams, cut)]
    if s.health:
        parts.append(_section(("not ok", "why"), list(s.health.items()), n_health, 1, cut))
    else:
        parts.append(Text("everything is observed" if s.tick >= 0 else "nothing is judged yet", "dim"))
    if away:
        parts.append(_section(("turned away", "times", "last"), away, n_away, 0, cut))
    parts += [_line("peers", s.peers, width, cut), _line("links", s.links, width, cut)]
    return Group(*parts)


def _head(s: Status) -> list[Text]:
    median, p99, most = s.tick_ms
    said = Text.assemble(
        (f" {s.robot} ", "bold"),
        (f" {s.level or 'no tick yet'} ".replace("_", "-"), f"reverse {COLOURS.get(s.level, 'white')}"),
        f"  trust {s.trust:.2f}  control {s.control_trust:.2f}   ",
        ("may move", "green") if s.motion_permitted else ("may NOT move", "red"),
    )
    times = Text(
        f" up {s.uptime_s:.0f} s, tick {s.tick}: {median:.2f} ms median, {p99:.2f} p99, {most:.2f} most, "
        f"{s.overruns} overruns, {s.leases} leases"
    )
    lines = [said, Text(f" {s.withheld}", "red"), times] if s.withheld else [said, times]
    for line in lines:
        line.no_wrap, line.overflow = True, "ellipsis"
    return lines


def _modes(s: Status, modes: Sequence[tuple[str, float]], lines: int) -> Table:
    rows = []
    for mode, trust in modes:
        level = s.levels.get(mode, "normal")
        bar = "█" * round(BAR * (1.0 - trust))
        rows.append((mode, Text(f"{trust:.2f} {bar}"), Text(level.replace("_", "-"), COLOURS.get(level, "white"))))
    return _section(("mode", "trust", "level"), rows, lines, 1, cut=True)


def _now(s: Status) -> dict[str, Sequence[str]]:
    return {
        "not acknowledged": s.unacknowledged,
        "precursors": s.precursors,
        "interventions": [f"{a} {v:.2f}" for a, v in s.interventions.items()],
        "guards": [f"{g} {age:.2f} s ago" for g, age in s.guards.items()],
    }


def _table_of_now(now: dict[str, Sequence[str]], given: Sequence[int], cut: bool) -> Table:
    """Each item on a line; on the last that a label has, how many more there are."""
    table = _grid("now", "", "", wide=1, cut=cut)
    for (label, items), lines in zip(now.items(), given, strict=True):
        for k, item in enumerate((items or ("none",))[:lines]):
            left = len(items) - lines if k == lines - 1 else 0
            table.add_row(Text(label if k == 0 else ""), Text(item), Text(f"+{left} more" if left > 0 else "", "dim"))
    return table


def _streams(s: Status, lines: int, cut: bool) -> Table:
    rows = []
    for name, x in s.streams.items():
        c = x.counts
        counts = (str(n) for n in (c.samples, c.gaps, c.garbage, c.foreign))
        ages = (_ms(x.source_age_s), _ms(x.arrival_age_s))
        rows.append((name.partition("/")[2], *ages, *counts, c.last_fault))
    titles = ("stream", "age", "arrival", "samples", "gaps", "garbage", "foreign", "fault")
    return _section(titles, rows, lines, len(titles) - 1, cut)


def _away(s: Status) -> list[tuple[str, str, str]]:
    rows = [(f"no connection: {r.reason}", str(r.count), f"{r.age_s:.0f} s ago") for r in s.refused]
    return rows + [(f"{d.name or d.zid}: {d.what} {d.key}", str(d.count), f"{d.age_s:.0f} s ago") for d in s.denied]


def _section(titles: Sequence[str], rows: Sequence[tuple[str | Text, ...]], lines: int, wide: int, cut: bool) -> Table:
    """A table of so many lines below its headings; the last says how many more rows there are."""
    table = _grid(*titles, wide=wide, cut=cut)
    shown = rows if len(rows) <= lines else rows[: max(0, lines - 1)]
    for row in shown:
        table.add_row(*(Text(cell) if isinstance(cell, str) else cell for cell in row))
    if len(shown) < len(rows):
        table.add_row(Text(f"+{len(rows) - len(shown)} more", "dim"))
    return table


def _line(label: str, items: Sequence[str], width: int, cut: bool) -> Text:
    """Items after one another; those that do not fit in the width are counted."""
    shown = list(items)
    while True:
        left = len(items) - len(shown)
        said = (
            f"{label}: {', '.join(shown) or 'none'}" if not left else f"{label}: {', '.join([*shown, f'+{left} more'])}"
        )
        if not cut or not shown or len(said) <= width:
            return Text(said, "dim", no_wrap=cut, overflow="ellipsis" if cut else "fold")
        shown.pop()


def _grid(*columns: str, wide: int, cut: bool) -> Table:
    """Columns as wide as they need; the wide one has the rest."""
    table = Table(box=None, pad_edge=False, expand=True, header_style="bold reverse dim")
    for k, column in enumerate(columns):
        table.add_column(
            column,
            no_wrap=cut,
            overflow="ellipsis" if cut else "fold",
            ratio=1 if k == wide else None,
            min_width=len("+99 more") if k == 0 else None,
        )
    return table


def _ms(age_s: float | None) -> str:
    return "–" if age_s is None else f"{age_s * 1e3:.1f} ms" if age_s < 10.0 else f"{age_s:.0f} s"
