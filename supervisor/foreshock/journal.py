"""The record of everything that decides and of what was decided, tick by tick.

Samples, verdicts, an operator's resets, the configuration and the seed are all the inputs of a decision: a supervisor
that is given them again in the same order decides the same.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Protocol

import msgspec

from foreshock.records import Decision, Sample

__all__ = ["DigestJournal", "Journal", "MemoryJournal", "OperatorReset"]

NO_VERDICTS: Mapping[str, str] = MappingProxyType({})


class OperatorReset(msgspec.Struct, frozen=True):
    """An operator's release of latched protection levels: when, who, why, and of which dimension of trust.

    dimension is ``overall``, the code of an accident mode, the id of a precursor class, or ``""`` for all.
    """

    stamp_ns: int
    who: str
    why: str
    dimension: str = ""


class Journal(Protocol):
    """Takes one tick after the other."""

    def tick(self, samples: Sequence[Sample], decision: Decision, verdicts: Mapping[str, str] = NO_VERDICTS) -> None:
        """Record what a tick was given and what it concluded.

        Args:
            samples: given to Supervisor.step.
            decision: what it gave.
            verdicts: Supervisor.verdicts_of(decision): what wall clocks and child processes decided in this tick.
        """

    def operator_reset(self, record: OperatorReset) -> None:
        """Record an operator's reset, between the ticks where it happened."""

    def close(self) -> None:
        """Nothing more will come; idempotent."""


class DigestJournal:
    """A hash chain over decisions, verdicts and resets: two runs are equal if and only if their digests are.

    Samples are not hashed: a run is compared by what it concluded from them. A tick without verdicts adds its decision
    only. A decision is a msgpack map and everything else an array, so that no two histories give the same bytes.
    """

    def __init__(self) -> None:
        self._encoder = msgspec.msgpack.Encoder(order="deterministic")
        self._chain = hashlib.sha256(b"foreshock journal 1")

    def tick(
        self,
        samples: Sequence[Sample],  # noqa: ARG002 # see above
        decision: Decision,
        verdicts: Mapping[str, str] = NO_VERDICTS,
    ) -> None:
        """Add a decision, and the verdicts behind it, to the chain."""
        self._chain.update(self._encoder.encode(decision))
        if verdicts:
            self._chain.update(self._encoder.encode(["verdicts", dict(verdicts)]))

    def operator_reset(self, record: OperatorReset) -> None:
        """Add an operator's reset to the chain."""
        self._chain.update(self._encoder.encode(["operator-reset", record]))

    @property
    def digest(self) -> str:
        """Hexadecimal digest of all so far."""
        return self._chain.hexdigest()

    def close(self) -> None:
        """Nothing to close."""


class MemoryJournal:
    """Keeps everything in memory: for tests and short runs.

    Attributes:
        ticks: samples and decision of every tick.
        verdicts: those of every tick, in the same order.
        resets: the number of ticks before each operator's reset, and its record.
    """

    def __init__(self) -> None:
        self.ticks: list[tuple[tuple[Sample, ...], Decision]] = []
        self.verdicts: list[dict[str, str]] = []
        self.resets: list[tuple[int, OperatorReset]] = []

    def tick(self, samples: Sequence[Sample], decision: Decision, verdicts: Mapping[str, str] = NO_VERDICTS) -> None:
        """Keep a tick."""
        self.ticks.append((tuple(samples), decision))
        self.verdicts.append(dict(verdicts))

    def operator_reset(self, record: OperatorReset) -> None:
        """Keep an operator's reset."""
        self.resets.append((len(self.ticks), record))

    def close(self) -> None:
        """Nothing to close."""
