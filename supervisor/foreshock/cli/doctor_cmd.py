"""``foreshock doctor``: is everything here that a supervisor needs?"""

from __future__ import annotations

import importlib.metadata as md
import importlib.util
import shutil
import statistics
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import click
import msgspec

from foreshock.cli.output import NEGATIVE, OK, emit, table
from foreshock.cli.top_cmd import ask
from foreshock.clock import NS_PER_S, monotonic_ns, sleep_until, wall_ns
from foreshock.errors import ForeshockError
from foreshock.link import LinkSettings, keys_of, open_link
from foreshock.live import RunConfig, Status, load_run
from foreshock.registry import Registry
from foreshock.supervisor import Supervisor

__all__ = ["doctor"]

EXTRAS = {
    "balance": ("pinocchio",),
    "proximity": ("fcl", "pinocchio"),
    "grip": ("filterpy",),
    "fmi": ("fmpy",),
    "mujoco": ("mujoco", "pinocchio", "av", "PIL"),
    "zenoh": ("zenoh", "mcap", "rosbags"),
    "report": ("jinja2", "matplotlib"),
    "analysis": ("SALib", "sklearn", "statsmodels", "pyarrow"),
    "campaign": ("jinja2", "matplotlib", "pyarrow", "scipy", "sklearn"),
}
COMPILERS = ("cc", "gcc", "clang")

SILENT_S = 1.0
"""No robot streams more slowly."""


class Finding(msgspec.Struct, frozen=True):
    """One check: what, whether it is fine (None: it does not matter here), and what was found."""

    what: str
    fine: bool | None
    found: str


@click.command()
@click.argument("config", required=False, type=click.Path(path_type=Path, exists=True, dir_okay=False))
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def doctor(config: Path | None, as_json: bool) -> int:
    """Check extras, compiler, plugins and clock; with a run's CONFIG also its detectors, link, certificates and rates.

    Exit code 1 if something that is needed is missing.
    """
    findings = [*_extras(), _compiler(), _plugins(), _clock()]
    if config is not None:
        run = load_run(config)
        findings += [*_configured(run, config.parent), *_certificates(run.link, config.parent)]
        findings += _link(run, config.parent)
    if as_json:
        emit(findings)
    else:
        marks = {True: "ok", False: "MISSING", None: "–"}
        rows = [(f.what, marks[f.fine], f.found) for f in findings]
        table("Doctor", "what", "state", "found", rows=rows)
    return NEGATIVE if any(f.fine is False for f in findings) else OK


def _extras() -> Iterator[Finding]:
    for extra, modules in EXTRAS.items():
        missing = [m for m in modules if importlib.util.find_spec(m) is None]
        found = f"lacks {', '.join(missing)}; pip install 'foreshock[{extra}]'" if missing else "installed"
        yield Finding(f"extra {extra}", None if missing else True, found)


def _compiler() -> Finding:
    for name in COMPILERS:
        if path := shutil.which(name):
            return Finding("C compiler, for plants in C", True, path)
    if importlib.util.find_spec("ziglang") is not None:
        return Finding("C compiler, for plants in C", True, "ziglang")
    return Finding("C compiler, for plants in C", None, "none; apt install gcc libc6-dev, or pip install ziglang")


def _plugins() -> Finding:
    broken = Registry().load_all()
    names = "; ".join(f"{b.name}: {b.reason}" for b in broken)
    return Finding("plugins", not broken, names or f"all load, of foreshock {md.version('foreshock')}")


def _clock() -> Finding:
    """How late a sleep ends: a supervisor's tick comes that late."""
    late = []
    for _ in range(50):
        until_ns = monotonic_ns() + 2_000_000
        sleep_until(until_ns)
        late.append((monotonic_ns() - until_ns) / 1e6)
    resolution = time.get_clock_info("monotonic").resolution
    found = f"a sleep ends {statistics.median(late):.2f} ms late, {max(late):.2f} at worst; resolution {resolution:g} s"
    return Finding("clock", statistics.median(late) < 5.0, found)


def _guarded(what: str, check: Callable[[], str]) -> Finding:
    try:
        return Finding(what, True, check())
    except ForeshockError as e:
        return Finding(what, False, str(e))


def _configured(run: RunConfig, base: Path) -> Iterator[Finding]:
    def build() -> str:
        supervisor = Supervisor(run.config, base)
        try:
            return f"{len(supervisor.detectors)} detectors on {len({c for c, _ in supervisor.channels()})} channels"
        finally:
            supervisor.close()

    yield _guarded("configuration", build)


def _certificates(link: LinkSettings, base: Path) -> Iterator[Finding]:
    if not link.tls.ca:
        remote = link.remote
        yield Finding("certificates", False if remote else None, "none: anybody on this link may write anything")
        return
    from cryptography import x509

    for what, name in (("authority", link.tls.ca), ("certificate", link.tls.certificate)):
        path = base / name
        if not path.is_file():
            yield Finding(what, False, f"there is no file {str(path)!r}; foreshock security init makes one")
            continue
        try:
            certificate = x509.load_pem_x509_certificate(path.read_bytes())
        except ValueError as e:
            yield Finding(what, False, f"{path}: {e}")
            continue
        left = (certificate.not_valid_after_utc.timestamp() - wall_ns() / NS_PER_S) / 86400.0
        yield Finding(what, left > 0.0, f"{certificate.subject.rfc4514_string()}, valid for {left:.0f} days")


def _link(run: RunConfig, base: Path) -> Iterator[Finding]:
    """A supervisor that runs there is asked; otherwise its endpoints are tried."""
    link, robot = run.link, run.config.supervisor.robot
    client = LinkSettings("client", (), link.listen[:1] or link.connect, link.remote, tls=link.tls)
    try:
        session: Any = open_link(client, base)
    except ForeshockError:

        def listen() -> str:
            mine: Any = open_link(link, base)
            mine.close()
            return f"free: {', '.join(link.listen)}"

        yield _guarded("link", listen)
        return
    try:
        keys = keys_of(link, robot)
        began_ns = monotonic_ns()
        status = msgspec.json.decode(ask(session, keys.service("status")), type=Status)
        took_ms = (monotonic_ns() - began_ns) / 1e6
        yield Finding("link", True, f"a supervisor of {robot} answers in {took_ms:.1f} ms")
        for channel, s in status.streams.items():
            age = s.source_age_s
            rate = s.counts.samples / status.uptime_s if status.uptime_s else 0.0
            said = f"{rate:.0f} a second" + ("" if age is None else f", {age * 1e3:.0f} ms old")
            silent = s.arrival_age_s is None or s.arrival_age_s > SILENT_S
            said += f", silent for more than {SILENT_S:g} s" if silent else ""
            yield Finding(channel, not silent, said + (f"; {s.counts.last_fault}" if s.counts.last_fault else ""))
    except ForeshockError as e:
        yield Finding("link", False, str(e))
    finally:
        session.close()
