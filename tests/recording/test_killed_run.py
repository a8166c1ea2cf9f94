"""A live supervisor is killed while it writes: its journal replays up to there, and so does what is recovered of it."""

from __future__ import annotations

import os
import signal
import sys
from pathlib import Path

import pytest

from foreshock.recording import recover
from foreshock.session.replay import replay

sys.path.append(str(Path(__file__).parents[1] / "live"))
from robot import Robot, free_endpoint, supervisor, until

pytest.importorskip("zenoh")


@pytest.mark.parametrize("after", range(20, 420, 20) if os.environ.get("FORESHOCK_SOAK") else [100])
def test_the_journal_of_a_killed_supervisor_replays(tmp_path: Path, after: int) -> None:
    endpoint = free_endpoint()
    with supervisor(tmp_path, endpoint) as process, Robot(endpoint) as robot:
        told = until(lambda: (s := robot.status()) and s.tick > after and s.tick, f"{after} ticks")
        os.kill(process.pid, signal.SIGKILL)
        process.wait()
    (journal,) = (tmp_path / "journals").glob("*.mcap")
    result = replay(journal)
    assert result.agrees
    assert not result.complete
    assert result.ticks > told - 17, "a tick is 1 kB or more, and 16 kB at most are lost"
    whole = tmp_path / "whole.mcap"
    assert recover(journal, whole).ticks == result.ticks
    again = replay(whole)
    assert (again.agrees, again.complete, again.replayed) == (True, True, result.replayed)
