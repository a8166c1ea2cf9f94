"""Detectors for a child process: built by name, told what to do by the value on their channel."""

from __future__ import annotations

import ctypes
import os
import re
from collections.abc import Sequence

import msgspec
import numpy as np

from foreshock.detector import DetectorSpec, Input, Inputs
from foreshock.hookspecs import hookimpl
from foreshock.messages import Scalar
from foreshock.records import Indication, SampleRef

SLIP = "foot-micro-slip"
ABSENT, PRESENT, SEGFAULT, HANG, RAISE, EXIT, GARBAGE, NUMPY, STRING, FLOOD, ABORT = map(float, range(11))


class CellConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """broken: refuse to be built; mute_ns: not used."""

    broken: bool = False


def native_hang() -> None:
    """Some 1e11 steps of backtracking in C, with the interpreter held throughout."""
    re.match(r"(a+)+$", "a" * 40 + "b")


class Cell:
    """Does what the newest value says; reports its process as a measure."""

    def reset(self, seed: int) -> None:
        self._seed = seed

    def update(self, now_ns: int, inputs: Inputs) -> Sequence[Indication]:
        sample = inputs.latest["value"]
        what = sample.value.data
        if what == SEGFAULT:
            ctypes.string_at(0)
        elif what == ABORT:
            os.abort()
        elif what == HANG:
            native_hang()
        elif what == RAISE:
            raise ValueError("in the cell")
        elif what == EXIT:
            os._exit(7)
        elif what == GARBAGE:
            return [("not", "an", "indication")]  # type: ignore[list-item]  # a rogue
        elif what == STRING:
            return SLIP  # type: ignore[return-value]  # a rogue
        number = np.float64(1.0) if what == NUMPY else 1.0
        measures = {"pid": float(os.getpid()), "seed": float(self._seed)}
        if what == FLOOD:
            print("x" * 200_000, flush=True)  # a rogue
        ref = (SampleRef(sample.channel, sample.stamp_ns),)
        return [
            Indication(SLIP, "", sample.stamp_ns, what == PRESENT, number, 1.0, "1", number, ref, measures=measures)
        ]


def build(config: CellConfig) -> Cell:
    if config.broken:
        raise ZeroDivisionError("broken on purpose")
    return Cell()


def build_elsewhere(config: CellConfig) -> Cell:
    import a_package_that_nobody_has  # noqa: F401 # on purpose

    return Cell()


CELL = DetectorSpec(
    "cell",
    (SLIP,),
    (Input("value", "x", Scalar, max_age_s=10.0),),
    build,
    CellConfig,
    isolation="process",
    extra="balance",
)


@hookimpl
def foreshock_detectors() -> Sequence[DetectorSpec]:
    return [CELL]
