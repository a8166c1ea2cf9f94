"""Where a robot's URDF and SRDF lie; TALOS of the example-robot-data package where none is named."""

from __future__ import annotations

from pathlib import Path

import pinocchio as pin

from foreshock.errors import ConfigError, nearest

__all__ = ["robot_files", "share_folder", "talos_files"]

_TALOS = Path("example-robot-data/robots/talos_data")


def share_folder() -> Path:
    """The share folder of Pinocchio's own cmeel.prefix, where wheels of robot models put their files."""
    prefix = next((p for p in Path(pin.__file__).parents if p.name == "cmeel.prefix"), None)
    return (prefix or Path(pin.__file__).parents[4]) / "share"


def talos_files() -> tuple[Path, Path]:
    """URDF and SRDF of TALOS (the reduced model); the wheel of example-robot-data has no Python module to ask."""
    return share_folder() / _TALOS / "robots/talos_reduced.urdf", share_folder() / _TALOS / "srdf/talos.srdf"


def robot_files(urdf: str, srdf: str, detector: str) -> tuple[Path, Path | None]:
    """URDF and, if there is one, SRDF.

    Args:
        urdf: as configured; ``""`` is TALOS.
        srdf: as configured; ``""`` is TALOS's, or none when urdf is set.
        detector: id and extra of the detector, for errors.

    Raises:
        ConfigError: a file does not exist.
    """
    found: tuple[Path, Path | None]
    if urdf:
        found = Path(urdf), Path(srdf) if srdf else None
    else:
        talos_urdf, talos_srdf = talos_files()
        found = talos_urdf, Path(srdf) if srdf else talos_srdf
    for place, path in zip((f"{detector}.urdf", f"{detector}.srdf"), found, strict=True):
        if path is not None and not path.is_file():
            hint = "" if urdf else f"; is example-robot-data installed? pip install 'foreshock[{detector}]'"
            beside = [p.name for p in path.parent.glob(f"*{path.suffix}")] if path.parent.is_dir() else []
            raise ConfigError(place, f"{path}: no such file", nearest(path.name, beside) or hint)
    return found
