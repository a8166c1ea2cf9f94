"""Who was turned away: read from Zenoh's log, since it tells nobody else.

Zenoh's Python package has no call-back for it. Its log goes to the process's standard output, file descriptor 1: that
is replaced by a pipe, and what Python itself prints goes on to where it went before. Three lines are known, of Zenoh
1.10: a TLS handshake that failed (the reason, no address), a certificate that no access rule names, and a message that
access control denied. Other lines go on to standard error, those of permitted messages excepted.

A peer with a certificate could make up a line, by a key with a line break in it: the counts are for people, and
nothing is decided by them. The supervisor never waits for any of this: a full pipe loses lines, and a reader that fails
puts the output back.
"""

from __future__ import annotations

import fcntl
import os
import re
import sys
import threading
from collections.abc import Callable, Mapping
from typing import Any

import msgspec

from foreshock.clock import NS_PER_S, monotonic_ns
from foreshock.link import LinkSettings

__all__ = ["Denied", "DeniedPeers", "Refused", "watch_log"]

FILTER = "warn,zenoh_link_tls=debug,zenoh::net::routing::interceptor::access_control=trace"
PIPE_BYTES = 1 << 20
AT_ONCE = 1 << 14
"""Bytes read in one go: the interpreter does nothing else while it searches them."""
PERIOD_S = 0.05
MOST = 64
MOST_KEY = 160
MOST_JUDGED = 9
"""Lines of one survey, see SURVEY."""
COLOURS = re.compile(rb"\x1b\[[0-9;]*m")
DENIED = re.compile(
    r"(?P<thread>ThreadId\(\d+\)).*access_control: (?P<cached>Using cached result: )?(?P<zid>[0-9a-f]{1,32})"
    r"(?: on (?:.*?CertCommonName\((?P<name>[^)]*)\))?.*?)? is unauthorized to (?P<what>[^(]+) \(ingress\)"
    r" on (?P<key>.*)"
)
UNKNOWN = re.compile(r"access_control: (?P<zid>[0-9a-f]{1,32}) did not match any configured ACL subject")
SURVEY = re.compile(
    r"(?P<thread>ThreadId\(\d+\)).*access_control: ACL \((?P<flow>ingress|egress)\): caching permissions"
)
"""A peer declared a key: Zenoh judges everything that might be done with it, first in, then out; nothing was tried."""
REFUSED = re.compile(r"zenoh_link_tls\S*: (?P<reason>.*)\. Hint: increase the system open file limit")
OURS = (b"access_control:", b"zenoh_link_tls::unicast: Accepted")
"""Lines that only the filter above asks for."""


class Denied(msgspec.Struct, frozen=True):
    """What one peer tried and may not.

    Attributes:
        name: in its certificate; empty if it left before it could be looked up.
        zid: its Zenoh id.
        what: ``Put``, ``Query``, ``Liveliness Token``, ...; ``anything`` where no access rule names the certificate.
        key: key expression that it tried it on.
        count: how often.
        age_s: since the last time.
    """

    name: str
    zid: str
    what: str
    key: str
    count: int
    age_s: float


class Refused(msgspec.Struct, frozen=True):
    """Connections that did not come about: the reason, as TLS says it, how often, and since the last (s)."""

    reason: str
    count: int
    age_s: float


class DeniedPeers:
    """Counts what was denied, from lines of the log; at most 64 of a kind, the ones that are longest ago make room.

    Attributes:
        names: gives the certificates' names of connected peers by Zenoh id; a denial out of Zenoh's cache lacks them.
        fault: why counts are not complete; empty if they are.
    """

    def __init__(self) -> None:
        self.names: Callable[[], Mapping[str, str]] = dict
        self.fault = ""
        self._lock = threading.Lock()
        self._known: dict[str, str] = {}
        self._surveys: dict[str, int] = {}
        self._denied: dict[tuple[str, str, str], tuple[int, int]] = {}
        self._refused: dict[str, tuple[int, int]] = {}

    def take(self, line: str, now_ns: int) -> bool:
        """Count what a line tells; whether it told anything."""
        if found := DENIED.search(line):
            self._name(found["zid"], found["name"] or "")
            if not found["cached"] and (left := self._surveys.pop(found["thread"], 0)):
                self._surveys[found["thread"]] = left - 1
                return True
            self._count(self._denied, (found["zid"], found["what"], found["key"].strip()[:MOST_KEY]), now_ns)
        elif found := SURVEY.search(line):
            self._surveys.pop(found["thread"], None)
            if found["flow"] == "ingress":
                self._surveys[found["thread"]] = MOST_JUDGED
                if len(self._surveys) > MOST:
                    del self._surveys[next(iter(self._surveys))]
        elif found := UNKNOWN.search(line):
            self._name(found["zid"], "")
            self._count(self._denied, (found["zid"], "anything", ""), now_ns)
        elif found := REFUSED.search(line):
            self._count(self._refused, found["reason"][:MOST_KEY], now_ns)
        else:
            return False
        return True

    def denied(self, now_ns: int) -> tuple[Denied, ...]:
        """Of peers with a certificate, the latest first."""
        with self._lock:
            rows = sorted(self._denied.items(), key=lambda row: -row[1][1])
            return tuple([Denied(self._known.get(k[0], ""), *k, n, (now_ns - at) / NS_PER_S) for k, (n, at) in rows])

    def refused(self, now_ns: int) -> tuple[Refused, ...]:
        """Of peers without, the latest first."""
        with self._lock:
            rows = sorted(self._refused.items(), key=lambda row: -row[1][1])
            return tuple([Refused(reason, n, (now_ns - at) / NS_PER_S) for reason, (n, at) in rows])

    def _name(self, zid: str, name: str) -> None:
        name = name or self._known.get(zid, "") or self.names().get(zid, "")
        with self._lock:
            self._known.pop(zid, None)
            self._known[zid] = name
            if len(self._known) > MOST:
                del self._known[next(iter(self._known))]

    def _count(self, table: dict[Any, tuple[int, int]], key: Any, now_ns: int) -> None:
        with self._lock:
            before, _ = table.pop(key, (0, 0))
            table[key] = (before + 1, now_ns)
            if len(table) > MOST:
                del table[next(iter(table))]


def watch_log(link: LinkSettings) -> DeniedPeers | None:
    """Begin to read Zenoh's log; None where everybody may do everything, so that nothing is denied.

    For the program that owns the process, before its first session.
    """
    if not link.tls.ca:
        return None
    import zenoh

    denied = DeniedPeers()
    told = os.environ.get("RUST_LOG")
    if told:
        os.environ["RUST_LOG"] = f"{told},{FILTER.partition(',')[2]}"
    sys.stdout.flush()
    real = os.dup(1)
    sys.stdout = os.fdopen(os.dup(1), "w", buffering=1, encoding=sys.stdout.encoding, errors=sys.stdout.errors)
    reading, writing = os.pipe()
    # whoever writes never waits: what does not fit is lost
    os.set_blocking(writing, False)
    os.set_blocking(reading, False)
    if hasattr(fcntl, "F_SETPIPE_SZ"):
        fcntl.fcntl(writing, fcntl.F_SETPIPE_SZ, PIPE_BYTES)
    os.dup2(writing, 1)
    os.close(writing)
    threading.Thread(target=_read, args=(denied, reading, real), name="foreshock-log", daemon=True).start()
    zenoh.init_log_from_env_or(FILTER)
    return denied


def _read(denied: DeniedPeers, reading: int, real: int) -> None:
    pause, rest, taken = threading.Event(), b"", 0
    try:
        while True:
            try:
                data = os.read(reading, AT_ONCE)
            except BlockingIOError:
                taken = 0
                pause.wait(PERIOD_S)
                continue
            taken = taken + len(data) if len(data) == AT_ONCE else 0
            if taken >= PIPE_BYTES:
                denied.fault = "more is denied than can be counted: lines of Zenoh's log were lost"
            *lines, rest = (rest + data).split(b"\n")
            rest = rest[-AT_ONCE:]
            _lines(denied, lines)
            pause.wait(PERIOD_S if len(data) < AT_ONCE else 0.001)
    except Exception as e:  # noqa: BLE001 # whatever it is: the output goes back, the supervisor goes on
        denied.fault = f"what is denied is no longer counted: {type(e).__name__}: {e}"
        os.dup2(real, 1)


def _lines(denied: DeniedPeers, lines: list[bytes]) -> None:
    now_ns = monotonic_ns()
    for raw in lines:
        if b" is authorized to " in raw:
            continue
        line = COLOURS.sub(b"", raw)
        if not denied.take(line.decode(errors="replace"), now_ns) and not any(mark in line for mark in OURS):
            os.write(2, raw + b"\n")
