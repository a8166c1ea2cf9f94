"""The report holds everything itself and says what is synthetic."""

from __future__ import annotations

import re
from pathlib import Path

import msgspec

from foreshock._picture import picture
from foreshock.events import Event, Problem
from foreshock.events._heatmaps import association_figure, matrix_figure, overlap_figure
from foreshock.events.analyse import analyse
from foreshock.events.html import write_events_report
from foreshock.events.summary import headline, text_tables
from foreshock.events.synthetic import synthetic_events
from foreshock.taxonomy import builtin_taxonomy

TAXONOMY = builtin_taxonomy()
EVENTS = synthetic_events(0, 4)  # drawing takes longer with every kind


PROBLEM = Problem(7, "outcome", "<A13>", "unknown accident mode '<A13>'")
CODED = [msgspec.structs.replace(e, id=f"c{e.id[9:]}", source="coded") for e in EVENTS]
MIXED = [*CODED, EVENTS[0]]


def page(path: Path, events: list[Event], **more) -> str:
    write_events_report(path, analyse(events, TAXONOMY), TAXONOMY, **more)
    return path.read_text()


def test_a_synthetic_event_is_said_at_the_head_and_on_every_picture(tmp_path: Path) -> None:
    text = page(tmp_path / "a.html", MIXED, problems=[PROBLEM])
    assert "SYNTHETIC: 1 of 5 events were drawn by a generator" in text
    assert "<title>SYNTHETIC: " in text
    found = analyse(MIXED, TAXONOMY)
    figures = [
        overlap_figure(found),
        association_figure(found.by_class, {}, "given_name", found.synthetic > 0),
        matrix_figure(found.lift, "Lift", {}, found.synthetic > 0, ratio=True),
    ]
    assert all("SYNTHETIC" in figure.axes[0].get_title(loc="left") for figure in figures)
    assert all(t.title.startswith("SYNTHETIC: ") for t in text_tables(found))
    assert headline(found).startswith("SYNTHETIC (1 of 5")
    # the page needs nothing else: overlap, two of classes, kinds, together, lift, order
    sources = re.findall(r'(?:src|href)="([^"]{0,30})', text)
    assert len(sources) == 7
    assert all(s.startswith("data:image/svg+xml;base64,") for s in sources)
    assert "<script" not in text
    assert "&lt;A13&gt;" in text
    assert all(mode.title in text for mode in TAXONOMY.modes)


def test_observed_events_are_not_called_synthetic(tmp_path: Path) -> None:
    events = [e for e in CODED if e.coder == "coder-1"][:2]
    text = page(tmp_path / "a.html", events)
    assert "SYNTHETIC" not in text
    assert "No event was coded by two coders" in text
    found = analyse(CODED, TAXONOMY)
    assert "SYNTHETIC" not in overlap_figure(found).axes[0].get_title(loc="left")
    assert not any("SYNTHETIC" in t.title for t in text_tables(found))


def test_no_events_make_a_page_too(tmp_path: Path) -> None:
    assert "0 events (0 codings)" in page(tmp_path / "a.html", [])


def test_the_same_events_give_the_same_picture() -> None:
    one, two = (picture(overlap_figure(analyse(CODED, TAXONOMY))) for _ in range(2))
    assert one == two
