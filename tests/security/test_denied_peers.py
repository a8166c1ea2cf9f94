"""What is read from Zenoh's log, in bounded memory, and a supervisor that never waits for it."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from foreshock.live import DeniedPeers, init_security

ZID, NAMED = "82c75891c84edb1d8964f88642aa0afb", "Interface(lo)+CertCommonName(scene of camera 1)+Transport(Tls)"
AT = "2026-11-26T06:38:45.133783Z TRACE  rx-1 ThreadId(12) "
CONTROL = AT + "zenoh::net::routing::interceptor::access_control: "
TLS = AT + "zenoh_link_tls::unicast: "
HINT = ". Hint: increase the system open file limit."


def denial(key: str, zid: str = ZID, flow: str = "ingress") -> str:
    return f"{CONTROL}{zid} on {NAMED}+{zid} is unauthorized to Put ({flow}) on {key}"


def test_a_denial_is_counted_by_peer_and_key() -> None:
    peers = DeniedPeers()
    for at_ns in (1_000_000_000, 2_000_000_000):
        assert peers.take(denial("foreshock/robot/@/lease"), at_ns)
    assert peers.take(denial("foreshock/robot/imu/state"), 3_000_000_000)
    latest, before = peers.denied(5_000_000_000)
    assert (latest.name, latest.zid, latest.what, latest.key) == (
        "scene of camera 1",
        ZID,
        "Put",
        "foreshock/robot/imu/state",
    )
    assert (before.key, before.count, before.age_s) == ("foreshock/robot/@/lease", 2, 3.0)


def test_what_goes_out_to_nobody_is_no_attempt() -> None:
    peers = DeniedPeers()
    assert not peers.take(denial("foreshock/robot/@/lease", flow="egress"), 0)
    assert not peers.take(f"{CONTROL}{ZID} on {NAMED}+{ZID} is authorized to Put (ingress) on a/b", 0)
    assert peers.denied(0) == ()


def test_a_peer_whose_name_the_line_lacks_is_looked_up_among_those_connected() -> None:
    peers = DeniedPeers()
    peers.names = lambda: {"ab": "supervisor"}
    peers.take(f"{CONTROL}ab did not match any configured ACL subject. Default permission `Deny` will be applied", 0)
    peers.take(f"{CONTROL}Using cached result: ab is unauthorized to Put (ingress) on a/b", 0)
    assert {(d.name, d.what) for d in peers.denied(0)} == {("supervisor", "anything"), ("supervisor", "Put")}


@pytest.mark.parametrize("reason", ["received fatal alert: UnknownCA", "peer sent no certificates"])
def test_a_connection_that_did_not_come_about_is_counted_by_reason(reason: str) -> None:
    peers = DeniedPeers()
    for at_ns in (0, 1_000_000_000):
        peers.take(TLS + reason + HINT, at_ns)
    (refused,) = peers.refused(3_000_000_000)
    assert (refused.reason, refused.count, refused.age_s) == (reason, 2, 2.0)


def test_peers_that_invent_keys_and_names_fill_no_memory() -> None:
    peers = DeniedPeers()
    for k in range(10_000):
        peers.take(denial(f"a/{k}/{'x' * 500}", f"{k:032x}"), k)
        peers.take(f"{TLS}reason {k}{HINT}", k)
        peers.take(
            f"{AT.replace('12', str(k + 20))}access_control: ACL (ingress): caching permissions for `a/{k}` ...", k
        )
    assert len(peers.denied(0)) == len(peers.refused(0)) == 64
    assert max(len(d.key) for d in peers.denied(0)) < 200
    assert all(len(v) <= 64 for v in vars(peers).values() if isinstance(v, dict | set))


READ = """
import os, sys, threading, time
from pathlib import Path
import foreshock.live._denied as d
from foreshock.link import LinkSettings, TlsSettings
if sys.argv[2] == "dead":
    def broken(*_): raise RuntimeError("broken")
    d._lines = broken
elif sys.argv[2] == "stuck":
    d._read = lambda *_: threading.Event().wait()
c = Path(sys.argv[1])
tls = TlsSettings(str(c / "ca.pem"), str(c / "supervisor.pem"), str(c / "supervisor.key.pem"))
peers = d.watch_log(LinkSettings(listen=("tls/127.0.0.1:0",), tls=tls))
print("by Python, before")
line = b"ThreadId(1) zenoh_link_tls::unicast: no certificate. Hint: increase the system open file limit\\n"
lost = 0
for _ in range(40_000):  # as Zenoh does: straight to the descriptor
    try:
        os.write(1, line)
    except BlockingIOError:
        lost += 1
os.write(1, b"ERROR something else\\n") if not lost else None
end = time.monotonic() + 20
while not lost and not peers.fault and time.monotonic() < end and sum(r.count for r in peers.refused(0)) < 40_000:
    time.sleep(0.05)
time.sleep(0.2)
print("by Python, after")
print(f"lost={lost > 0} fault={peers.fault!r} counted={sum(r.count for r in peers.refused(0)) > 0}")
"""


@pytest.mark.parametrize("reader", ["alive", "dead", "stuck"])
def test_a_log_that_nobody_reads_stops_nothing(tmp_path: Path, reader: str) -> None:
    """4 MB of it, four times what the pipe holds: what does not fit is lost, and Python's own output is not touched."""
    init_security(tmp_path / "c", "robot", {})
    words = [sys.executable, "-c", READ, str(tmp_path / "c"), reader]
    done = subprocess.run(words, capture_output=True, text=True, timeout=60, check=True)
    assert "by Python, before" in done.stdout
    *_, after, last = done.stdout.splitlines()
    assert after == "by Python, after"
    if reader == "alive":
        assert "counted=True" in last
    elif reader == "dead":
        assert "no longer counted: RuntimeError: broken" in last
    else:
        assert last.startswith("lost=True")


def test_the_configuration_says_nothing_without_certificates(tmp_path: Path) -> None:
    code = "import foreshock.live as l, foreshock.link as k, json; print(json.dumps(l.watch_log(k.LinkSettings())))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert json.loads(done.stdout) is None
