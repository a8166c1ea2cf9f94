"""A peer that floods, reads slowly or stops costs its own samples, and nobody else's.

Each in a process of its own, beside a robot that streams and holds the lease. Nothing here measures time: the robot's
samples all arrive, its lease never ends, its stream is never named in health, and the loss is the noisy peer's.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).parent))
from robot import CONFIG, Robot, free_endpoint, supervisor, until

from foreshock.live import Status

pytest.importorskip("zenoh")
GRIP, JOINTS = "robot/left_gripper/state", "robot/joints/state"
PATIENT = CONFIG.replace("ttl_s = 0.3", 'ttl_s = 1.0\nstreams = {{ "joints/state" = "JointState" }}')
"""The machine may be busy with other things for a while: the longest time to live that there is."""
COMMON = """
import sys, time, zenoh
from foreshock.link import LinkSettings, open_link
from foreshock.messages import JointState
from foreshock.wire import Codec, Keys, pack_attachment
session, keys = open_link(LinkSettings("client", (), (sys.argv[1],))), Keys("robot")
"""
FLOOD = (
    COMMON
    + """
publisher = session.declare_publisher(keys.stream("robot/joints/state", "sensor_msgs/msg/JointState"))
n = int(sys.argv[2])
names = tuple(f"joint-{k}" for k in range(n))
payload = Codec().encode(JointState(names, (0.0,) * n, (0.0,) * n, (0.0,) * n), 1_000_000_000)
k = 0
while True:
    k += 1
    now_ns = time.time_ns()
    header = (now_ns // 10**9).to_bytes(4, "little") + (now_ns % 10**9).to_bytes(4, "little")
    publisher.put(payload[:4] + header + payload[12:], attachment=pack_attachment(k, now_ns, b"a noisy one here"))
"""
)
GARBAGE = (
    COMMON
    + """
publisher = session.declare_publisher(keys.stream("robot/joints/state", "sensor_msgs/msg/JointState"))
k = 0
while True:
    k += 1
    now_ns = time.time_ns()
    publisher.put(b"\\0\\1\\0\\0" + bytes(range(200)), attachment=pack_attachment(k, now_ns, b"a noisy one here"))
"""
)
SLOW = (
    COMMON
    + """
def slowly(sample):
    time.sleep(1.0)
subscribers = [session.declare_subscriber(keys.service(s), slowly) for s in ("decision", "lease", "intervention")]
waiting = []
while True:
    for service in ("history", "taxonomy", "status", "config"):
        waiting.append(session.get(keys.service(service), zenoh.handlers.FifoChannel(1), timeout=60.0))
    time.sleep(0.001)
    print("asked", flush=True)
"""
)


@contextmanager
def noisy(code: str, *words: str) -> Iterator[subprocess.Popen[str]]:
    """Somebody in a process of its own; ended by its pid."""
    process = subprocess.Popen([sys.executable, "-c", code, *words], stdout=subprocess.PIPE, text=True)
    try:
        yield process
    finally:
        os.kill(process.pid, signal.SIGKILL)
        process.wait()
        if process.stdout is not None:
            process.stdout.close()


def is_undisturbed(robot: Robot, before: Status, ticks: int = 200) -> Status:
    """Some ticks later the robot has lost nothing; the status then."""
    after = until(lambda: (s := robot.status()) and s.tick > before.tick + ticks and s, "it ticks on")
    assert isinstance(after, Status)
    quiet = after.streams[GRIP].counts
    assert quiet.samples > before.streams[GRIP].counts.samples
    assert (quiet.gaps, quiet.garbage, quiet.foreign, quiet.backwards) == (0, 0, 0, 0)
    assert GRIP not in after.health
    assert after.level == "normal"
    assert robot.guard.counts.expiries == 0, robot.stops
    assert robot.guard.permitted()
    return after


@pytest.mark.parametrize("joints", [32, 5_000])
def test_a_flood_costs_the_flooder_its_own_samples(tmp_path: Path, joints: int) -> None:
    endpoint = free_endpoint()
    with supervisor(tmp_path, endpoint, PATIENT), Robot(endpoint) as robot:
        until(robot.guard.permitted, "the robot may move")
        with noisy(FLOOD, endpoint, str(joints)):

            def flooded() -> Status | None:
                s = robot.status()
                return s if s is not None and s.streams[JOINTS].counts.samples > 5 else None

            before = until(flooded, "the flood arrives")
            after = is_undisturbed(robot, before)
        assert after.streams[JOINTS].counts.gaps > 0, "what the flood lost is counted"


def test_a_flood_of_garbage_is_counted_and_delays_nobody(tmp_path: Path) -> None:
    endpoint = free_endpoint()
    with supervisor(tmp_path, endpoint, PATIENT), Robot(endpoint) as robot:
        until(robot.guard.permitted, "the robot may move")
        with noisy(GARBAGE, endpoint):

            def flooded() -> Status | None:
                s = robot.status()
                return s if s is not None and s.streams[JOINTS].counts.garbage > 100 else None

            after = is_undisturbed(robot, until(flooded, "the garbage arrives"))
        assert JOINTS in after.health


@pytest.mark.parametrize("stopped", [False, True])
def test_a_peer_that_asks_much_and_reads_nothing_delays_nobody(tmp_path: Path, stopped: bool) -> None:
    endpoint = free_endpoint()
    with supervisor(tmp_path, endpoint, PATIENT), Robot(endpoint) as robot:
        until(robot.guard.permitted, "the robot may move")
        with noisy(SLOW, endpoint) as peer:
            assert peer.stdout is not None
            for _ in range(200):
                peer.stdout.readline()
            before = until(robot.status, "a status")
            if stopped:
                os.kill(peer.pid, signal.SIGSTOP)  # its link stays open, nothing is taken from it
            is_undisturbed(robot, before)
            time.sleep(0.1)
