"""A development certificate authority, certificates for everybody by name, and the access rules that go with them.

For development and tests: whoever can read the folder can be anybody. A plant uses an authority of its own, same names.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import tomli_w

from foreshock.errors import BadInputError, ConfigError, MissingExtraError
from foreshock.link import AccessRule
from foreshock.wire import Keys, Naming

__all__ = ["QUESTIONS", "access_rules", "init_security"]

SUPERVISOR, OPERATOR, VIEWER = "supervisor", "operator", "viewer"
QUESTIONS = ("status", "taxonomy", "config", "history")
AUTHORITY = "ca"
MOST_NAME = 64
LOOPBACK = ("localhost", "127.0.0.1", "::1")


def access_rules(
    robot: str, twins: Mapping[str, Sequence[str]], naming: Naming = "foreshock", domain: int = 0
) -> tuple[AccessRule, ...]:
    """Who may do what: the robot writes its channels, a twin its own ones, an operator may reset; all may read.

    What only the supervisor writes (lease, intervention, decision) nobody else may: see foreshock.link. Another
    session with the supervisor's certificate may ask for the status, as foreshock doctor does, and nothing else.

    Args:
        robot: whose channels and services they are; also the name of its certificate.
        twins: channels below the robot's (key expressions) that each twin may write, by name of its certificate.
        naming: key scheme of the streams.
        domain: ROS domain id, of rmw_zenoh's scheme.
    """
    root = f"foreshock/{robot}"
    # rmw_zenoh's keys end in type and hash; its liveliness tokens announce nodes and topics to ROS 2
    streams, end = (f"{domain}/{robot}", "/*/*") if naming == "rmw_zenoh" else (root, "")
    tokens = (f"@ros2_lv/{domain}/**",) if naming == "rmw_zenoh" else ()
    ask = tuple(f"{root}/@/{q}" for q in QUESTIONS)
    guard = tuple(f"{root}/@/{what}" for what in ("lease_request", "ack", "alive/guard/**", "alive/twin/**"))
    # what is asked of the supervisor it alone may answer; a twin answers what is asked of itself
    answer = (f"{root}/@/twin/*",)
    rules = [AccessRule(robot, (f"{streams}/*/*{end}", *tokens, *guard), ask, answer)]
    rules += [
        AccessRule(name, (*(f"{streams}/{c}{end}" for c in channels), *tokens, f"{root}/@/alive/twin/**"), ask, answer)
        for name, channels in twins.items()
    ]
    rules.append(AccessRule(OPERATOR, (f"{root}/@/alive/operator/**",), (*ask, f"{root}/@/reset")))
    rules.append(AccessRule(VIEWER, (), ask))
    rules.append(AccessRule(SUPERVISOR, (), (f"{root}/@/status",)))
    return tuple(rules)


def init_security(
    folder: Path,
    robot: str,
    twins: Mapping[str, Sequence[str]],
    hosts: Sequence[str] = (),
    naming: Naming = "foreshock",
    domain: int = 0,
) -> list[Path]:
    """Write authority, certificates, keys, and link.toml for the supervisor; the files.

    Args:
        folder: new or empty.
        robot: see access_rules.
        twins: see access_rules.
        hosts: names and addresses at which the supervisor is dialled, beside this machine's loopback. No other
            certificate has them, so that nobody else passes for the supervisor there.
        naming: see access_rules.
        domain: see access_rules.

    Raises:
        BadInputError: the folder holds something already, a name is used twice or is no plain file name, a host is
            none, or a twin's channel is no key expression; nothing is written then.
        MissingExtraError: trustme or eclipse-zenoh is not installed.
    """
    try:
        import trustme
        import zenoh
    except ImportError as e:
        hint = "; run: pip install 'foreshock[zenoh]'"
        raise MissingExtraError("security", f"{e.name} is not installed", hint) from e
    names = [SUPERVISOR, robot, *twins, OPERATOR, VIEWER]
    for place, name in (("robot", robot), *(("twin", name) for name in twins)):
        _check_name(place, name, names)
    rules = access_rules(robot, twins, naming, domain)
    for rule in rules:
        for expression in rule.write:
            try:
                zenoh.KeyExpr(expression)
            except zenoh.ZError:
                problem, hint = f"{expression!r} is no key expression", "; a channel is e.g. humans/pose"
                raise ConfigError(f"twin {rule.name}", problem, hint) from None
    if folder.exists() and any(folder.iterdir()):
        raise BadInputError(str(folder), "is not empty; certificates are never overwritten")
    authority = trustme.CA(organization_name="Foreshock development")
    issued = {name: authority.issue_cert(*LOOPBACK, common_name=name) for name in names}
    try:
        issued[SUPERVISOR] = authority.issue_cert(*LOOPBACK, *hosts, common_name=SUPERVISOR)
    except ValueError as e:
        raise ConfigError("host", f"{', '.join(map(repr, hosts))}: {e}") from None
    folder.mkdir(parents=True, exist_ok=True)
    written = [folder / f"{AUTHORITY}.pem"]
    authority.cert_pem.write_to_path(str(written[0]))
    for name, certificate in issued.items():
        key, chain = folder / f"{name}.key.pem", folder / f"{name}.pem"
        key.touch(mode=0o600)
        certificate.private_key_pem.write_to_path(str(key))
        chain.write_bytes(b"".join(blob.bytes() for blob in certificate.cert_chain_pems))
        written += [chain, key]
    link = {
        "link": {
            "listen": ["tls/127.0.0.1:7447"],
            "naming": naming,
            "domain": domain,
            "tls": {"ca": f"{AUTHORITY}.pem", "certificate": f"{SUPERVISOR}.pem", "key": f"{SUPERVISOR}.key.pem"},
            "access": [
                {"name": r.name, "write": list(r.write), "ask": list(r.ask), "answer": list(r.answer)} for r in rules
            ],
        }
    }
    path = folder / "link.toml"
    path.write_text(tomli_w.dumps(link))
    return [*written, path]


def _check_name(place: str, name: str, names: Sequence[str]) -> None:
    """A name is a certificate's common name (at most 64 characters), part of a file's and of a key expression.

    Raises:
        ConfigError: it cannot be, or two peers would have the same files.
    """
    if name.startswith(".") or "\\" in name or not name.isprintable() or len(name) > MOST_NAME:
        hint = f"; at most {MOST_NAME} printable characters, without / and \\, not beginning with a dot"
        raise ConfigError(place, f"{name!r} cannot be the name of a file and a certificate", hint)
    try:
        Keys(name)
    except ConfigError as e:
        raise ConfigError(place, e.problem) from None
    if names.count(name) > 1:
        raise ConfigError(place, f"{name!r} is the name of two peers")
    if name == AUTHORITY or (name.endswith(".key") and name.removesuffix(".key") in names):
        raise ConfigError(place, f"{name!r} would take the file {name}.pem of another")
