"""``foreshock security``."""

from __future__ import annotations

from pathlib import Path
from typing import get_args

import click

from foreshock.cli.output import OK, console, emit
from foreshock.live import init_security
from foreshock.wire import Naming

__all__ = ["security"]


@click.group()
def security() -> None:
    """Certificates and access rules of the link."""


def _twins(_: click.Context, __: click.Parameter, given: tuple[str, ...]) -> dict[str, tuple[str, ...]]:
    found = {}
    for item in given:
        name, equals, channels = item.partition("=")
        if not name or not equals or not channels:
            raise click.BadParameter(f"{item!r} is not NAME=CHANNEL[,CHANNEL]")
        found[name] = tuple(channels.split(","))
    return found


@security.command()
@click.argument("folder", type=click.Path(path_type=Path, file_okay=False))
@click.option("--robot", default="talos", show_default=True, help="Whose link it is.")
@click.option(
    "--twin", "twins", multiple=True, callback=_twins, metavar="NAME=CHANNEL[,…]", help="A twin, and what it may write."
)
@click.option("--host", "hosts", multiple=True, help="Where the supervisor is dialled, if not on this machine alone.")
@click.option(
    "--naming",
    type=click.Choice(get_args(Naming)),
    default="foreshock",
    show_default=True,
    help="Key scheme of the streams; rmw_zenoh for ROS 2 robots.",
)
@click.option(
    "--domain", type=click.IntRange(0, 232), default=0, show_default=True, help="ROS domain id, with rmw_zenoh."
)
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def init(
    folder: Path,
    robot: str,
    twins: dict[str, tuple[str, ...]],
    hosts: tuple[str, ...],
    naming: Naming,
    domain: int,
    as_json: bool,
) -> int:
    """Make a development authority in FOLDER, certificates for everybody, and link.toml with the access rules.

    The supervisor's configuration takes over the tables of link.toml. Everybody else connects with ca.pem and the
    certificate and key of their own name: only the supervisor can write interventions and the lease, a twin its own
    channels only, and only an operator can reset a latch.
    """
    files = init_security(folder, robot, twins, hosts, naming, domain)
    if as_json:
        emit([str(f) for f in files])
    else:
        console.print("\n".join(str(f) for f in files), markup=False)
    return OK
