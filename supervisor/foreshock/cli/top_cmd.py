"""``foreshock top``: a live view of a supervisor in the terminal."""

from __future__ import annotations

import time
from typing import Any

import click
import msgspec
from rich.console import Group
from rich.live import Live
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from foreshock.cli.output import OK, console, emit
from foreshock.errors import BadInputError
from foreshock.link import DEFAULT_ENDPOINT, LinkSettings, TlsSettings, keys_of, open_link
from foreshock.live import Status

__all__ = ["ask", "top"]

COLOURS = {"normal": "green", "caution": "yellow", "protective": "red", "minimal_risk": "bold red"}


def ask(session: Any, key: str, payload: bytes = b"", timeout_s: float = 2.0) -> bytes:
    """The answer of a live supervisor.

    Raises:
        BadInputError: nobody answers, or it refuses.
    """
    for reply in session.get(key, payload=payload, timeout=timeout_s):
        if reply.ok is None:
            raise BadInputError(key, reply.err.payload.to_string())
        answer: bytes = reply.ok.payload.to_bytes()
        return answer
    raise BadInputError(
        key, f"no answer within {timeout_s:g} s", "; is a supervisor running there, and may you ask this?"
    )


@click.command()
@click.argument("robot", default="talos")
@click.option("--connect", default=DEFAULT_ENDPOINT, show_default=True, help="Endpoint of the supervisor.")
@click.option("--ca", default="", help="Certificate authority (PEM), for tls/ endpoints.")
@click.option("--certificate", default="", help="Of this viewer (PEM).")
@click.option("--key", default="", help="Its private key (PEM).")
@click.option("--once", is_flag=True, help="Print one view and end.")
@click.option("--json", "as_json", is_flag=True, help="Print the status once, as JSON.")
def top(robot: str, connect: str, ca: str, certificate: str, key: str, once: bool, as_json: bool) -> int:
    """Watch the supervisor of ROBOT: trust, precursors, risk by mode, interventions, channel ages, tick times."""
    link = LinkSettings("client", (), (connect,), tls=TlsSettings(ca, certificate, key))
    session: Any = open_link(link)
    where = keys_of(link, robot).service("status")
    try:
        status = msgspec.json.decode(ask(session, where), type=Status)
        if as_json:
            emit(status)
        elif once:
            console.print(view(status))
        else:
            with Live(view(status), console=console, refresh_per_second=10, screen=True) as screen:
                while True:
                    time.sleep(0.1)
                    screen.update(view(msgspec.json.decode(ask(session, where), type=Status)))
    finally:
        session.close()
    return OK


def view(s: Status) -> Group:
    """One screen."""
    colour = COLOURS.get(s.level, "white")
    median, p99, most = s.tick_ms
    head = Text.assemble(
        (f" {s.robot} ", "bold"),
        (f" {s.level or 'no tick yet'} ".replace("_", "-"), f"reverse {colour}"),
        f"  trust {s.trust:.2f}  control {s.control_trust:.2f}   ",
        (
            "may move" if s.motion_permitted else "may NOT move" + (f": {s.withheld}" if s.withheld else ""),
            "green" if s.motion_permitted else "red",
        ),
        f"\n up {s.uptime_s:.0f} s, tick {s.tick}: {median:.2f} ms median, {p99:.2f} p99, {most:.2f} most, "
        f"{s.overruns} overruns, {s.leases} leases",
    )
    modes = _grid("mode", "T", "level")
    for mode, trust in sorted(s.trust_by_mode.items(), key=lambda item: item[1])[:8]:
        level = s.levels.get(mode, "normal")
        bar = "█" * round(20 * (1.0 - trust))
        modes.add_row(mode, f"{trust:.2f} {bar}", Text(level.replace("_", "-"), COLOURS.get(level, "white")))
    now = _grid("now", "")
    now.add_row("precursors", "\n".join(s.precursors) or "none")
    now.add_row("interventions", "\n".join(f"{a} {v:.2f}" for a, v in s.interventions.items()) or "none")
    now.add_row("not acknowledged", ", ".join(s.unacknowledged) or "none")
    now.add_row("guards", "\n".join(f"{g} {age:.2f} s ago" for g, age in s.guards.items()) or "none")
    now.add_row("peers", "\n".join(s.peers) or "none")
    now.add_row("links", "\n".join(s.links) or "none")
    streams = _grid("channel", "source age", "arrival", "samples", "gaps", "garbage", "foreign", "fault")
    for name, x in s.streams.items():
        c = x.counts
        streams.add_row(
            name.partition("/")[2],
            _ms(x.source_age_s),
            _ms(x.arrival_age_s),
            *(str(n) for n in (c.samples, c.gaps, c.garbage, c.foreign)),
            c.last_fault[:40],
        )
    health = _grid("not ok", "")
    for source, why in s.health.items():
        health.add_row(source, why)
    away = _grid("turned away", "times", "last")
    for r in s.refused:
        away.add_row(f"no connection: {r.reason}", str(r.count), f"{r.age_s:.0f} s ago")
    for d in s.denied:
        away.add_row(f"{d.name or d.zid}: {d.what} {d.key}", str(d.count), f"{d.age_s:.0f} s ago")
    two = Table.grid(expand=True, padding=(0, 1))
    two.add_row(Panel(modes, title="trust by mode"), Panel(now, title="now"))
    last = [Panel(health, title="health", border_style="yellow")] if s.health else []
    if s.refused or s.denied:
        last.append(Panel(away, title="link", border_style="red"))
    return Group(head, two, Panel(streams, title="streams"), *last)


def _grid(*columns: str) -> Table:
    table = Table(box=None, pad_edge=False, expand=True)
    for column in columns:
        table.add_column(column, overflow="fold")
    return table


def _ms(age_s: float | None) -> str:
    return "–" if age_s is None else f"{age_s * 1e3:.1f} ms" if age_s < 10.0 else f"{age_s:.0f} s"
