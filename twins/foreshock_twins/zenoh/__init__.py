"""A twin in another process or machine, stepped over Zenoh: ``[twin] kind = "zenoh"``, or ``--twin zenoh:…``.

Importing this module imports no Zenoh.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import msgspec

from foreshock.errors import ConfigError
from foreshock.hookspecs import hookimpl
from foreshock.link import TlsSettings
from foreshock.twin import Twin, TwinSpec

__all__ = ["ZenohTwinConfig", "build_twin", "foreshock_twins"]


class ZenohTwinConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Where the twin is.

    Attributes:
        endpoint: of the twin, or of a router that it has joined.
        timeout_s: an answer that takes longer is a hang.
        remote: the endpoint is meant to be beyond this machine.
        tls: certificates, if the endpoint begins with ``tls/``.
    """

    endpoint: str = "tcp/127.0.0.1:7448"
    timeout_s: float = 10.0
    remote: bool = False
    tls: TlsSettings = TlsSettings()

    def __post_init__(self) -> None:
        if not self.timeout_s > 0.0:
            raise ConfigError("timeout_s", f"{self.timeout_s!r} is not above 0")


def build_twin(config: ZenohTwinConfig, robot: str, scratch: Path) -> Twin:
    """A twin behind Zenoh.

    Raises:
        MissingExtraError: eclipse-zenoh is not installed.
        TwinError: nobody answers, or the twin declares something else than what is spoken here.
    """
    from foreshock_twins.zenoh._twin import ZenohTwin

    return ZenohTwin(config, robot, scratch)


@hookimpl
def foreshock_twins() -> Sequence[TwinSpec]:
    """The twin kind ``zenoh``."""
    return [TwinSpec(id="zenoh", build=build_twin, config=ZenohTwinConfig, summary="A twin stepped over Zenoh")]
