"""The screen of ``foreshock top`` fits the terminal, and what it leaves out is counted."""

from __future__ import annotations

import io
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec import convert
from rich.console import Console

from foreshock.cli._top_view import view
from foreshock.live import Status

AWAY = {"name": "scene", "zid": "ab", "what": "Put", "key": "foreshock/talos/@/lease", "count": 2, "age_s": 3.0}


def status(streams: int, health: int, modes: int, away: int, now: int) -> Status:
    """A supervisor with so many of each, as it would answer."""
    stream = {
        "key": "k",
        "source_age_s": 0.012,
        "arrival_age_s": 0.01,
        "clock_offset_s": 0.1,
        "delay_s": 0.0,
        "counts": {"samples": 12345, "gaps": 3, "last_fault": "a second sender, 61616161616161616161"},
    }
    names = [f"item-{k}" for k in range(now)]
    return convert(
        {
            "robot": "talos",
            "epoch": 1,
            "uptime_s": 1234.5,
            "tick": 24690,
            "tick_ms": [1.23, 2.34, 5.67],
            "overruns": 2,
            "level": "minimal_risk",
            "levels": {"A1": "protective"},
            "trust": 0.31,
            "control_trust": 0.12,
            "trust_by_mode": {f"A{k}": k / 20 for k in range(1, modes + 1)},
            "motion_permitted": False,
            "withheld": "no guard has acknowledged minimal-risk",
            "leases": 1234,
            "guards": dict.fromkeys(names, 0.01),
            "unacknowledged": names,
            "unknown_actions": {},
            "interventions": dict.fromkeys(names, 1.0),
            "precursors": names,
            "streams": {f"talos/stream_{k}/state": stream for k in range(streams)},
            "health": {f"detector-{k}": f"unobserved: [bold] {'too old ' * 20}" for k in range(health)},
            "peers": [f"guard/peer-{k}" for k in range(now)],
            "links": [f"tls/127.0.0.1:{40000 + k} robot" for k in range(now)],
            "denied": [AWAY] * away,
            "refused": [{"reason": "UnknownIssuer", "count": 3, "age_s": 10.0}] * away,
            "journal": "",
        },
        Status,
    )


def screen(s: Status, width: int, height: int | None) -> list[str]:
    """Its lines as plain text."""
    console = Console(width=width, height=height, file=io.StringIO(), record=True)
    console.print(view(s, width, height))
    return console.export_text().rstrip("\n").split("\n")


def more(lines: list[str]) -> int:
    """How many are said to be left out."""
    return sum(int(n) for line in lines for n in re.findall(r"\+(\d+) more", line))


def section(lines: list[str], begins: str, ends: str) -> list[str]:
    """The lines from the heading that begins with this to the one that begins with that."""
    first = next(k for k, line in enumerate(lines) if line.startswith(begins))
    last = next(k for k, line in enumerate(lines[first:], first) if line.startswith(ends))
    return lines[first + 1 : last]


@pytest.mark.parametrize(("width", "height"), [(80, 24), (100, 30), (160, 50)])
@pytest.mark.parametrize(("streams", "health", "modes"), [(1, 1, 3), (6, 3, 12), (12, 8, 12)])
def test_everything_is_on_the_screen_or_counted(width: int, height: int, streams: int, health: int, modes: int) -> None:
    lines = screen(status(streams, health, modes, away=3, now=4), width, height)
    assert len(lines) <= height
    assert "trust 0.31" in lines[0]
    assert "may NOT move" in lines[0]
    assert "no guard has acknowledged minimal-risk" in lines[1]
    trust = section(lines, "mode", "stream")
    assert sum(re.match(r"A\d+ ", line) is not None for line in trust) + more([t[:37] for t in trust]) == modes
    assert trust[0].startswith("A1 "), "the least trust is first"
    assert sum("item-" in line for line in trust) + more([t[37:] for t in trust]) == 16
    shown = section(lines, "stream", "not ok")
    assert sum("stream_" in line for line in shown) + more(shown) == streams
    if streams <= 6:
        assert more(shown) == 0
    unwell = section(lines, "not ok", "turned away")
    assert sum("[bold] too old" in line for line in unwell) + more(unwell) == health
    turned = section(lines, "turned away", "peers")
    assert sum("UnknownIssuer" in line or "scene: Put" in line for line in turned) + more(turned) == 6
    for label, mark in (("peers", "peer-"), ("links", "tls/")):
        (line,) = (text for text in lines if text.startswith(label))
        assert line.count(mark) + more([line]) == 4
        assert len(line) <= width


@given(counts=st.tuples(*[st.integers(0, 20)] * 5), width=st.sampled_from([80, 100, 160]), height=st.integers(24, 60))
def test_it_is_never_longer_than_the_terminal(counts: tuple[int, ...], width: int, height: int) -> None:
    assert len(screen(status(*counts), width, height)) <= height


def test_one_view_leaves_nothing_out() -> None:
    text = "\n".join(screen(status(20, 20, 20, 20, 20), 80, None))
    assert "more" not in text
    for name in ("stream_19", "detector-19", "A20", "item-19", "peer-19", "40019"):
        assert name in text
