"""The live link: from a sample to an intervention, ticks that are sustained, and from a dead supervisor to standstill.

A supervisor in a process of its own, a robot here, real Zenoh sessions on loopback. Wall-clock times of a shared
machine: medians, beside a bare Zenoh ping-pong between two processes in the same run.
"""

from __future__ import annotations

import os
import signal
import socket
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import msgspec

from foreshock.errors import BadInputError
from foreshock.guard import Guard
from foreshock.link import LinkSettings, open_link
from foreshock.live import Status
from foreshock.messages import GripState, JointState
from foreshock.records import Intervention
from foreshock.wire import ROS_NAMES, Codec, Keys, pack_attachment
from tests.bench.rows import Row

__all__ = ["rows"]

KEYS = Keys("robot")
PERIOD_S = 0.005
TTL_S = 0.1
LINK = """
[link]
listen = ["ENDPOINT"]
[live]
ttl_s = 0.1
streams = { "joints/state" = "JointState", "left_gripper/state" = "GripState" }
"""
REORDER = (
    """
[supervisor]
robot = "robot"
period_s = 0.005
release_s = 0.01
[[detectors]]
use = "telemetry"
config = { hold_s = 0.02, reorder_window_s = 0.02 }
[window]
length_s = 0.1
[trust]
recovery_s = 0.01
[gates]
caution = 0.95
hysteresis = 0.0
dwell_s = 0.01
[[policies]]
use = "protocol"
config = { mode = "A9", caution = ["derate"], scale_speed = false }
"""
    + LINK
)
GRIP = (
    '[supervisor]\nrobot = "robot"\nperiod_s = 0.005\n[[detectors]]\nuse = "grip"\nstandstill_s = { grip = 0.0 }\n'
    + LINK
)
FAST = '[supervisor]\nrobot = "robot"\nperiod_s = 0.001\n[[detectors]]\nuse = "telemetry"\n' + LINK
ECHO = """
import sys, time
from foreshock.link import LinkSettings, open_link
s = open_link(LinkSettings("router", (sys.argv[1],)))
import zenoh
p = s.declare_publisher("pong", congestion_control=zenoh.CongestionControl.DROP, express=True)
q = s.declare_subscriber("ping", zenoh.handlers.RingChannel(16))
while True:
    p.put(q.recv().payload)
"""


def endpoint() -> str:
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{s.getsockname()[1]}"


def until(what: Callable[[], Any], seconds: float = 60.0) -> Any:
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if found := what():
            return found
        time.sleep(0.002)
    raise TimeoutError("the other process did not come up")


@contextmanager
def process(*words: str) -> Iterator[subprocess.Popen[bytes]]:
    child = subprocess.Popen([sys.executable, *words], stderr=subprocess.DEVNULL)
    try:
        yield child
    finally:
        if child.poll() is None:
            os.kill(child.pid, signal.SIGKILL)
        child.wait()


class Robot:
    """Streams one message over and over, and holds a guard."""

    def __init__(self, at: str, channel: str, message: Any, hz: float) -> None:
        link = LinkSettings("peer", (), (at,))
        self.told: list[tuple[float, Intervention]] = []
        self.stopped = threading.Event()
        self.jump_ns = 0
        self.guard = Guard("robot", self._take, lambda _: self.stopped.set(), link)
        self.session: Any = open_link(link)
        self._publisher = self.session.declare_publisher(KEYS.stream(channel, ROS_NAMES[type(message)]), express=True)
        self._codec, self._message, self._hz = Codec(), message, hz
        self._lock, self._seq = threading.Lock(), 0
        self._end = threading.Event()

    def __enter__(self) -> Robot:
        self.guard.start()
        self._thread = threading.Thread(target=self._stream, daemon=True)
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        import zenoh

        self._end.set()
        self._thread.join()
        self.guard.close()
        with suppress(zenoh.ZError):  # a link that was cut does not close in time
            self.session.close()

    def put(self, stamp_ns: int) -> None:
        with self._lock:
            self._seq += 1
            payload = self._codec.encode(self._message, stamp_ns)
            self._publisher.put(payload, attachment=pack_attachment(self._seq, stamp_ns, b"bench-bench-bench"[:16]))

    def status(self) -> Status | None:
        for reply in self.session.get(KEYS.service("status"), timeout=2.0):
            if reply.ok is not None:
                return msgspec.json.decode(reply.ok.payload.to_bytes(), type=Status)
        return None

    def _take(self, intervention: Intervention) -> bool:
        self.told.append((time.perf_counter(), intervention))
        return True

    def _stream(self) -> None:
        next_s = time.perf_counter()
        while not self._end.is_set():
            self.put(time.time_ns() + self.jump_ns)
            next_s += 1.0 / self._hz
            time.sleep(max(0.0, next_s - time.perf_counter()))


NAMES = tuple(f"joint-{k}" for k in range(32))
JOINTS = JointState(NAMES, (0.1,) * 32, (0.0,) * 32)
GRIPPED = GripState(True, 20.0, 5.0, 0.05, 20.0, 0.5, 0.0)


def ping_pong_ms(n: int = 200) -> float:
    """Median round trip of a payload of the size of a joint state."""
    at = endpoint()
    with process("-c", ECHO, at):
        session: Any = until(lambda: _opened(at))
        import zenoh

        subscriber = session.declare_subscriber("pong", zenoh.handlers.RingChannel(4))
        publisher = session.declare_publisher("ping", express=True)
        payload = Codec().encode(JOINTS, 0)
        until(lambda: (publisher.put(payload), time.sleep(0.05), subscriber.try_recv())[2])
        time.sleep(0.2)
        while subscriber.try_recv() is not None:
            pass
        took = []
        for _ in range(n):
            begin = time.perf_counter()
            publisher.put(payload)
            subscriber.recv()
            took.append((time.perf_counter() - begin) * 1e3)
            time.sleep(0.002)
        session.close()
    return statistics.median(took)


def _opened(at: str) -> Any:
    try:
        return open_link(LinkSettings("client", (), (at,)))
    except BadInputError:
        return None


def latency_ms(folder: Path, n: int = 60) -> float:
    """Median time from a sample that is out of order to the intervention in the robot's process."""
    at = endpoint()
    (folder / "reorder.toml").write_text(REORDER.replace("ENDPOINT", at))
    took = []
    with (
        process("-m", "foreshock", "run", str(folder / "reorder.toml")),
        Robot(at, "robot/joints/state", JOINTS, 200) as r,
    ):
        until(r.guard.permitted)
        time.sleep(3.0)
        for k in range(n):
            r.told.clear()
            time.sleep(0.0013 * (k % 7))  # any phase of the tick
            begin = time.perf_counter()
            r.put(time.time_ns() - 50_000_000)
            until(lambda: [t for t, i in r.told if i.action == "derate" and i.strength == 1.0], 5.0)
            took.append((next(t for t, i in r.told if i.action == "derate") - begin) * 1e3)
            until(lambda: [t for t, i in r.told if i.action == "derate" and i.strength == 0.0], 5.0)
            time.sleep(0.2)
    return statistics.median(took)


def sustained(folder: Path, seconds: float = 5.0) -> tuple[float, float]:
    """Ticks and samples a second, at 1 kHz each."""
    at = endpoint()
    (folder / "fast.toml").write_text(FAST.replace("ENDPOINT", at))
    with (
        process("-m", "foreshock", "run", str(folder / "fast.toml")),
        Robot(at, "robot/joints/state", JOINTS, 1000) as r,
    ):
        until(r.guard.permitted)
        first, begin = until(r.status), time.perf_counter()
        time.sleep(seconds)
        last, took = until(r.status), time.perf_counter() - begin
    channel = "robot/joints/state"
    samples = last.streams[channel].counts.samples - first.streams[channel].counts.samples
    return (last.tick - first.tick) / took, samples / took


class Cut:
    """A TCP relay on loopback that can be cut."""

    def __init__(self, to: str) -> None:
        host, port = to.removeprefix("tcp/").split(":")
        self._to = (host, int(port))
        self._server = socket.create_server(("127.0.0.1", 0))
        self.endpoint = f"tcp/127.0.0.1:{self._server.getsockname()[1]}"
        self._held = threading.Event()
        threading.Thread(target=self._accept, daemon=True).start()

    def cut(self) -> None:
        """Nothing goes through any more, and nobody is told."""
        self._held.set()

    def _accept(self) -> None:
        while True:
            try:
                near, _ = self._server.accept()
                far = socket.create_connection(self._to)
            except OSError:
                return
            for a, b in ((near, far), (far, near)):
                threading.Thread(target=self._relay, args=(a, b), daemon=True).start()

    def _relay(self, a: socket.socket, b: socket.socket) -> None:
        try:
            while data := a.recv(65536):
                if self._held.is_set():
                    return
                b.sendall(data)
        except OSError:
            return

    def close(self) -> None:
        self._server.close()


def standstill_ms(folder: Path, how: str, n: int = 6) -> float:
    """Median time from what happens to the supervisor until the guard ends motion."""
    took = []
    for _ in range(n):
        at = endpoint()
        (folder / "grip.toml").write_text(GRIP.replace("ENDPOINT", at))
        with process("-m", "foreshock", "run", str(folder / "grip.toml")) as child:
            until(lambda at=at: (s := _opened(at)) is not None and (s.close() or True))
            relay = Cut(at)
            with Robot(relay.endpoint, "robot/left_gripper/state", GRIPPED, 200) as robot:
                until(robot.guard.permitted)
                # a clock is believed whatever it does in its first 2 s
                time.sleep(2.5 if how == "clock jump" else 0.3)
                robot.stopped.clear()
                begin = time.perf_counter()
                if how == "clock jump":
                    robot.jump_ns = 10_000_000_000
                elif how == "link cut":
                    relay.cut()
                else:
                    os.kill(child.pid, signal.SIGKILL if how == "SIGKILL" else signal.SIGSTOP)
                robot.stopped.wait(10.0)
                took.append((time.perf_counter() - begin) * 1e3)
                os.kill(child.pid, signal.SIGCONT)
            relay.close()
    return statistics.median(took)


def rows() -> list[Row]:
    """The rows of the table."""
    found = []
    with tempfile.TemporaryDirectory(prefix="foreshock-bench-") as name:
        folder = Path(name)
        bare = ping_pong_ms()
        value = latency_ms(folder)
        limit = 1.5 * bare + PERIOD_S * 1e3 / 2.0
        aim = f"< 1.5 x and half a tick: {limit:.2f} ms"
        found.append(_row("from a sample to the intervention", value, "ms", bare, "bare ping-pong", aim, value < limit))
        ticks, samples = sustained(folder)
        what = "ticks a second, joint states at 1 kHz"
        found.append(_row(what, ticks, "1/s", samples, "samples a second", "1000 of each", ticks > 990.0))
        for how in ("SIGKILL", "SIGSTOP", "link cut", "clock jump"):
            value, limit = standstill_ms(folder, how), TTL_S * 1e3 + 20.0
            aim = f"< time to live + 20 ms: {limit:.0f} ms"
            found.append(_row(f"{how} to standstill", value, "ms", TTL_S * 1e3, "time to live", aim, value < limit))
    return found


def _row(what: str, value: float, unit: str, reference: float, name: str, aim: str, holds: bool) -> Row:
    return Row(what, value, unit, reference, name, value / reference, aim, holds)
