"""A co-simulation FMU as a twin: ``[twin] kind = "fmu"`` in a scenario. Importing this module does not import FMPy."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import msgspec

from foreshock.hookspecs import hookimpl
from foreshock.twin import Twin, TwinSpec

__all__ = ["FmiTwinConfig", "build_twin", "foreshock_twins", "twin_files"]


class FmiTwinConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Which FMU, and how its variables become channels.

    Attributes:
        plant: name of a plant that ships with Foreshock, or the path of a plant's folder; or else give fmu.
        fmu: path of an FMU file for co-simulation, FMI 2.0 or 3.0.
        binding: path of the binding file; by default the ``binding.toml`` in the plant's folder.
        fmi_version: which FMI a plant is built for, 2 or 3.
    """

    plant: str = ""
    fmu: str = ""
    binding: str = ""
    fmi_version: int = 3


def build_twin(config: FmiTwinConfig, robot: str, scratch: Path) -> Twin:
    """An FMU twin; everything temporary lies in scratch.

    Raises:
        BadInputError: the configuration, the FMU or the binding is wrong.
        MissingExtraError: FMPy is not installed, or cannot be imported.
        TwinError: the FMU cannot be instantiated.
    """
    from foreshock_twins.fmi._build import build

    return build(config, robot, scratch)


def twin_files(config: FmiTwinConfig) -> Mapping[str, Path]:
    """The FMU, built if it is a plant's, and the binding."""
    from foreshock_twins.fmi._build import files_of

    fmu, binding = files_of(config)
    return {"fmu": fmu, "binding": binding}


@hookimpl
def foreshock_twins() -> Sequence[TwinSpec]:
    """The twin kind ``fmu``."""
    summary = "A co-simulation FMU, FMI 2.0 or 3.0"
    return [TwinSpec(id="fmu", build=build_twin, config=FmiTwinConfig, summary=summary, files=twin_files)]
