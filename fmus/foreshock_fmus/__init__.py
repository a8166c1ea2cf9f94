"""Plant models as FMUs: C sources and descriptions, the adapter that speaks FMI 2.0 and 3.0, and the builder.

A plant is a folder ``<name>/`` with ``<name>.toml`` (variables, units, start values), C files that implement
``adapter/plant.h``, and for use as a twin a ``binding.toml``.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from foreshock.hookspecs import hookimpl
from foreshock_fmus._build import build_fmu, default_cache, find_plant, plants
from foreshock_fmus._description import PlantDescription, PlantVariable, read_plant
from foreshock_fmus._toml import TomlTable
from foreshock_fmus._units import BASE_UNITS, Unit, parse_unit

__all__ = [
    "BASE_UNITS",
    "PlantDescription",
    "PlantVariable",
    "TomlTable",
    "Unit",
    "build_fmu",
    "default_cache",
    "find_plant",
    "foreshock_scenarios",
    "parse_unit",
    "plants",
    "read_plant",
]


@hookimpl
def foreshock_scenarios() -> Sequence[Path]:
    """The scenarios of this package, sorted by name."""
    return sorted((Path(__file__).parent / "scenarios").glob("*.toml"))
