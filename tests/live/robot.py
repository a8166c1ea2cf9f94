"""A robot for the tests: streams a gripper over Zenoh and holds a guard; supervisors in processes of their own."""

from __future__ import annotations

import os
import random
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import msgspec

from foreshock.guard import Guard
from foreshock.link import LinkSettings, open_link
from foreshock.live import Status
from foreshock.messages import GripState
from foreshock.records import Intervention
from foreshock.session.isolated import Job, run_one
from foreshock.session.scenario import Scenario
from foreshock.wire import Codec, Keys, pack_attachment

CONFIG = """
[supervisor]
robot = "robot"
period_s = 0.01

[[detectors]]
use = "grip"

[link]
listen = ["{endpoint}"]

[live]
ttl_s = 0.3

[journal]
folder = "journals"
"""
PATIENCE_S = 40.0
"""The machine may be busy; nothing here waits so long when all is well."""


def free_endpoint() -> str:
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{s.getsockname()[1]}"


def until(what: Callable[[], Any], message: str) -> Any:
    """Wait for something to come true."""
    end = time.monotonic() + PATIENCE_S
    while time.monotonic() < end:
        if found := what():
            return found
        time.sleep(0.02)
    raise AssertionError(f"never happened: {message}")


@contextmanager
def supervisor(folder: Path, endpoint: str, text: str = CONFIG) -> Iterator[subprocess.Popen[str]]:
    """A live supervisor in a process of its own; ended by its pid."""
    path = folder / "run.toml"
    path.write_text(text.format(endpoint=endpoint))
    process = subprocess.Popen(
        [sys.executable, "-m", "foreshock", "run", str(path)], stderr=subprocess.PIPE, text=True, cwd=folder
    )
    try:
        yield process
    finally:
        if process.poll() is not None and process.returncode > 0 and process.stderr is not None:
            sys.stderr.write(process.stderr.read())
        if process.poll() is None:
            process.send_signal(signal.SIGCONT)
            process.terminate()
            try:
                process.wait(20)
            except subprocess.TimeoutExpired:
                os.kill(process.pid, signal.SIGKILL)
                process.wait()
        if process.stderr is not None:
            process.stderr.close()


def assert_the_same_over_zenoh(scenario: Scenario, served: str) -> None:
    """A stepped run of a twin that another process serves is the run in process, digest for digest."""
    here = run_one(Job(scenario, "on", 5))
    assert here.interventions, "what goes to the twin matters as much as what comes from it"
    endpoint = free_endpoint()
    command = [sys.executable, "-m", "foreshock", "twin", "serve", served, "--listen", endpoint]
    server = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    try:
        assert server.stderr is not None
        assert endpoint in server.stderr.readline()
        over = msgspec.structs.replace(scenario, twin={"kind": "zenoh", "endpoint": endpoint})
        for _ in range(2):  # and again after a reset
            there = run_one(Job(over, "on", 5))
            assert there.digest == here.digest
            assert (there.outcome, there.end_s) == (here.outcome, here.end_s)
    finally:
        server.terminate()
        server.wait(20)
        if server.stderr is not None:
            server.stderr.close()


class Robot:
    """Streams a steady grip every ``period_s`` while ``streaming``."""

    def __init__(self, endpoint: str, streaming: bool = True, link: LinkSettings | None = None) -> None:
        self.link = link or LinkSettings("peer", (), (endpoint,))
        self.period_s = 0.01
        self.keys = Keys("robot")
        self.interventions: list[Intervention] = []
        self.stops: list[str] = []
        self.streaming = streaming
        self.jump_ns = 0
        self.gid = b"robot-in-a-test-"
        self.guard = Guard("robot", self._take, self.stops.append, self.link, "g1")
        self._ended = threading.Event()
        self._codec, self.sequence = Codec(), 0

    def __enter__(self) -> Robot:
        self.session: Any = open_link(self.link)
        self._publisher = self.session.declare_publisher(
            self.keys.stream("robot/left_gripper/state", "foreshock_msgs/msg/GripState")
        )
        self.guard.start()
        self._thread = threading.Thread(target=self._stream, daemon=True)
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._thread.join(5)
        self.guard.close()
        self.session.close()

    def put(self, payload: bytes, attachment: bytes | None) -> None:
        self._publisher.put(payload, attachment=attachment)

    def attachment(self, stamp_ns: int, sequence: int | None = None) -> bytes:
        if sequence is None:
            self.sequence += 1
            sequence = self.sequence
        return pack_attachment(sequence, stamp_ns, self.gid)

    def ask(self, service: str, payload: bytes = b"") -> bytes | None:
        for reply in self.session.get(self.keys.service(service), payload=payload, timeout=5.0):
            return reply.ok.payload.to_bytes() if reply.ok is not None else b"error " + reply.err.payload.to_bytes()
        return None

    def status(self) -> Status | None:
        answer = self.ask("status")
        return None if answer is None else msgspec.json.decode(answer, type=Status)

    def told(self, action: str) -> list[float]:
        return [i.strength for i in self.interventions if i.action == action]

    def _take(self, intervention: Intervention) -> bool:
        self.interventions.append(intervention)
        return True

    def _stream(self) -> None:
        noise = random.Random(1)  # a sensor that repeats itself to the last bit is frozen
        while not self._ended.wait(self.period_s):
            if self.streaming:
                grip = GripState(True, 20.0 + noise.gauss(0.0, 0.01), 5.0, 0.05, 20.0, 0.5, 0.0)
                stamp_ns = time.time_ns() + self.jump_ns
                self.put(self._codec.encode(grip, stamp_ns), self.attachment(stamp_ns))
