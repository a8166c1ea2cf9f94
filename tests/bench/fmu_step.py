"""FMU stepping in a supervised run beside a bare FMPy loop over the same FMU."""

from __future__ import annotations

import shutil
import statistics
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import fmpy
from fmpy.fmi3 import FMU3Slave

from foreshock.registry import Registry
from foreshock.session.isolated import build_twin
from foreshock.session.scenario import find_scenario
from foreshock_fmus import build_fmu
from tests.bench.rows import Row

__all__ = ["bare_slave", "rows"]

STEPS, STEP_S = 2000, 0.005


@contextmanager
def bare_slave() -> Iterator[tuple[Any, list[int]]]:
    """FMPy's own slave of the balance plant, instantiated, and the value references of its outputs."""
    path = str(build_fmu("balance", 3))
    description = fmpy.read_model_description(path)
    outputs = [v.valueReference for v in description.modelVariables if v.causality == "output"]
    folder = fmpy.extract(path)
    slave: Any = FMU3Slave(
        guid=description.guid,
        unzipDirectory=folder,
        modelIdentifier=description.coSimulation.modelIdentifier,
        instanceName="bare",
    )
    slave.instantiate()
    yield slave, outputs
    slave.terminate()
    slave.freeInstance()
    shutil.rmtree(folder)


def bare_us() -> float:
    """CPU time of doStep and one getFloat64 of all outputs."""
    with bare_slave() as (slave, outputs):
        slave.enterInitializationMode()
        slave.exitInitializationMode()
        begin = time.process_time_ns()
        for k in range(STEPS):
            slave.doStep(k * STEP_S, STEP_S)
            slave.getFloat64(outputs)
        return (time.process_time_ns() - begin) / STEPS / 1e3


def twin_us() -> float:
    """CPU time of one step of the twin: doStep, read, check, messages, referee."""
    registry = Registry()
    scenario = find_scenario("a1-fall-onto-human-nominal", registry)
    with tempfile.TemporaryDirectory() as scratch:
        twin = build_twin(scenario, registry, Path(scratch))
        twin.reset(scenario.parameters, 1)
        begin = time.process_time_ns()
        for k in range(STEPS):
            twin.advance((k + 1) * twin.period_ns)
        spent = (time.process_time_ns() - begin) / STEPS / 1e3
        twin.close()
    return spent


def rows() -> list[Row]:
    """One row; the two are measured in turn."""
    pairs = [(twin_us(), bare_us()) for _ in range(5)]
    value, reference = (statistics.median(column) for column in zip(*pairs, strict=True))
    ratio = value / reference
    name = "FMU step of a supervised run, samples included"
    return [Row(name, value, "us CPU", reference, "bare FMPy loop: doStep + getFloat64", ratio, "< 1.5 x", ratio < 1.5)]
