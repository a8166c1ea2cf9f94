"""A journal that cannot be written: told before the robot's streams begin, and no motion when the disk is full."""

from __future__ import annotations

import resource
import sys
from pathlib import Path

import msgspec
import pytest

from foreshock.cli import main
from foreshock.config import parse_config
from foreshock.errors import BadInputError
from foreshock.recording import Head, McapJournal, recover
from foreshock.session.replay import replay
from foreshock.supervisor import Supervisor

sys.path.append(str(Path(__file__).parents[1] / "live"))
from robot import CONFIG, Robot, free_endpoint, supervisor, until

TELEMETRY = {"supervisor": {"robot": "robot", "period_s": 0.01}, "detectors": [{"use": "telemetry"}], "policies": []}


def failure(capsys: pytest.CaptureFixture[str], *words: str) -> tuple[int, str]:
    with pytest.raises(SystemExit) as end:
        main([*words, "--json"])
    return int(end.value.code or 0), msgspec.json.decode(capsys.readouterr().out)["errors"][0]["message"]


def test_a_full_disk_ends_the_file_where_it_is_and_what_is_there_replays(tmp_path: Path) -> None:
    judge = Supervisor(parse_config(TELEMETRY, "config"))
    judge.reset(0)
    journal = McapJournal(tmp_path / "a.mcap", Head(TELEMETRY, "", 0, 0))
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (50_000, before[1]))
    written = 0

    def fill() -> None:
        nonlocal written
        for k in range(1, 5000):
            decision = judge.step([], k * 10_000_000)
            journal.tick([], decision, judge.verdicts_of(decision))
            written = k

    try:
        with pytest.raises(BadInputError, match="cannot be written: File too large; what is there"):
            fill()
        journal.close()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        judge.close()
    found = recover(tmp_path / "a.mcap", tmp_path / "b.mcap")
    assert written - 200 < found.ticks <= written
    assert replay(tmp_path / "b.mcap").agrees


def test_a_file_that_cannot_be_finished_says_so(tmp_path: Path) -> None:
    journal = McapJournal(tmp_path / "a.mcap", Head(TELEMETRY, "", 0, 0))
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, before[1]))
    try:
        with pytest.raises(BadInputError, match="cannot be written: File too large"):
            journal.close()
        journal.close()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def test_a_journal_that_cannot_be_made_is_bad_input(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ("simulate", "a1-fall-onto-human", "--duration", "0.1", "--journal", "/dev/null/x.mcap")
    code, said = failure(capsys, *words)
    assert code == 2
    assert said == "/dev/null/x.mcap: cannot be made: /dev/null is no folder"


def test_a_supervisor_says_before_streams_begin_that_its_journal_cannot_be_made(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("zenoh")
    path = tmp_path / "run.toml"
    path.write_text(CONFIG.format(endpoint=free_endpoint()).replace('"journals"', '"/dev/null/journals"'))
    code, said = failure(capsys, "run", str(path), "--seconds", "0.2")
    assert code == 2
    assert said.startswith("/dev/null/journals/robot-")
    assert said.endswith(": cannot be made: Not a directory")
    code, said = failure(capsys, "run", str(path), "--seconds", "0.2", "--journal", "/dev/null/x.mcap")
    assert (code, said) == (2, "/dev/null/x.mcap: cannot be made: /dev/null is no folder")


def test_a_supervisor_whose_disk_is_full_grants_no_motion_and_says_why(tmp_path: Path) -> None:
    pytest.importorskip("zenoh")
    endpoint = free_endpoint()
    with supervisor(tmp_path, endpoint) as process, Robot(endpoint) as robot:
        until(robot.guard.permitted, "the robot may move")
        (journal,) = (tmp_path / "journals").glob("*.mcap")
        size = until(lambda: journal.stat().st_size, "a journal")
        most = size + 100_000
        resource.prlimit(process.pid, resource.RLIMIT_FSIZE, (most, most))
        status = until(lambda: (s := robot.status()) and "cannot be written" in s.withheld and s, "the status says why")
        assert str(journal) in status.withheld
        assert "File too large" in status.withheld
        assert not status.motion_permitted
        until(lambda: not robot.guard.permitted(), "the lease ends")
        until(lambda: (s := robot.status()) and s.tick > status.tick + 50, "it ticks on, and would intervene")
        assert process.poll() is None
    found = recover(journal, tmp_path / "whole.mcap")
    assert found.ticks > 0
    assert replay(tmp_path / "whole.mcap").agrees
