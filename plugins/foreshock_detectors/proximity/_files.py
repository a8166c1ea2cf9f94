"""Where meshes and fitted capsules lie."""

from __future__ import annotations

import os
from pathlib import Path

from foreshock_detectors._robot_files import share_folder, talos_files
from foreshock_detectors.proximity._config import ProximityConfig

__all__ = ["cache_folder", "package_folders", "talos_files"]


def package_folders(config: ProximityConfig, urdf: Path) -> list[str]:
    """Folders that may hold the packages of ``package://`` meshes, in the order in which they are tried."""
    return [*config.package_dirs, os.fspath(share_folder()), *map(os.fspath, urdf.resolve().parents)]


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
