"""Refuses clocks, global randomness and I/O while a detector works, and remembers who asked."""

from __future__ import annotations

import builtins
import datetime
import os
import random
import socket
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any
from unittest import mock

import numpy as np

__all__ = ["ImpureError", "Purity"]

CLOCKS = ("time", "monotonic", "perf_counter", "process_time", "thread_time")


class ImpureError(RuntimeError):
    """A detector used something that its answer must not depend on."""


class Purity:
    """A guard that is armed only while a detector's own code runs.

    Attributes:
        armed_in: the thread in which forbidden functions refuse now; 0 for none.
        asked: names of the forbidden functions that were called while armed, also where the detector caught the error.
    """

    def __init__(self) -> None:
        self.armed_in = 0
        self.asked: list[str] = []

    @contextmanager
    def watching(self, packages: frozenset[str]) -> Iterator[None]:
        """Replace the forbidden functions in their modules, and where modules of these packages imported them by name.

        Args:
            packages: top-level import names of the detector's code.
        """
        table = {id(original): (original, self._refusing(name, original)) for name, original in _functions()}
        for original, stand_in in self._datetimes():
            table[id(original)] = (original, stand_in)
        seed = np.random.default_rng
        table[id(seed)] = (seed, self._refusing("numpy.random.default_rng without a seed", seed, unless_args=True))
        homes = [builtins, datetime, os, random, socket, time, np.random]
        homes += [m for name, m in list(sys.modules.items()) if name.partition(".")[0] in packages and m is not None]
        swaps = [
            (module, name, table[id(value)][1])
            for module in homes
            for name, value in list(vars(module).items())
            if id(value) in table and table[id(value)][0] is value
        ]
        patches = [mock.patch.object(module, name, stand_in) for module, name, stand_in in swaps]
        for patch in patches:
            patch.start()
        try:
            yield
        finally:
            self.armed_in = 0
            for patch in reversed(patches):
                patch.stop()

    @contextmanager
    def armed(self) -> Iterator[None]:
        """Refuse in this thread; other threads, a test runner's for one, go on."""
        self.armed_in = threading.get_ident()
        try:
            yield
        finally:
            self.armed_in = 0

    def _refuse(self, name: str) -> None:
        if self.armed_in == threading.get_ident():
            self.asked.append(name)
            raise ImpureError(f"{name} was called while the detector worked")

    def _refusing(self, name: str, original: Callable[..., Any], unless_args: bool = False) -> Callable[..., Any]:
        def stand_in(*args: Any, **kwargs: Any) -> Any:
            if not (unless_args and any(a is not None for a in (*args, *kwargs.values()))):
                self._refuse(name)
            return original(*args, **kwargs)

        return stand_in

    def _datetimes(self) -> list[tuple[type, type]]:
        """Stand-ins for datetime and date; C types refuse to have their methods replaced."""
        refuse = self._refuse

        class Date(datetime.date):
            @classmethod
            def today(cls) -> Any:
                refuse("datetime.date.today")
                return super().today()

        class Datetime(datetime.datetime):
            @classmethod
            def now(cls, tz: datetime.tzinfo | None = None) -> Any:
                refuse("datetime.datetime.now")
                return super().now(tz)

            @classmethod
            def utcnow(cls) -> Any:
                refuse("datetime.datetime.utcnow")
                return super().now(datetime.UTC).replace(tzinfo=None)

            @classmethod
            def today(cls) -> Any:
                refuse("datetime.datetime.today")
                return super().now()

        return [(datetime.date, Date), (datetime.datetime, Datetime)]


def _functions() -> Iterator[tuple[str, Callable[..., Any]]]:
    for base in CLOCKS:
        for name in (base, f"{base}_ns"):
            yield f"time.{name}", getattr(time, name)
    yield "time.sleep", time.sleep
    yield "os.urandom", os.urandom
    yield "open", builtins.open
    yield "socket.socket", socket.socket
    for name, value in vars(random).items():
        if isinstance(getattr(value, "__self__", None), random.Random) and not name.startswith("_"):
            yield f"random.{name}", value
    for name, value in vars(np.random).items():
        if isinstance(getattr(value, "__self__", None), np.random.RandomState) and not name.startswith("_"):
            yield f"numpy.random.{name}", value
