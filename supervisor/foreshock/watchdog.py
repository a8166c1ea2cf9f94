"""Ends this process if a tick does not come in time, even when native code holds the interpreter.

A detector in process that hangs in native code stops every Python thread, so nothing written in Python can notice. The
timer of faulthandler is a native thread that needs no interpreter: it writes the stack of every thread, which names the
culprit, and calls ``_exit(1)``. The supervisor is then dead, no lease is answered, and the robot-side guard lets the
permission to move expire (rule 5): that is what makes ending the process the safe thing to do.
"""

from __future__ import annotations

import faulthandler
import sys
from types import TracebackType
from typing import TextIO

from foreshock._strict import within

__all__ = ["Watchdog"]


class Watchdog:
    """A context in which :meth:`feed` must be called again and again; otherwise the process ends with exit code 1.

    There is one timer per process (of the standard library): two watchdogs at a time would feed each other.

    Args:
        timeout_s: longest time in s from one feeding to the next. Choose it above the longest good tick, and know
            that the robot stops after the lease's time to live in any case.
        file: where the stacks go; a file with a descriptor that stays open. Standard error by default.

    Raises:
        ConfigError: timeout_s is not a positive time.
    """

    def __init__(self, timeout_s: float, file: TextIO | None = None) -> None:
        within("watchdog.timeout_s", timeout_s, 0.0, above=True)
        self._timeout_s = timeout_s
        self._file = file

    def feed(self) -> None:
        """Start the time anew; some 50 us, since the standard library starts a new thread each time."""
        faulthandler.dump_traceback_later(self._timeout_s, exit=True, file=self._file or sys.stderr)

    def stop(self) -> None:
        """Stop watching; idempotent."""
        faulthandler.cancel_dump_traceback_later()

    def __enter__(self) -> Watchdog:
        self.feed()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()
