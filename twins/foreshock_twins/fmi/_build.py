"""From a configuration to an FMU twin."""

from __future__ import annotations

import importlib
import math
import os
import tempfile
import zipfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

from foreshock.clock import NS_PER_S
from foreshock.errors import ConfigError, MissingExtraError
from foreshock_fmus import build_fmu, find_plant
from foreshock_twins.fmi._binding import Binding, read_binding
from foreshock_twins.fmi._instance import FmuInstance
from foreshock_twins.fmi._layout import Layout
from foreshock_twins.fmi._log import FmuLog
from foreshock_twins.fmi._twin import FmuTwin
from foreshock_twins.fmi._variables import Variables

if TYPE_CHECKING:
    from foreshock_twins.fmi import FmiTwinConfig

__all__ = ["build", "check_step", "files_of", "need_fmpy", "open_fmu"]


def build(config: FmiTwinConfig, robot: str, scratch: Path) -> FmuTwin:
    """Build the plant's FMU if need be, extract it into scratch, read its binding, instantiate.

    Raises:
        BadInputError: see foreshock_twins.fmi.build_twin.
    """
    need_fmpy()
    fmu, binding_path = files_of(config)
    description, folder = open_fmu(fmu, scratch)
    variables = Variables(description, fmu.name)
    binding = read_binding(binding_path, variables)
    check_step(description, binding, binding_path)
    layout = Layout(binding.items())
    log = FmuLog(scratch / "fmu.log")
    instance = FmuInstance(description, fmu, folder, layout, log)
    return FmuTwin(robot, variables, binding, layout, instance, log)


def need_fmpy() -> None:
    """Import what is used of FMPy, so that a missing or broken one is said before anything is built.

    Raises:
        MissingExtraError: an import fails, be it FMPy's own or that of a package which it needs.
    """
    try:
        for module in ("fmpy", "fmpy.model_description", "fmpy.fmi2", "fmpy.fmi3"):
            importlib.import_module(module)
    except ImportError as error:
        problem = f"needs fmpy, which cannot be imported: {error}"
        raise MissingExtraError("twin fmu", problem, "; run: pip install 'foreshock[fmi]'") from error


def files_of(config: FmiTwinConfig) -> tuple[Path, Path]:
    """The FMU and the binding that the configuration means."""
    if bool(config.plant) == bool(config.fmu):
        raise ConfigError("twin", "give one of plant and fmu", f"; plant is {config.plant!r}, fmu is {config.fmu!r}")
    if config.plant:
        binding = Path(config.binding) if config.binding else find_plant(config.plant) / "binding.toml"
        return build_fmu(config.plant, config.fmi_version), binding
    fmu = Path(config.fmu)
    if not fmu.is_file():
        raise ConfigError("twin.fmu", f"there is no file {config.fmu!r}")
    if not config.binding:
        raise ConfigError("twin.binding", "is missing", "; an FMU that is given as a file needs a binding file")
    return fmu, Path(config.binding)


def open_fmu(fmu: Path, scratch: Path) -> tuple[Any, Path]:
    """Extract the FMU into a new folder under scratch and read its model description, validated."""
    import fmpy
    from fmpy.model_description import ValidationError

    folder = Path(tempfile.mkdtemp(prefix="fmu-", dir=scratch)).absolute()
    try:
        fmpy.extract(fmu, folder)
        description = fmpy.read_model_description(folder)
    except ValidationError as error:
        raise ConfigError(str(fmu), "its model description is not valid", ":\n" + "\n".join(error.problems)) from None
    except zipfile.BadZipFile as error:
        raise ConfigError(str(fmu), f"is no FMU: {error}") from None
    except Exception as error:  # noqa: BLE001 - FMPy raises plain Exception for most defects of an FMU
        raise ConfigError(str(fmu), f"cannot be read: {str(error).replace(f'{folder}{os.sep}', '')}") from None
    if description.fmiVersion != "2.0" and not description.fmiVersion.startswith("3.0"):
        raise ConfigError(str(fmu), f"is of FMI {description.fmiVersion}", "; expected 2.0 or 3.0")
    if description.coSimulation is None:
        raise ConfigError(str(fmu), "is not for co-simulation", "; export it again with the solver inside")
    return description, folder


def check_step(description: Any, binding: Binding, path: Path) -> None:
    """An FMU with a fixed internal step can only be called at multiples of it (FMI 3.0, 4.3)."""
    fixed = description.coSimulation.fixedInternalStepSize
    if fixed is None or float(fixed) <= 0.0:
        return
    step_s = binding.step_ns / NS_PER_S
    steps = round(step_s / float(fixed))
    if steps < 1 or not math.isclose(steps * float(fixed), step_s, rel_tol=1e-9):
        hint = f"; expected a multiple of the FMU's own step, {fixed} s"
        raise ConfigError(f"{path}: binding.step_s", f"is {step_s!r} s", hint)
