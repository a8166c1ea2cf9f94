"""One instance of an FMU, called through preallocated buffers: about 3 us a step instead of 15.

FMPy loads the library and names its functions; the calls on the hot path then go straight through ctypes with raw
addresses. ctypes releases the GIL meanwhile, so that a watchdog thread can run while the FMU hangs.
"""

from __future__ import annotations

import ctypes
import itertools
import math
import os
import struct
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from foreshock.errors import ConfigError, TwinError
from foreshock_twins.fmi._layout import Layout, Values
from foreshock_twins.fmi._log import FmuLog
from foreshock_twins.fmi._variables import Variable

__all__ = ["FmuInstance"]

_OK, _WARNING, _DISCARD, _FATAL = 0, 1, 2, 4
_STATUS = {2: "discard", 3: "error", 4: "fatal", 5: "pending"}
_C_TYPE: dict[int, dict[str, tuple[str, Any]]] = {
    2: {
        "Real": ("Real", ctypes.c_double),
        "Integer": ("Integer", ctypes.c_int),
        "Enumeration": ("Integer", ctypes.c_int),
        "Boolean": ("Boolean", ctypes.c_int),
    },
    3: {
        "Float64": ("Float64", ctypes.c_double),
        "Float32": ("Float32", ctypes.c_float),
        "Boolean": ("Boolean", ctypes.c_bool),
        "Enumeration": ("Int64", ctypes.c_int64),
        **{
            f"{u}Int{n}": (f"{u}Int{n}", getattr(ctypes, f"c_{u.lower()}int{n}"))
            for u in ("", "U")
            for n in (8, 16, 32, 64)
        },
    },
}

# FMPy's formatting of FMI 2 log messages keeps one logger per process: this one; it finds the instance by its number.
_logs: dict[int, FmuLog] = {}
_numbers = itertools.count(1)
_logger_2: Any = None


class FmuInstance:
    """A co-simulation instance.

    Args:
        description: FMPy's ModelDescription.
        fmu: the user's file, for errors.
        folder: where the FMU is extracted.
        layout: what a step yields.
        log: takes what the FMU says.

    Raises:
        ConfigError: the library does not load here.
        TwinError: the FMU refuses to be instantiated.
    """

    def __init__(self, description: Any, fmu: Path, folder: Path, layout: Layout, log: FmuLog) -> None:
        self._description, self._fmu, self._folder = description, fmu, folder
        self._layout, self._log = layout, log
        self._version: int = description.fmiMajorVersion
        self._fresh = False
        self._dead = True
        self._slave: Any = None
        self._number = next(_numbers)
        _logs[self._number] = log
        try:
            self._load()
        except BaseException:
            del _logs[self._number]
            raise

    def reset(self) -> None:
        """Back to the state after instantiation; an FMU that cannot go back is instantiated anew."""
        if not self._fresh and not self._dead:
            status = self._call("Reset", (), ())
            if status > _WARNING:
                self._dead = True
            self._fresh = True
        if self._dead:
            self._unload()
            self._load()

    def initialize(self, values: Mapping[Variable, float]) -> None:
        """Set parameters and start values, then initialize at time 0.

        Raises:
            TwinError: the FMU refuses.
        """
        self._fresh = False
        self.set(values)
        double, integer, boolean = ctypes.c_double, ctypes.c_int, ctypes.c_bool
        if self._version == 2:
            types: tuple[Any, ...] = (integer, double, double, integer, double)
            self._check(self._call("SetupExperiment", types, (0, 0.0, 0.0, 0, 0.0)), "setup", 0.0)
            self._check(self._call("EnterInitializationMode", (), ()), "entering initialization", 0.0)
        else:
            types = (boolean, double, double, boolean, double)
            status = self._call("EnterInitializationMode", types, (False, 0.0, 0.0, False, 0.0))
            self._check(status, "entering initialization", 0.0)
        self._check(self._call("ExitInitializationMode", (), ()), "initialization", 0.0)

    def set(self, values: Mapping[Variable, float], t: float = 0.0) -> None:
        """Set variables by type; integers are rounded, Booleans are true above 0.5."""
        by_type: dict[str, list[Variable]] = {}
        for variable in values:
            by_type.setdefault(variable.type, []).append(variable)
        for kind, group in by_type.items():
            name, c_type = _C_TYPE[self._version][kind]
            references = (ctypes.c_uint32 * len(group))(*(v.reference for v in group))
            numbers = [_converted(values[v], kind) for v in group]
            buffer = (c_type * len(group))(*numbers)
            size = ctypes.c_size_t
            arguments: tuple[Any, ...] = (ctypes.addressof(references), len(group), ctypes.addressof(buffer))
            types: tuple[Any, ...] = (ctypes.c_void_p, size, ctypes.c_void_p)
            if self._version == 3:
                arguments, types = (*arguments, len(group)), (*types, size)
            names = ", ".join(v.name for v in group)
            self._check(self._call(f"Set{name}", types, arguments), f"setting {names}", t)

    def step(self, t: float, h: float) -> Values:
        """Advance from t by h (s), and read.

        Raises:
            TwinError: ``discard``, ``error``, or ``nan`` with the variable's name.
        """
        status = self._step(t, h)
        if status > _WARNING:
            self._check(status, "step", t)
        if self._terminate.value:
            detail = f"the FMU asked to end the simulation in the step from t = {t:.9g} s"
            raise TwinError("error", detail, self._log.text())
        return self.read(t + h)

    def read(self, t: float) -> Values:
        """All bound values at time t; constants last.

        Raises:
            TwinError: ``nan`` if one is not finite, ``error`` if the FMU refuses.
        """
        values = self._constants
        for get, unpack in self._readers:
            status = get()
            if status > _WARNING:
                self._check(status, "reading variables", t)
            values = unpack() + values
        if not math.isfinite(sum(values)):
            for variable, value in zip(self._layout.variables, values, strict=False):
                if not math.isfinite(value):
                    detail = f"variable {variable.name!r} is {value!r} at t = {t:.9g} s"
                    raise TwinError("nan", detail, self._log.text())
        return values

    def close(self) -> None:
        """Free the instance and unload the library; idempotent."""
        self._unload()
        _logs.pop(self._number, None)

    def _load(self) -> None:
        """Load the library and instantiate; FMPy changes the working directory meanwhile."""
        from fmpy.fmi2 import FMU2Slave
        from fmpy.fmi3 import FMU3Slave

        cls = FMU2Slave if self._version == 2 else FMU3Slave
        identifier = self._description.coSimulation.modelIdentifier
        cwd = Path.cwd()
        try:
            slave = cls(
                guid=self._description.guid,
                unzipDirectory=str(self._folder),
                modelIdentifier=identifier,
                instanceName=identifier,
            )
        except Exception as error:  # noqa: BLE001 - FMPy raises plain Exception when a library does not load
            problem = f"does not load: {str(error).replace(f'{self._folder}{os.sep}', '').rstrip('.')}"
            raise ConfigError(str(self._fmu), problem, _platforms(self._folder)) from None
        finally:
            os.chdir(cwd)
        try:
            if self._version == 2:
                slave.instantiate(callbacks=_callbacks_2(self._number))
            else:
                log = self._log
                slave.instantiate(logMessage=lambda _, status, category, message: log.write(status, category, message))
        except Exception as error:  # noqa: BLE001 - as above
            slave.freeLibrary()
            raise TwinError("error", f"FMU {identifier} cannot be instantiated: {error}", self._log.text()) from None
        self._slave, self._component = slave, slave.component
        self._fresh, self._dead = True, False
        self._bind()

    def _unload(self) -> None:
        if self._slave is None:
            return
        slave, self._slave = self._slave, None
        if not self._dead:  # a dead instance may not be called, not even to free it (FMI 2.0.4, 2.1.8)
            slave.freeInstance()
        self._readers: list[tuple[Callable[[], int], Callable[[], Values]]] = []

    def _bind(self) -> None:
        """Buffers and function pointers of the hot path."""
        self._constants = self._layout.constants
        # Values grow from the right: constants, then the last group in front of them, the doubles in front of all.
        self._kept: list[Any] = []
        self._readers = [self._reader(kind, group) for kind, group in reversed(self._layout.groups)]
        double, pointer = ctypes.c_double, ctypes.c_void_p
        component = self._component
        self._terminate = ctypes.c_bool(False)
        if self._version == 2:
            do_step = self._function("DoStep", (pointer, double, double, ctypes.c_int))
            self._step: Callable[[float, float], int] = lambda t, h: do_step(component, t, h, 1)
            return
        do_step = self._function("DoStep", (pointer, double, double, ctypes.c_bool, pointer, pointer, pointer, pointer))
        self._flags = (ctypes.c_bool * 2)()
        self._last_time = ctypes.c_double()
        event, early = ctypes.addressof(self._flags), ctypes.addressof(self._flags) + 1
        terminate, last = ctypes.addressof(self._terminate), ctypes.addressof(self._last_time)
        self._step = lambda t, h: do_step(component, t, h, True, event, terminate, early, last)

    def _reader(self, kind: str, group: tuple[Variable, ...]) -> tuple[Callable[[], int], Callable[[], Values]]:
        """A call that fills a buffer, and one that gives the buffer as a tuple."""
        n, component = len(group), self._component
        name, c_type = _C_TYPE[self._version][kind]
        references = (ctypes.c_uint32 * n)(*(v.reference for v in group))
        buffer = (c_type * n)()
        size, pointer = ctypes.c_size_t, ctypes.c_void_p
        at, to = ctypes.addressof(references), ctypes.addressof(buffer)
        if self._version == 2:
            get = self._function(f"Get{name}", (pointer, pointer, size, pointer))

            def fill() -> int:
                return int(get(component, at, n, to))
        else:
            get = self._function(f"Get{name}", (pointer, pointer, size, pointer, size))

            def fill() -> int:
                return int(get(component, at, n, to, n))

        self._kept.append((references, buffer))  # their addresses are in use
        if c_type is ctypes.c_double:
            unpack_from = struct.Struct(f"{n}d").unpack_from
            return fill, lambda: unpack_from(buffer)
        return fill, lambda: tuple([float(v) for v in buffer])

    def _function(self, name: str, types: tuple[Any, ...]) -> Any:
        address = ctypes.cast(self._slave._functions[f"fmi{self._version}{name}"], ctypes.c_void_p).value
        return ctypes.CFUNCTYPE(ctypes.c_int, *types)(address or 0)

    def _call(self, name: str, types: tuple[Any, ...], arguments: tuple[Any, ...]) -> int:
        return int(self._function(name, (ctypes.c_void_p, *types))(self._component, *arguments))

    def _check(self, status: int, call: str, t: float) -> None:
        if status in (_OK, _WARNING):
            return
        self._dead = self._dead or status == _FATAL
        kind = "discard" if status == _DISCARD else "error"
        name = _STATUS.get(status, f"illegal status {status}")
        raise TwinError(kind, f"{call} at t = {t:.9g} s gave {name}", self._log.text())


def _converted(value: float, kind: str) -> float | int | bool:
    if kind == "Boolean":
        return value > 0.5
    return value if kind in ("Real", "Float64", "Float32") else round(value)


def _platforms(folder: Path) -> str:
    found = sorted(p.name for p in (folder / "binaries").glob("*"))
    return f"; it holds binaries for {', '.join(found)}" if found else "; it holds no binaries"


def _callbacks_2(number: int) -> Any:
    """The callbacks of FMI 2 with the logger of this process and the instance's number as environment."""
    global _logger_2
    from fmpy import calloc, free
    from fmpy.fmi1 import printLogMessage
    from fmpy.fmi2 import (
        fmi2CallbackAllocateMemoryTYPE,
        fmi2CallbackFreeMemoryTYPE,
        fmi2CallbackFunctions,
        fmi2CallbackLoggerTYPE,
    )
    from fmpy.logging import addLoggerProxy

    if _logger_2 is None:

        def dispatch(environment: int | None, instance: bytes, status: int, category: bytes, message: bytes) -> None:
            log = _logs.get(environment or 0)
            if log is None:  # an FMU that somebody else runs through FMPy in this process
                printLogMessage(environment, instance, status, category, message)
            else:
                log.write(status, category, message)

        _logger_2 = fmi2CallbackLoggerTYPE(dispatch)
    callbacks = fmi2CallbackFunctions()
    callbacks.logger = _logger_2
    callbacks.allocateMemory = fmi2CallbackAllocateMemoryTYPE(calloc)
    callbacks.freeMemory = fmi2CallbackFreeMemoryTYPE(free)
    callbacks.componentEnvironment = number
    addLoggerProxy(ctypes.byref(callbacks))
    return callbacks
