"""``foreshock top``: a live view of a supervisor in the terminal."""

from __future__ import annotations

import time
from typing import Any

import click
import msgspec
from rich.live import Live

from foreshock.cli._link import Joining, join_options
from foreshock.cli._top_view import view
from foreshock.cli.output import OK, console, emit
from foreshock.errors import BadInputError
from foreshock.link import keys_of, open_link
from foreshock.live import Status

__all__ = ["ask", "top"]


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
@join_options("this viewer")
@click.option("--once", is_flag=True, help="Print one view and end.")
@click.option("--json", "as_json", is_flag=True, help="Print the status once, as JSON.")
def top(robot: str, join: Joining, once: bool, as_json: bool) -> int:
    """Watch the supervisor of ROBOT: trust, precursors, risk by mode, interventions, channel ages, tick times."""
    link = join.settings("client")
    session: Any = open_link(link)
    where = keys_of(link, robot).service("status")
    try:
        status = msgspec.json.decode(ask(session, where), type=Status)
        if as_json:
            emit(status)
        elif once:
            console.print(view(status, console.width))
        else:
            with Live(view(status, *console.size), console=console, refresh_per_second=10, screen=True) as screen:
                while True:
                    time.sleep(0.1)
                    status = msgspec.json.decode(ask(session, where), type=Status)
                    screen.update(view(status, *console.size))
    finally:
        session.close()
    return OK
