"""``foreshock doctor``: is everything here that a supervisor needs?"""

from __future__ import annotations

import importlib.metadata as md
import importlib.util
import shutil
import statistics
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import click
import msgspec

from foreshock.cli._certificates import certificates, common_name
from foreshock.cli._finding import Finding
from foreshock.cli.output import NEGATIVE, OK, emit, table
from foreshock.cli.top_cmd import ask
from foreshock.clock import NS_PER_S, monotonic_ns, sleep_until
from foreshock.errors import BadInputError, ForeshockError
from foreshock.link import LinkSettings, keys_of, open_link
from foreshock.live import RunConfig, Status, StreamCounts, load_run
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
COUNTED_S = 1.0
"""Samples are counted for so long, as a detector's least rate is."""
FAULTS = ("garbage", "mistyped", "not_finite", "foreign", "repeated", "disordered", "backwards", "unbelieved")
"""What is counted of samples that are not as they should be; while such come, a stream is not fine."""


@click.command()
@click.argument("config", required=False, type=click.Path(path_type=Path, exists=True, dir_okay=False))
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def doctor(config: Path | None, as_json: bool) -> int:
    """Check extras, compiler, plugins and clock; with a run's CONFIG also its detectors, link, certificates and rates.

    Exit code 1 if something that is needed is missing, or a supervisor that runs there is not well.
    """
    findings = [*_extras(), _compiler(), _plugins(), _clock()]
    if config is not None:
        run = load_run(config)
        configured, rates = _configured(run, config.parent)
        findings += [configured, *certificates(run.link, config.parent), *_link(run, config.parent, rates)]
    if as_json:
        emit(findings)
    else:
        marks = {True: "ok", False: "NOT OK", None: "–"}
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


def _configured(run: RunConfig, base: Path) -> tuple[Finding, dict[str, float]]:
    """Whether the supervisor can be built, and the least rate (Hz) by channel that its detectors need."""
    rates: dict[str, float] = {}

    def build() -> str:
        supervisor = Supervisor(run.config, base)
        try:
            for i in supervisor.inputs():
                rates[i.channel] = max(i.min_rate_hz, rates.get(i.channel, 0.0))
            return f"{len(supervisor.detectors)} detectors on {len({c for c, _ in supervisor.channels()})} channels"
        finally:
            supervisor.close()

    return _guarded("configuration", build), rates


def _link(run: RunConfig, base: Path, rates: Mapping[str, float]) -> Iterator[Finding]:
    """A supervisor that runs there is asked, if it lets us; otherwise its endpoints are tried."""
    link, robot = run.link, run.config.supervisor.robot
    key = keys_of(link, robot).service("status")
    where = [e.replace("/0.0.0.0:", "/127.0.0.1:").replace("/[::]:", "/[::1]:") for e in link.listen[:1]]
    client = LinkSettings("client", (), tuple(where) or link.connect, link.remote, tls=link.tls)
    session: Any = None
    # who asks without a rule for it is shown as turned away
    if not (unasked := _unasked(link, base, key)):
        with suppress(ForeshockError):
            session = open_link(client, base)
    if session is None:

        def listen() -> str:
            try:
                mine: Any = open_link(link, base)
            except BadInputError as e:
                raise BadInputError(e.place, e.problem, f"{e.hint}{unasked}") from None
            mine.close()
            return f"free: {', '.join(link.listen)}"

        yield _guarded("link", listen)
        return
    try:
        began_ns = monotonic_ns()
        before = msgspec.json.decode(ask(session, key), type=Status)
        asked_ns = monotonic_ns()
        yield Finding("link", True, f"a supervisor of {robot} answers in {(asked_ns - began_ns) / 1e6:.1f} ms")
        sleep_until(asked_ns + round(COUNTED_S * NS_PER_S))
        status = msgspec.json.decode(ask(session, key), type=Status)
        yield from _state(before, status, (monotonic_ns() - asked_ns) / NS_PER_S, rates)
    except ForeshockError as e:
        yield Finding("link", False, str(e))
    finally:
        session.close()


def _unasked(link: LinkSettings, base: Path, key: str) -> str:
    """Why the supervisor's certificate may not ask for the status; empty if it may."""
    if not link.access:
        return ""
    try:
        import zenoh
    except ImportError:
        return ""  # opening the link says so
    try:
        name = common_name(link, base)
        mine = [zenoh.KeyExpr(k) for rule in link.access if rule.name == name for k in rule.ask]
    except (OSError, ValueError, zenoh.ZError) as e:
        return f"; a supervisor there was not asked: {e}"
    if any(k.includes(zenoh.KeyExpr(key)) for k in mine):
        return ""
    return f"; a supervisor there was not asked: no access rule lets {name!r} ask {key}; add one to [[link.access]]"


def _state(before: Status, now: Status, counted_s: float, rates: Mapping[str, float]) -> Iterator[Finding]:
    """What the supervisor says of itself and of each stream, and the rates between two answers."""
    yield Finding("motion", not now.withheld, f"withheld: {now.withheld}" if now.withheld else "nothing withholds it")
    for channel, s in now.streams.items():
        c = s.counts
        last = before.streams[channel].counts if channel in before.streams else StreamCounts()
        n, need = c.samples - last.samples, rates.get(channel, 0.0)
        said = [
            f"{n / counted_s:.0f} a second" + ("" if s.source_age_s is None else f", {s.source_age_s * 1e3:.0f} ms old")
        ]
        if slow := (n + 1) / counted_s < need:  # one more may have been on its way
            said.append(f"at least {need:g} are needed")
        if silent := s.arrival_age_s is None or s.arrival_age_s > SILENT_S:
            said.append(f"silent for more than {SILENT_S:g} s")
        counted = {f: getattr(c, f) - getattr(last, f) for f in FAULTS}
        said += [f"{k} {fault}" for fault, k in counted.items() if k]
        if c.last_fault:
            said.append(c.last_fault)
        yield Finding(channel, not (slow or silent or any(counted.values())), "; ".join(said))
    for source, why in now.health.items():
        # a fault of the link stays until the end: whether there are more of them was counted above
        if source not in now.streams or why != f"link: {now.streams[source].counts.last_fault}":
            yield Finding(f"health of {source}", False, why)
