"""Options of commands that join a link, the same everywhere, and the settings that they make."""

from __future__ import annotations

import functools
from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal

import click
import msgspec

from foreshock._strict import convert, read_toml
from foreshock.errors import ConfigError
from foreshock.link import DEFAULT_ENDPOINT, LinkSettings

__all__ = ["STEPPED_ENDPOINT", "Joining", "join_options", "link_option"]

STEPPED_ENDPOINT = "tcp/127.0.0.1:7448"
NOT_FOR_JOINING = ("mode", "listen", "access")
"""Settings of a supervisor; a command has a mode of its own."""
CERTIFICATES = ("ca", "certificate", "key")

link_option = click.option(
    "--link",
    type=click.Path(path_type=Path, dir_okay=False),
    help="TOML file whose table [link] says how to join: connect, remote, tls, naming, domain.",
)


class Joining(msgspec.Struct, frozen=True):
    """What the options say: a file with a table [link], and what takes the place of its settings where it is given."""

    file: Path | None = None
    connect: str = ""
    ca: str = ""
    certificate: str = ""
    key: str = ""

    def settings(
        self, mode: Literal["client", "peer"], default: str = DEFAULT_ENDPOINT, listen: str = ""
    ) -> LinkSettings:
        """How to join; a file's certificates lie beside it.

        Args:
            mode: of the session.
            default: where to connect to if nothing says so.
            listen: where a peer listens instead, if nothing says where to connect to; empty: nowhere.

        Raises:
            ConfigError: names the option, or file and key path.
        """
        table = {} if self.file is None else _table(self.file)
        if self.connect:
            table["connect"] = [self.connect]
        given = {name: getattr(self, name) for name in CERTIFICATES if getattr(self, name)}
        if given and isinstance(tls := table.get("tls", {}), dict):
            table["tls"] = {**tls, **given}
        if listen and not table.get("connect"):
            table |= {"mode": "peer", "listen": [listen]}
        else:
            table |= {"mode": mode, "listen": [], "connect": table.get("connect") or [default]}
        try:
            return convert({"link": table}, _File, str(self.file)).link
        except ConfigError as e:
            hint = f"{e.hint}, in a file for --link" if "link.remote" in e.hint else e.hint
            place = e.place if self.file is not None else f"--{e.place.rpartition('.')[2]}"
            raise ConfigError(place, e.problem, hint) from None


class _File(msgspec.Struct, frozen=True):
    link: LinkSettings


def _table(file: Path) -> dict[str, Any]:
    table = read_toml(file).get("link")
    if not isinstance(table, dict):
        raise ConfigError(f"{file}: link", "missing; expected a table")
    for name in NOT_FOR_JOINING:
        if name in table:
            raise ConfigError(f"{file}: link.{name}", "is for a supervisor; who joins has connect")
    tls = table.get("tls")
    if isinstance(tls, dict):
        beside = {n: str(file.parent.resolve() / tls[n]) for n in CERTIFICATES if isinstance(tls.get(n), str)}
        table["tls"] = tls | beside
    return table


def join_options(
    whose: str, connect: str = f"Endpoint of the supervisor.  [default: {DEFAULT_ENDPOINT}]"
) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Options for joining; the command gets them as ``join``, a Joining.

    Args:
        whose: who the certificate belongs to.
        connect: help of --connect.
    """

    def decorate(command: Callable[..., Any]) -> Callable[..., Any]:
        @functools.wraps(command)
        def joined(
            *args: Any, link: Path | None, connect: str, ca: str, certificate: str, key: str, **rest: Any
        ) -> Any:
            return command(*args, join=Joining(link, connect, ca, certificate, key), **rest)

        for option in (
            click.option("--key", default="", help="Its private key (PEM)."),
            click.option("--certificate", default="", help=f"Of {whose} (PEM)."),
            click.option("--ca", default="", help="Certificate authority (PEM), for tls/ endpoints."),
            link_option,
            click.option("--connect", default="", help=connect),
        ):
            joined = option(joined)
        return joined

    return decorate
