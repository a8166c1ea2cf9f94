"""What an FMU says: the last lines in memory, and a file in scratch that outlives a crash."""

from __future__ import annotations

from collections import deque
from pathlib import Path

__all__ = ["FmuLog"]

_STATUS = ("ok", "warning", "discard", "error", "fatal", "pending")


class FmuLog:
    """Lines that an FMU logs.

    Args:
        path: file to append to; created with the first line, each line is flushed.
        keep: lines kept in memory for errors.
        limit: lines written to the file at most: an FMU that logs every step must not fill the disk.
    """

    def __init__(self, path: Path, keep: int = 50, limit: int = 10_000) -> None:
        self.path = path
        self._lines: deque[str] = deque(maxlen=keep)
        self._left = limit

    def write(self, status: int, category: bytes | None, message: bytes | None) -> None:
        """Take one message as it comes from C; it never raises, for C could not handle that."""
        name = _STATUS[status] if 0 <= status < len(_STATUS) else str(status)
        label = (category or b"").decode("utf-8", "replace")
        line = f"[{name}] {label}: {(message or b'').decode('utf-8', 'replace').rstrip()}"
        self._lines.append(line)
        if self._left <= 0:
            return
        self._left -= 1
        if self._left == 0:
            line += "\n(further lines are not written)"
        try:
            with self.path.open("a", encoding="utf-8") as file:
                file.write(line + "\n")
        except OSError:
            self._left = 0  # a full disk or a removed scratch must not bring the plant down

    def clear(self) -> None:
        """Forget the lines in memory; the file stays."""
        self._lines.clear()

    def text(self) -> str:
        """The last lines."""
        return "\n".join(self._lines)
