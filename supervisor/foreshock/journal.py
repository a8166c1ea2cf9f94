"""The record of everything: what came in and what was decided, tick by tick."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from typing import Protocol

import msgspec

from foreshock.records import Decision, Sample

__all__ = ["DigestJournal", "Journal", "MemoryJournal"]


class Journal(Protocol):
    """Takes one tick after the other."""

    def tick(self, samples: Sequence[Sample], decision: Decision) -> None:
        """Record what a tick was given and what it concluded."""

    def close(self) -> None:
        """Nothing more will come; idempotent."""


class DigestJournal:
    """A hash chain over all decisions: two runs are equal if and only if their digests are."""

    def __init__(self) -> None:
        self._encoder = msgspec.msgpack.Encoder(order="deterministic")
        self._chain = hashlib.sha256(b"foreshock journal 1")

    def tick(self, samples: Sequence[Sample], decision: Decision) -> None:  # noqa: ARG002 # decisions follow from them
        """Add a decision to the chain."""
        self._chain.update(self._encoder.encode(decision))

    @property
    def digest(self) -> str:
        """Hexadecimal digest of all decisions so far."""
        return self._chain.hexdigest()

    def close(self) -> None:
        """Nothing to close."""


class MemoryJournal:
    """Keeps everything in memory: for tests and short runs."""

    def __init__(self) -> None:
        self.ticks: list[tuple[tuple[Sample, ...], Decision]] = []

    def tick(self, samples: Sequence[Sample], decision: Decision) -> None:
        """Keep a tick."""
        self.ticks.append((tuple(samples), decision))

    def close(self) -> None:
        """Nothing to close."""
