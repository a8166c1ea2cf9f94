"""The MuJoCo twin on this machine's clock beside a supervisor, each in a process of its own, over loopback."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import msgspec
import pytest

sys.path.append(str(Path(__file__).parent))
from robot import free_endpoint, supervisor, until

from foreshock.guard._cdr import unpack_intervention
from foreshock.link import LinkSettings, open_link
from foreshock.live import Status
from foreshock.messages import MotionPlan
from foreshock.wire import ROS_NAMES, Codec, Keys

pytest.importorskip("zenoh")
pytest.importorskip("mujoco")
pytest.importorskip("pinocchio")

CONFIG = """
[supervisor]
robot = "talos"
period_s = 0.01

[[detectors]]
use = "balance"
config = {{ slip_m = 0.003, slip_full_m = 0.03, com_deviation_m = 0.02, torso_rate_rad_s = 0.3 }}

[[detectors]]
use = "telemetry"

[trust]
unobserved_cap = 0.95
grace_s = 10.0  # the machine may be busy

[gates.modes.A1]
caution = 0.9
hysteresis = 0.05
dwell_s = 1.0

[[policies]]
use = "by-cause"
config = {{ mode = "A1" }}

[link]
mode = "client"
listen = []
connect = ["{endpoint}"]

[live]
ttl_s = 1.0  # likewise
"""
SCENARIO = """
id = "walk"
title = "A walk; both soles may come onto a floor on which they slip and do not fall"
mode = "A1"
expect = "none"
duration_s = 60.0
[twin]
kind = "mujoco"
[config.supervisor]
robot = "talos"
period_s = 0.01
[[config.detectors]]
use = "balance"
[parameters]
step_length = 0.1
start_time = 0.5
drop_foot = 2
drop_mu = 0.05
drop_time = 8.0
"""
MAX_AGE_S = 0.05
"""Of joint states: those that are older are none to the detector of balance."""
STAND_NS = 1_200_000_000
"""Longer than the walk ever has both feet down: 0.2 s between steps of 0.7 s."""


class Watch:
    """The router between the two: it sees the robot's plan, and the supervisor's interventions and status."""

    def __init__(self, endpoint: str) -> None:
        self._session: Any = open_link(LinkSettings("router", (endpoint,)))
        self._keys, self._codec, self._lock = Keys("talos"), Codec(), threading.Lock()
        self.stamps: list[int] = []
        self.late_s = 0.0
        self.steps, self.both_since_ns = 0, 0
        self.asked: dict[str, float] = {}
        plan = self._keys.stream("talos/plan/motion", ROS_NAMES[MotionPlan])
        self._subscribers = (
            self._session.declare_subscriber(plan, self._plan),
            self._session.declare_subscriber(self._keys.service("intervention"), self._intervention),
        )

    def close(self) -> None:
        self._session.close()

    def status(self) -> Status | None:
        for reply in self._session.get(self._keys.service("status"), timeout=5.0):
            if reply.ok is not None:
                return msgspec.json.decode(reply.ok.payload.to_bytes(), type=Status)
        return None

    def permitted(self) -> bool:
        status = self.status()
        return status is not None and status.motion_permitted and any(g.startswith("twin-") for g in status.guards)

    def until(self, what: Callable[[], Any], message: str) -> None:
        """Wait; where it never happens, and the twin was not in time for the supervisor, it is the machine's fault."""
        self.late_s = 0.0
        try:
            until(what, message)
        except AssertionError:
            if self.late_s > MAX_AGE_S:
                pytest.skip(f"this machine is too busy for a robot in real time: {self.late_s:.2f} s late")
            raise

    def stands(self) -> bool:
        """On both feet by its plan, for longer than between two steps."""
        with self._lock:
            return self.both_since_ns > 0 and self.stamps[-1] - self.both_since_ns > STAND_NS

    def _plan(self, sample: Any) -> None:
        message, stamp_ns = self._codec.decode(MotionPlan, sample.payload.to_bytes())
        assert isinstance(message, MotionPlan)
        assert stamp_ns is not None
        with self._lock:
            self.stamps.append(stamp_ns)
            self.late_s = max(self.late_s, (time.monotonic_ns() - stamp_ns) / 1e9)
            if len(message.support) == 1:
                self.steps += self.both_since_ns > 0
                self.both_since_ns = 0
            elif self.both_since_ns == 0:
                self.both_since_ns = stamp_ns

    def _intervention(self, sample: Any) -> None:
        taken = unpack_intervention(sample.payload.to_bytes()).intervention
        self.asked[taken.action] = taken.strength


@contextmanager
def served(path: Path, endpoint: str) -> Iterator[subprocess.Popen[str]]:
    words = ["twin", "serve", str(path), "--real-time", "--seed", "3", "--connect", endpoint]
    process = subprocess.Popen([sys.executable, "-m", "foreshock", *words], stderr=subprocess.PIPE, text=True)
    try:
        yield process
    finally:
        process.terminate()
        process.wait(20)
        if process.stderr is not None:
            process.stderr.close()


@pytest.mark.slow
def test_it_does_not_move_before_the_first_lease(tmp_path: Path) -> None:
    path, endpoint = tmp_path / "walk.toml", free_endpoint()
    path.write_text(SCENARIO)
    watch = Watch(endpoint)
    try:
        with served(path, endpoint):
            # without a lease in the way it lifts a foot within 1 s
            until(lambda: watch.stamps[-1:] > watch.stamps[:1] and watch.stands(), "it streams, and stands")
            assert watch.steps == 0
    finally:
        watch.close()


@pytest.mark.slow
@pytest.mark.parametrize("what", ["ice", "a supervisor that pauses"])
def test_it_walks_under_the_lease_and_stands_when_told_or_without_one(tmp_path: Path, what: str) -> None:
    path, endpoint = tmp_path / "walk.toml", free_endpoint()
    path.write_text(SCENARIO + ("drop_duration = 60.0\n" if what == "ice" else ""))
    watch = Watch(endpoint)
    try:
        # it is the lease that ends motion and gives it back here: one precursor, such as the jerk of a first step from
        # feet apart, must not
        config = CONFIG if what == "ice" else CONFIG.replace("caution = 0.9", "caution = 0.5")
        with supervisor(tmp_path, endpoint, config) as process, served(path, endpoint) as twin:
            watch.until(watch.permitted, "the twin holds the lease")
            steps = watch.steps
            watch.until(lambda: watch.steps > steps + 1, "it walks")
            if what == "ice":
                watch.until(lambda: watch.asked.get("step-suppression") == 1.0, "the supervisor sees the soles slip")
            else:
                os.kill(process.pid, signal.SIGSTOP)
            watch.until(watch.stands, "it puts its foot down and stays")
            if what != "ice":
                os.kill(process.pid, signal.SIGCONT)
                steps = watch.steps
                watch.until(lambda: watch.steps > steps + 1, "the lease is back, and it walks on")
            assert twin.poll() is None
    finally:
        watch.close()
    # simulated time is this machine's, a sample at each tick of 5 ms; the link drops some when the machine is busy
    offs = {(b - a) % 5_000_000 for a, b in zip(watch.stamps, watch.stamps[1:], strict=False)}
    assert offs == {0}
    assert len(watch.stamps) > 0.5 * (watch.stamps[-1] - watch.stamps[0]) / 5_000_000
