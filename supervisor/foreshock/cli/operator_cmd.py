"""``foreshock reset``: an operator releases what is latched."""

from __future__ import annotations

from typing import Any

import click
import msgspec

from foreshock.cli._link import Joining, join_options
from foreshock.cli.output import OK, console, emit
from foreshock.cli.top_cmd import ask
from foreshock.journal import OperatorReset
from foreshock.link import keys_of, open_link
from foreshock.live import ResetRequest

__all__ = ["reset"]


@click.command()
@click.argument("robot", default="talos")
@click.option("--who", required=True, help="The operator.")
@click.option("--why", required=True, help="What was checked.")
@click.option("--dimension", default="", help="overall, a mode's code or a class's id; all by default.")
@join_options("the operator")
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def reset(robot: str, who: str, why: str, dimension: str, join: Joining, as_json: bool) -> int:
    """Release latched protection levels of ROBOT's supervisor; recorded with who and why.

    What still demands protection demands it again in the next tick.
    """
    link = join.settings("client")
    session: Any = open_link(link)
    try:
        payload = msgspec.json.encode(ResetRequest(who, why, dimension))
        answer = ask(session, keys_of(link, robot).service("reset"), payload)
    finally:
        session.close()
    record = msgspec.json.decode(answer, type=OperatorReset)
    if as_json:
        emit(record)
    else:
        console.print(f"released {record.dimension or 'everything'} by {record.who}: {record.why}", markup=False)
    return OK
