"""Where robot models and fitted capsules lie."""

from __future__ import annotations

import os
from pathlib import Path

import pinocchio as pin

from foreshock.errors import ConfigError, nearest
from foreshock_detectors.proximity._config import ProximityConfig

__all__ = ["cache_folder", "package_folders", "robot_files", "talos_files"]

_TALOS = Path("example-robot-data/robots/talos_data")


def talos_files() -> tuple[Path, Path]:
    """URDF and SRDF of TALOS (the reduced model) in the share folder of Pinocchio's own cmeel.prefix."""
    return _share() / _TALOS / "robots/talos_reduced.urdf", _share() / _TALOS / "srdf/talos.srdf"


def robot_files(config: ProximityConfig) -> tuple[Path, Path | None]:
    """URDF and, if there is one, SRDF.

    Raises:
        ConfigError: a file does not exist.
    """
    if config.urdf:
        urdf, srdf = Path(config.urdf), Path(config.srdf) if config.srdf else None
    else:
        urdf, talos_srdf = talos_files()
        srdf = Path(config.srdf) if config.srdf else talos_srdf
    for place, path in (("proximity.urdf", urdf), ("proximity.srdf", srdf)):
        if path is not None and not path.is_file():
            hint = "" if config.urdf else "; is example-robot-data installed? pip install 'foreshock[proximity]'"
            beside = [p.name for p in path.parent.glob(f"*{path.suffix}")] if path.parent.is_dir() else []
            raise ConfigError(place, f"{path}: no such file", nearest(path.name, beside) or hint)
    return urdf, srdf


def package_folders(config: ProximityConfig, urdf: Path) -> list[str]:
    """Folders that may hold the packages of ``package://`` meshes, in the order in which they are tried."""
    return [*config.package_dirs, os.fspath(_share()), *map(os.fspath, urdf.resolve().parents)]


def cache_folder(config: ProximityConfig) -> Path | None:
    """The folder of fitted capsules, existing or not; None if this user has no home."""
    if config.cache_dir:
        return Path(config.cache_dir)
    root = os.environ.get("FORESHOCK_CACHE")
    if root:
        return Path(root) / "capsules"
    try:
        return Path.home() / ".cache/foreshock/capsules"
    except RuntimeError:
        return None


def _share() -> Path:
    prefix = next((p for p in Path(pin.__file__).parents if p.name == "cmeel.prefix"), None)
    return (prefix or Path(pin.__file__).parents[4]) / "share"
