"""A development certificate authority, certificates for everybody by name, and the access rules that go with them.

For development and tests: whoever can read the folder can be anybody. A plant uses an authority of its own, same names.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import tomli_w

from foreshock.errors import BadInputError, MissingExtraError
from foreshock.link import AccessRule

__all__ = ["QUESTIONS", "access_rules", "init_security"]

SUPERVISOR, OPERATOR, VIEWER = "supervisor", "operator", "viewer"
QUESTIONS = ("status", "taxonomy", "config", "history")
HOSTS = ("localhost", "127.0.0.1", "::1")


def access_rules(robot: str, twins: Mapping[str, Sequence[str]]) -> tuple[AccessRule, ...]:
    """Who may do what: the robot writes its channels, a twin its own ones, an operator may reset; all may read.

    What only the supervisor writes (lease, intervention, decision) nobody else may: see foreshock.link.

    Args:
        robot: whose channels and services they are; also the name of its certificate.
        twins: channels below the robot's (key expressions) that each twin may write, by name of its certificate.
    """
    root = f"foreshock/{robot}"
    ask = tuple(f"{root}/@/{q}" for q in QUESTIONS)
    guard = tuple(f"{root}/@/{what}" for what in ("lease_request", "ack", "alive/guard/**", "alive/twin/**"))
    robot_writes = (f"{root}/*/*", *guard)
    # what is asked of the supervisor it alone may answer; a twin answers what is asked of itself
    answer = (f"{root}/@/twin/*",)
    rules = [AccessRule(robot, robot_writes, ask, answer)]
    rules += [
        AccessRule(name, (*(f"{root}/{c}" for c in channels), f"{root}/@/alive/twin/**"), ask, answer)
        for name, channels in twins.items()
    ]
    rules.append(AccessRule(OPERATOR, (f"{root}/@/alive/operator/**",), (*ask, f"{root}/@/reset")))
    rules.append(AccessRule(VIEWER, (), ask))
    return tuple(rules)


def init_security(
    folder: Path, robot: str, twins: Mapping[str, Sequence[str]], hosts: Sequence[str] = HOSTS
) -> list[Path]:
    """Write authority, certificates, keys, and link.toml for the supervisor; the files.

    Raises:
        BadInputError: the folder holds something already, or a name is used twice.
        MissingExtraError: trustme is not installed.
    """
    try:
        import trustme
    except ImportError as e:
        hint = "; run: pip install 'foreshock[zenoh]'"
        raise MissingExtraError("security", f"{e.name} is not installed", hint) from e
    names = [SUPERVISOR, robot, *twins, OPERATOR, VIEWER]
    for name in names:
        if names.count(name) > 1:
            raise BadInputError("security", f"{name!r} is the name of two peers")
    if folder.exists() and any(folder.iterdir()):
        raise BadInputError(str(folder), "is not empty; certificates are never overwritten")
    folder.mkdir(parents=True, exist_ok=True)
    authority = trustme.CA(organization_name="Foreshock development")
    written = [folder / "ca.pem"]
    authority.cert_pem.write_to_path(str(written[0]))
    for name in names:
        issued = authority.issue_cert(*hosts, common_name=name)
        key, chain = folder / f"{name}.key.pem", folder / f"{name}.pem"
        key.touch(mode=0o600)
        issued.private_key_pem.write_to_path(str(key))
        chain.write_bytes(b"".join(blob.bytes() for blob in issued.cert_chain_pems))
        written += [chain, key]
    link = {
        "link": {
            "listen": ["tls/127.0.0.1:7447"],
            "tls": {"ca": "ca.pem", "certificate": f"{SUPERVISOR}.pem", "key": f"{SUPERVISOR}.key.pem"},
            "access": [
                {"name": r.name, "write": list(r.write), "ask": list(r.ask), "answer": list(r.answer)}
                for r in access_rules(robot, twins)
            ],
        }
    }
    path = folder / "link.toml"
    path.write_text(tomli_w.dumps(link))
    return [*written, path]
