"""From a configuration to a twin of connected FMUs."""

from __future__ import annotations

import re
from pathlib import Path

from foreshock.errors import ConfigError
from foreshock_fmus import build_fmu
from foreshock_twins.fmi._binding import read_binding
from foreshock_twins.fmi._build import check_step, need_fmpy, open_fmu
from foreshock_twins.fmi._instance import FmuInstance
from foreshock_twins.fmi._layout import Layout
from foreshock_twins.fmi._log import FmuLog
from foreshock_twins.fmi._twin import FmuTwin
from foreshock_twins.system import FmuSystemConfig, PartConfig
from foreshock_twins.system._connections import connect, order_of
from foreshock_twins.system._parts import Part, SystemVariables
from foreshock_twins.system._stepper import FmuSystem, layouts_of

__all__ = ["build", "file_of"]

_NAME = re.compile(r"[A-Za-z_]\w*", re.ASCII)


def build(config: FmuSystemConfig, robot: str, scratch: Path) -> FmuTwin:
    """Open every FMU, check the connections, read the binding, instantiate.

    Raises:
        BadInputError: see foreshock_twins.system.build_twin.
    """
    need_fmpy()
    if not config.parts:
        raise ConfigError("twin.parts", "is empty", "; expected [twin.parts.<name>] tables")
    files, opened, parts = {}, {}, []
    for name, entry in config.parts.items():
        files[name] = file_of(name, entry)
        opened[name] = open_fmu(files[name], scratch)
        parts.append(Part.of(name, opened[name][0], files[name].name, entry.seed))
    connections = connect(config.connections, parts)
    fed = frozenset(f"{c.target}.{c.input.name}" for c in connections)
    variables = SystemVariables(parts, fed)
    path = Path(config.binding)
    binding = read_binding(path, variables)
    for part in parts:
        check_step(opened[part.name][0], binding, path)
        if part.seed is not None and (binding.seed is None or binding.seed.name == f"{part.name}.{part.seed.name}"):
            place = f"twin.parts.{part.name}.seed"
            raise ConfigError(place, f"{part.seed.name!r} needs another seed of the binding", "; give binding.seed")
    layout, log = Layout(binding.items()), FmuLog(scratch / "fmu.log")
    layouts = layouts_of(layout, variables, parts, connections)
    instances: dict[str, FmuInstance] = {}
    try:
        for name, (description, folder) in opened.items():
            instances[name] = FmuInstance(description, files[name], folder, layouts[name], log)
    except BaseException:
        for instance in instances.values():
            instance.close()
        raise
    order = order_of(connections, parts)
    system = FmuSystem(variables, layout, instances, layouts, parts, connections, order, config.coupling, binding.seed)
    return FmuTwin(robot, variables, binding, layout, system, log)


def file_of(name: str, part: PartConfig) -> Path:
    """The FMU of a part, built if it is a plant."""
    place = f"twin.parts.{name}"
    if not _NAME.fullmatch(name):
        raise ConfigError(place, f"{name!r} is no name", "; expected letters, digits and _ alone")
    if bool(part.plant) == bool(part.fmu):
        raise ConfigError(place, "give one of plant and fmu", f"; plant is {part.plant!r}, fmu is {part.fmu!r}")
    if part.plant:
        return build_fmu(part.plant, part.fmi_version)
    if not Path(part.fmu).is_file():
        raise ConfigError(f"{place}.fmu", f"there is no file {part.fmu!r}")
    return Path(part.fmu)
