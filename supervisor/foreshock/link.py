"""The Zenoh link: settings and session. Loopback only and no multicast, unless told otherwise."""

from __future__ import annotations

import ipaddress
import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import msgspec

from foreshock._strict import within
from foreshock.errors import BadInputError, ConfigError, MissingExtraError
from foreshock.wire import Keys, Naming, liveliness_token

if TYPE_CHECKING:
    import zenoh

__all__ = [
    "DEFAULT_ENDPOINT",
    "AccessRule",
    "LinkSettings",
    "TlsSettings",
    "keys_of",
    "open_link",
    "ros_tokens",
]

DEFAULT_ENDPOINT = "tcp/127.0.0.1:7447"
OWN = ("lease", "intervention", "decision")
"""Services that only the supervisor writes."""


class TlsSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Certificates (PEM files, relative to the configuration); both sides show theirs (mTLS).

    Attributes:
        ca: certificate authority that peers must be signed by; empty: no TLS.
        certificate: of this process.
        key: its private key.
        verify_name: the name in a peer's certificate must be the host that was dialled.
    """

    ca: str = ""
    certificate: str = ""
    key: str = ""
    verify_name: bool = True

    def __post_init__(self) -> None:
        given = [name for name in ("ca", "certificate", "key") if getattr(self, name)]
        if given and len(given) < 3:
            missing = next(n for n in ("ca", "certificate", "key") if n not in given)
            raise ConfigError(f"link.tls.{missing}", "missing; ca, certificate and key go together")


class AccessRule(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What a peer of one certificate name may write and ask; everything else is denied, reading is not.

    Attributes:
        name: common name of its certificate.
        write: key expressions that it may put to, and declare tokens on.
        ask: key expressions that it may query.
        answer: key expressions on which it may answer queries.
    """

    name: str
    write: tuple[str, ...] = ()
    ask: tuple[str, ...] = ()
    answer: tuple[str, ...] = ()


class LinkSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """How this process joins.

    Attributes:
        mode: ``router`` relays between clients and is what the supervisor is; robots and twins are clients, or, if they
            are to wait for a supervisor that is not there yet, peers that listen nowhere.
        listen: endpoints to listen on.
        connect: endpoints to connect to.
        remote: endpoints beyond this machine's loopback are meant.
        naming: key scheme of the streams.
        domain: ROS domain id, with naming = rmw_zenoh.
        tls: certificates; endpoints then begin with ``tls/``.
        access: who may write what; none: everybody everything. It needs TLS, which is where names come from.
        lease_s: a peer that is silent for so long is gone.
    """

    mode: Literal["router", "peer", "client"] = "router"
    listen: tuple[str, ...] = (DEFAULT_ENDPOINT,)
    connect: tuple[str, ...] = ()
    remote: bool = False
    naming: Naming = "foreshock"
    domain: int = 0
    tls: TlsSettings = TlsSettings()
    access: tuple[AccessRule, ...] = ()
    lease_s: float = 1.0

    def __post_init__(self) -> None:
        within("link.lease_s", self.lease_s, 0.05, 600.0)
        if self.mode == "client" and not self.connect:
            raise ConfigError("link.connect", "empty; a client needs an endpoint to connect to")
        if self.mode == "client" and self.listen:
            raise ConfigError("link.listen", f"{self.listen[0]!r}; a client listens nowhere", "; set listen = []")
        for name, endpoints in (("listen", self.listen), ("connect", self.connect)):
            for endpoint in endpoints:
                protocol, _, address = endpoint.partition("/")
                if protocol not in ("tcp", "tls") or not address:
                    raise ConfigError(f"link.{name}", f"{endpoint!r} is no endpoint", "; e.g. 'tcp/127.0.0.1:7447'")
                if not self.remote and not _is_loopback(address):
                    hint = "; set link.remote = true if this is meant, and certificates under [link.tls]"
                    raise ConfigError(f"link.{name}", f"{endpoint!r} is beyond this machine", hint)
                hint = "; a tls/ endpoint needs ca, certificate and key, another one takes none"
                if (protocol == "tls") != bool(self.tls.ca):
                    raise ConfigError(f"link.{name}", f"{endpoint!r} and [link.tls] do not go together", hint)
        if self.access and not self.tls.ca:
            raise ConfigError("link.access", "needs certificates under [link.tls]: names come from there")


def _is_loopback(address: str) -> bool:
    """Whether ``host:port`` is of this machine alone; a name that only begins like its address is not."""
    host = address.rpartition(":")[0].strip("[]")
    try:
        return host == "localhost" or ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def keys_of(link: LinkSettings, robot: str) -> Keys:
    """Key expressions of a robot on this link."""
    return Keys(robot, link.naming, link.domain)


def open_link(link: LinkSettings, base: Path | None = None) -> zenoh.Session:
    """An open session; close it, since an open one keeps the process alive.

    Args:
        link: the settings.
        base: folder that the paths of certificates start from.

    Raises:
        MissingExtraError: eclipse-zenoh is not installed.
        BadInputError: an endpoint cannot be listened on or reached, a certificate is missing or wrong.
    """
    try:
        import zenoh
    except ImportError as e:
        hint = "; run: pip install 'foreshock[zenoh]'"
        raise MissingExtraError("link", f"{e.name} is not installed", hint) from e
    config = zenoh.Config()
    for key, value in _options(link, base or Path()).items():
        config.insert_json5(key, json.dumps(value))
    try:
        return zenoh.open(config)
    except zenoh.ZError as e:
        where = ", ".join((*link.listen, *link.connect))
        why = str(e).partition(" at /")[0].strip()  # what follows is a place in Zenoh's sources
        hint = "; does a supervisor run there? foreshock run starts one" if link.mode == "client" else ""
        raise BadInputError("link", f"cannot be opened on {where}: {why}", hint) from None


def ros_tokens(session: Any, keys: Keys, kind: Literal["MP", "MS"], channels: Mapping[str, str]) -> list[Any]:
    """Tokens by which ROS 2 nodes on rmw_zenoh see a node ``foreshock`` with its topics; none in our own scheme.

    Args:
        session: open.
        keys: of the robot.
        kind: publisher (MP) or subscription (MS).
        channels: ROS 2 type, by channel.
    """
    if keys.naming != "rmw_zenoh":
        return []
    zid, node = str(session.zid()), "foreshock"
    tokens = [liveliness_token(keys.domain, zid, 0, 0, "NN", node)]
    tokens += [
        liveliness_token(keys.domain, zid, 0, k, kind, node, f"/{channel}", ros)
        for k, (channel, ros) in enumerate(sorted(channels.items()), 1)
    ]
    return [session.liveliness().declare_token(token) for token in tokens]


def _options(link: LinkSettings, base: Path) -> dict[str, Any]:
    options: dict[str, Any] = {
        "mode": link.mode,
        "listen/endpoints": list(link.listen),
        "connect/endpoints": list(link.connect),
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": False,
        "transport/link/tx/lease": round(link.lease_s * 1000),
        "transport/link/rx/max_message_size": 4_194_304,
    }
    if link.mode == "router":
        # a long answer waits no longer (us) for a peer that takes nothing
        options["transport/link/tx/queue/congestion_control/drop/max_wait_before_drop_fragments"] = 5_000
    if link.mode == "peer":
        options["connect/exit_on_failure"] = False
        options["connect/timeout_ms"] = -1
    if link.tls.ca:
        tls = {n: _file(base, f"link.tls.{n}", getattr(link.tls, n)) for n in ("ca", "certificate", "key")}
        options |= {
            "transport/link/tls/root_ca_certificate": tls["ca"],
            "transport/link/tls/listen_certificate": tls["certificate"],
            "transport/link/tls/listen_private_key": tls["key"],
            "transport/link/tls/connect_certificate": tls["certificate"],
            "transport/link/tls/connect_private_key": tls["key"],
            "transport/link/tls/enable_mtls": True,
            "transport/link/tls/verify_name_on_connect": link.tls.verify_name,
        }
    if link.access:
        options["access_control"] = _access(link.access)
    return options


def _file(base: Path, place: str, name: str) -> str:
    path = base / name
    if not path.is_file():
        raise BadInputError(place, f"there is no file {str(path)!r}", "; make one with: foreshock security init")
    return str(path.resolve())


def _access(rules: tuple[AccessRule, ...]) -> dict[str, Any]:
    """Zenoh's access control: denied by default; everybody may read; writing, asking and answering by name."""
    reading = ["declare_subscriber", "liveliness_query", "declare_liveliness_subscriber", "reply"]
    everything = ["**", "foreshock/*/@/**", "@ros2_lv/**"]  # no wildcard meets a chunk that begins with @
    # a denial outweighs any permission; the supervisor's own session does not come in over a link
    own = {**_rule("own", ["put", "delete"], [f"foreshock/*/@/{s}" for s in OWN], ["ingress"]), "permission": "deny"}
    out: list[dict[str, Any]] = [
        own,
        _rule("read", reading, everything, ["ingress", "egress"]),
        # what may come in may go on to everybody: the check is where it enters
        _rule("deliver", ["put", "delete", "query", "liveliness_token", "declare_queryable"], everything, ["egress"]),
    ]
    subjects, policies = [], []
    for k, rule in enumerate(rules):
        mine = ["own", "read", "deliver"]
        if rule.write:
            out.append(_rule(f"write-{k}", ["put", "delete", "liveliness_token"], list(rule.write), ["ingress"]))
            mine.append(f"write-{k}")
        if rule.ask:
            out.append(_rule(f"ask-{k}", ["query"], list(rule.ask), ["ingress"]))
            mine.append(f"ask-{k}")
        if rule.answer:
            out.append(_rule(f"answer-{k}", ["declare_queryable"], list(rule.answer), ["ingress"]))
            mine.append(f"answer-{k}")
        subjects.append({"id": f"subject-{k}", "cert_common_names": [rule.name]})
        policies.append({"rules": mine, "subjects": [f"subject-{k}"]})
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": out,
        "subjects": subjects,
        "policies": policies,
    }


def _rule(name: str, messages: list[str], keys: list[str], flows: list[str]) -> dict[str, Any]:
    return {"id": name, "messages": messages, "key_exprs": keys, "flows": flows, "permission": "allow"}
