"""A row of the benchmark table, and what every benchmark needs to measure one."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable

import msgspec

__all__ = ["Row", "cpu_us", "median_us"]


class Row(msgspec.Struct, frozen=True):
    """name: value in unit, beside a reference of the same run; ratio = value / reference; aim and whether it holds."""

    name: str
    value: float
    unit: str
    reference: float
    reference_name: str
    ratio: float
    aim: str
    holds: bool


def cpu_us(call: Callable[[], object], times: int) -> float:
    """CPU time of one call in us, over so many."""
    begin = time.process_time_ns()
    for _ in range(times):
        call()
    return (time.process_time_ns() - begin) / times / 1e3


def median_us(call: Callable[[], object], times: int, rounds: int = 9) -> float:
    """Median over rounds of cpu_us."""
    return statistics.median(cpu_us(call, times) for _ in range(rounds))
