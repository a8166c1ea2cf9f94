"""Runs any plant's FMU through FMPy with parameters and inputs over time, and logs variables by name."""

from __future__ import annotations

import atexit
import shutil
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave

from foreshock_fmus import build_fmu

Log = dict[str, npt.NDArray[np.float64]]
Inputs = Callable[[float, Mapping[str, float]], Mapping[str, float]]
"""Of the time and the newest logged values; gives the inputs that change."""


class PlantRunner:
    """One FMU instance, reused by reset."""

    def __init__(self, plant: str, fmi_version: int = 3) -> None:
        path = build_fmu(plant, fmi_version)
        self.description = read_model_description(path)
        self.version = fmi_version
        folder = extract(path)
        atexit.register(shutil.rmtree, folder, ignore_errors=True)
        slave: Any = FMU2Slave if fmi_version == 2 else FMU3Slave
        self.fmu = slave(
            guid=self.description.guid,
            unzipDirectory=folder,
            modelIdentifier=self.description.coSimulation.modelIdentifier,
            instanceName=plant,
        )
        self.fmu.instantiate()
        self.size = {
            v.name: int(np.prod([d.start for d in v.dimensions or ()] or [1])) for v in self.description.modelVariables
        }
        self.reference = {v.name: v.valueReference for v in self.description.modelVariables}
        # FMI 2 has no arrays: a vector is one variable per component
        self.start = {
            v.name: float(v.start) for v in self.description.modelVariables
            if v.start is not None and self.size[v.name] == 1
        }  # fmt: skip

    def set(self, values: Mapping[str, float]) -> None:
        """Set parameters or inputs by name."""
        references = [self.reference[name] for name in values]
        write = self.fmu.setReal if self.version == 2 else self.fmu.setFloat64
        if references:
            write(references, [float(v) for v in values.values()])

    def get(self, names: Sequence[str]) -> list[float]:
        """Scalars by name; of a vector in FMI 3 the components follow each other."""
        references = [self.reference[name] for name in names]
        if self.version == 2:
            return list(self.fmu.getReal(references))
        return list(self.fmu.getFloat64(references, nValues=sum(self.size[name] for name in names)))

    def run(
        self,
        parameters: Mapping[str, float],
        t_end: float,
        watch: Sequence[str],
        inputs: Inputs | None = None,
        h: float = 0.01,
    ) -> Log:
        """The watched scalars after every step of h, and the time as ``t``; the first row is the start."""
        self.fmu.reset()
        self.set(parameters)
        if self.version == 2:
            self.fmu.setupExperiment(startTime=0.0)
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()
        n = round(t_end / h)
        rows = np.zeros((n + 1, len(watch)))
        rows[0] = self.get(watch)
        for k in range(n):
            if inputs is not None:
                self.set(inputs(k * h, dict(zip(watch, rows[k].tolist(), strict=True))))
            self.fmu.doStep(currentCommunicationPoint=k * h, communicationStepSize=h)
            rows[k + 1] = self.get(watch)
        return {"t": np.arange(n + 1) * h, **{name: rows[:, i] for i, name in enumerate(watch)}}


@cache
def runner(plant: str, fmi_version: int = 3) -> PlantRunner:
    """The runner of a plant, built once a process."""
    return PlantRunner(plant, fmi_version)
