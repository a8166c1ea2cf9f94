"""Journal files of a live supervisor: one segment after the other, the oldest removed."""

from __future__ import annotations

import glob
import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path

import msgspec

from foreshock.journal import NO_VERDICTS, OperatorReset
from foreshock.live._settings import JournalSettings
from foreshock.recording import Head, McapJournal
from foreshock.records import Decision, Sample

__all__ = ["SegmentedJournal", "segment_path"]


SEGMENT = re.compile(r"\d+-\d{5,}\.mcap")
"""Epoch and number, after the robot's name."""


def segment_path(folder: Path, robot: str, epoch: int, number: int) -> Path:
    """File of a segment of a supervisor's run."""
    return folder / f"{robot}-{epoch}-{number:05d}.mcap"


class SegmentedJournal:
    """Implements foreshock.journal.Journal.

    Args:
        folder: of the files.
        robot: whose journals they are.
        epoch: of the supervisor, so that the files of two runs never meet.
        head: what a replay needs.
        settings: when a new segment begins, and what is kept.
        today_s: when the run began (s since 1970): a file's age is counted from here, and the time that has passed.
    """

    def __init__(
        self, folder: Path, robot: str, epoch: int, head: Head, settings: JournalSettings, today_s: float
    ) -> None:
        self._folder, self._robot, self._epoch = folder, robot, epoch
        self._head, self._settings, self._began_ns = head, settings, head.began_ns
        self._today_s = today_s
        self._segment = 0
        self._begun_ns = head.began_ns
        self._open(head.began_ns)

    @property
    def path(self) -> Path:
        """Of the file that is written now."""
        return self._file.path

    def tick(self, samples: Sequence[Sample], decision: Decision, verdicts: Mapping[str, str] = NO_VERDICTS) -> None:
        """Write a tick, in a new file if it is time."""
        if decision.now_ns - self._begun_ns >= self._settings.segment_s * 1e9:
            self._file.close()
            self._segment += 1
            self._begun_ns = decision.now_ns
            self._head = msgspec.structs.replace(self._head, segment=self._segment)
            self._open(decision.now_ns)
        self._file.tick(samples, decision, verdicts)

    def operator_reset(self, record: OperatorReset) -> None:
        """Write an operator's reset."""
        self._file.operator_reset(record)

    def close(self) -> None:
        """Close the file; idempotent."""
        self._file.close()

    def _open(self, now_ns: int) -> None:
        path = segment_path(self._folder, self._robot, self._epoch, self._segment)
        self._file = McapJournal(path, self._head)
        self._retain(self._today_s + (now_ns - self._began_ns) / 1e9)

    def _retain(self, today_s: float) -> None:
        """Remove the oldest files beyond size and age, never the one that is written."""
        found: list[tuple[float, Path, int]] = []
        # of this robot's live runs only: whatever else lies in the folder is somebody's
        for path in self._folder.glob(f"{glob.escape(self._robot)}-*.mcap"):
            if SEGMENT.fullmatch(path.name.removeprefix(f"{self._robot}-")):
                with suppress(FileNotFoundError):  # somebody else tidies up, too
                    stat = path.stat()
                    found.append((stat.st_mtime, path, stat.st_size))
        total = sum(size for _, _, size in found)
        for modified_s, path, size in sorted(found):
            if path == self._file.path:
                continue
            if today_s - modified_s <= self._settings.max_age_s and total <= self._settings.max_bytes:
                return
            total -= size
            path.unlink(missing_ok=True)
