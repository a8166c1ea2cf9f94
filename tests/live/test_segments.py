"""Journals of a live run: a new file in time, the oldest removed by size and by age, only the first compared."""

from __future__ import annotations

import os
import time
from pathlib import Path

import pytest

from foreshock.config import parse_config
from foreshock.errors import BadInputError
from foreshock.live import JournalSettings
from foreshock.live._journal import SegmentedJournal
from foreshock.messages import Scalar
from foreshock.recording import Head, JournalFile
from foreshock.records import Sample
from foreshock.session.replay import replay
from foreshock.supervisor import Supervisor

CONFIG = {"supervisor": {"robot": "r", "period_s": 0.1}, "detectors": [{"use": "telemetry"}], "policies": []}
NOW_S = time.time()


def run(folder: Path, settings: JournalSettings, seconds: float, now_s: float) -> list[Path]:
    """A run of so many seconds into the folder at this time; the files there."""
    supervisor = Supervisor(parse_config(CONFIG, "config"))
    journal = SegmentedJournal(folder, "r", 1, Head(CONFIG, "", 0, 0), settings, now_s)
    supervisor.reset(0)
    for k in range(1, round(seconds * 10) + 1):
        now_ns = k * 100_000_000
        samples = [Sample(now_ns, "r/a/b", Scalar(float(k)), k, now_ns)]
        decision = supervisor.step(samples, now_ns)
        journal.tick(samples, decision, supervisor.verdicts_of(decision))
    journal.close()
    supervisor.close()
    return sorted(folder.glob("*.mcap"))


def test_a_new_file_begins_in_time_and_only_the_first_is_compared(tmp_path: Path) -> None:
    files = run(tmp_path, JournalSettings(segment_s=2.0), 7.0, time.time())
    assert [f.name for f in files] == [f"r-1-0000{k}.mcap" for k in range(4)]
    assert [JournalFile(f).head.segment for f in files] == [0, 1, 2, 3]
    first = replay(files[0])
    assert first.agrees
    assert first.complete
    with pytest.raises(BadInputError, match="segment 1 of its run"):
        replay(files[1])
    asked = replay(files[1], config=parse_config(CONFIG, "config"))
    assert asked.altered_at is None
    # no tick is lost between two files
    assert sum(replay(f, config=parse_config(CONFIG, "config")).ticks for f in files) == 70


def test_a_run_of_months_removes_what_grew_old_meanwhile(tmp_path: Path) -> None:
    began_s, day_s = NOW_S - 60 * 86400.0, 86400.0
    supervisor = Supervisor(parse_config(CONFIG, "config"))
    # the supervisor's timeline begins anywhere
    began_ns = 5_000_000_000_000
    settings = JournalSettings(max_age_s=30 * day_s)
    journal = SegmentedJournal(tmp_path, "r", 2, Head(CONFIG, "", 0, began_ns), settings, began_s)
    supervisor.reset(0, began_ns)
    first, before = journal.path, tmp_path / "r-1-00000.mcap"
    before.write_bytes(bytes(400_000))
    os.utime(before, (NOW_S - 61 * day_s,) * 2)

    def tick(day: float) -> Path:
        now_ns = began_ns + round(day * day_s * 1e9)
        journal.tick([], supervisor.step([], now_ns))
        return journal.path

    assert tick(20.0) != first
    assert before.exists()
    os.utime(first, (began_s + 20 * day_s,) * 2)
    second = tick(40.0)
    assert not before.exists(), "it is 41 days old"
    assert first.exists(), "it was written 20 days ago"
    os.utime(second, (began_s + 40 * day_s,) * 2)
    last = tick(60.0)
    assert not first.exists(), "it was written 40 days ago"
    assert second.exists()
    journal.close()
    supervisor.close()
    assert last.exists()


def test_the_oldest_are_removed_by_age_and_by_size(tmp_path: Path) -> None:
    others = [tmp_path / "bag.mcap", tmp_path / "r-arm-1-00000.mcap", tmp_path / "r-notes.mcap"]
    for other in others:
        other.write_bytes(bytes(400_000))
        os.utime(other, (NOW_S - 50 * 86400.0,) * 2)
    for k, age_days in enumerate((40.0, 20.0, 1.0), 2):
        old = tmp_path / f"r-{k}-00000.mcap"
        old.write_bytes(bytes(400_000))
        os.utime(old, (NOW_S - age_days * 86400.0,) * 2)
    left = run(tmp_path, JournalSettings(max_age_s=30 * 86400.0, max_bytes=1_000_000), 1.0, NOW_S)
    assert [f.name for f in left if f not in others] == ["r-1-00000.mcap", "r-3-00000.mcap", "r-4-00000.mcap"]
    (tmp_path / "r-5-00000.mcap").write_bytes(bytes(400_000))
    os.utime(tmp_path / "r-5-00000.mcap", (NOW_S, NOW_S))
    (tmp_path / "r-1-00000.mcap").unlink()
    left = run(tmp_path, JournalSettings(max_bytes=1_000_000), 1.0, NOW_S)
    assert [f.name for f in left if f not in others] == ["r-1-00000.mcap", "r-4-00000.mcap", "r-5-00000.mcap"]
    assert all(other.exists() for other in others), "what is not a live journal of this robot is nobody's to remove"
