"""In process a native hang ends the supervisor, and the lease of the robot-side guard runs out: rule 5."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TextIO

import pytest

from foreshock.clock import monotonic_ns
from foreshock.errors import ConfigError
from foreshock.guard import MotionGuard
from foreshock.records import Lease
from foreshock.watchdog import Watchdog

ROGUES = Path(__file__).parents[1] / "rogues" / "detectors"
TTL_NS = 1_000_000_000
PATIENCE_S = 60.0
"""Nothing here waits for so long unless it is broken."""


@pytest.fixture
def victim(tmp_path: Path) -> Iterator[tuple[subprocess.Popen[str], TextIO]]:
    path = os.pathsep.join([str(ROGUES), *sys.path])
    with (tmp_path / "stderr").open("w+") as errors:
        process = subprocess.Popen(
            [sys.executable, str(ROGUES / "foreshock_live_victim.py"), "0.5"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=errors,
            text=True,
            env={**os.environ, "PYTHONPATH": path},
        )
        try:
            yield process, errors
        finally:
            process.kill()
            process.communicate()


def test_a_native_hang_in_process_ends_in_an_expired_lease(victim: tuple[subprocess.Popen[str], TextIO]) -> None:
    process, errors = victim
    assert process.stdin is not None
    assert process.stdout is not None
    guard, granted = MotionGuard(), 0

    def say(words: object) -> None:
        process.stdin.write(json.dumps(words) + "\n")
        process.stdin.flush()

    while granted < 5:  # alive: it answers, and the guard permits
        asked = guard.request(monotonic_ns())
        say(asked)
        answer = json.loads(process.stdout.readline())
        if answer is not None and guard.receive(Lease(*answer)):
            granted += 1
            last = asked[1]
    assert guard.permitted(last)
    say("hang")
    asked = guard.request(monotonic_ns())
    say(asked)
    # the victim is in native code now, with the interpreter held; nobody but the watchdog can end it
    assert process.wait(PATIENCE_S) == 1
    rest = process.stdout.read()
    for line in rest.splitlines():  # an answer that was on its way counts from its own request
        answer = json.loads(line)
        if answer is not None and guard.receive(Lease(*answer)):
            last = asked[1]
    # on the guard's own clock, whatever the speed of this machine: no later than time to live after the last request
    assert not guard.permitted(last + TTL_NS)
    assert not guard.permitted(asked[1] + TTL_NS)
    errors.seek(0)
    trace = errors.read()
    assert "Timeout" in trace
    assert "native_hang" in trace  # the stacks name the culprit


def test_a_watchdog_that_is_fed_or_stopped_does_nothing(tmp_path: Path) -> None:
    code = (
        "import sys, time\nfrom foreshock.watchdog import Watchdog\n"
        "with Watchdog(30.0) as w:\n    w.feed()\n    w.feed()\n"
        "w.stop()\nw.stop()\nprint('alive')\n"
    )
    env = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=PATIENCE_S, env=env)
    assert (done.returncode, done.stdout, done.stderr) == (0, "alive\n", "")


@pytest.mark.parametrize("timeout_s", [0.0, -1.0, float("nan"), float("inf")])
def test_a_watchdog_that_would_never_bark_is_refused(timeout_s: float) -> None:
    with pytest.raises(ConfigError, match=r"watchdog\.timeout_s"):
        Watchdog(timeout_s)
