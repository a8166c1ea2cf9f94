"""Several FMUs connected to each other as one twin: ``[twin] kind = "fmu-system"``. FMPy is imported on use."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Literal

import msgspec

from foreshock.hookspecs import hookimpl
from foreshock.twin import Twin, TwinSpec

__all__ = ["ConnectionConfig", "FmuSystemConfig", "PartConfig", "build_twin", "foreshock_twins", "twin_files"]


class PartConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One FMU of a system.

    Attributes:
        plant: name of a plant that ships with Foreshock, or the path of a plant's folder; or else give fmu.
        fmu: path of an FMU file for co-simulation, FMI 2.0 or 3.0.
        fmi_version: which FMI a plant is built for, 2 or 3.
        seed: its own parameter that receives the run's seed plus its place among the parts; beside the binding's.
    """

    plant: str = ""
    fmu: str = ""
    fmi_version: int = 3
    seed: str = ""


class ConnectionConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True, rename={"from_": "from"}):
    """An output that feeds an input.

    Attributes:
        from_: ``<part>.<output>``; in the file it is called ``from``.
        to: ``<part>.<input>``.
        delayed: carries the output's value one communication step late, on purpose: it breaks an algebraic loop.
    """

    from_: str
    to: str
    delayed: bool = False


class FmuSystemConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Which FMUs, how they are connected, and how their variables become channels.

    Attributes:
        binding: path of the binding file; its variables are ``<part>.<variable>``.
        parts: FMUs by name.
        connections: what feeds what.
        coupling: ``gauss-seidel`` steps the parts in order, each with the newest outputs of those before it; ``jacobi``
            steps all of them with the outputs of the last communication point.
    """

    binding: str
    parts: dict[str, PartConfig]
    connections: tuple[ConnectionConfig, ...] = ()
    coupling: Literal["gauss-seidel", "jacobi"] = "gauss-seidel"


def build_twin(config: FmuSystemConfig, robot: str, scratch: Path) -> Twin:
    """A twin of connected FMUs; everything temporary lies in scratch.

    Raises:
        BadInputError: the configuration, an FMU, a connection or the binding is wrong.
        MissingExtraError: FMPy is not installed, or cannot be imported.
        TwinError: an FMU cannot be instantiated.
    """
    from foreshock_twins.system._build import build

    return build(config, robot, scratch)


def twin_files(config: FmuSystemConfig) -> Mapping[str, Path]:
    """The FMU of every part, built if it is a plant's, and the binding."""
    from foreshock_twins.system._build import file_of

    return {**{f"fmu {k}": file_of(k, part) for k, part in config.parts.items()}, "binding": Path(config.binding)}


@hookimpl
def foreshock_twins() -> Sequence[TwinSpec]:
    """The twin kind ``fmu-system``."""
    summary = "Several co-simulation FMUs, outputs connected to inputs"
    return [TwinSpec(id="fmu-system", build=build_twin, config=FmuSystemConfig, summary=summary, files=twin_files)]
