"""The robot: its model, and capsules around its collision shapes."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pinocchio as pin

from foreshock.errors import ConfigError
from foreshock_detectors._floating_base import FloatingBase
from foreshock_detectors.proximity._bodies import BodyCapsule, body_capsules
from foreshock_detectors.proximity._cache import cached, content_digest
from foreshock_detectors.proximity._config import ProximityConfig
from foreshock_detectors.proximity._files import cache_folder, package_folders

__all__ = ["Robot"]


class Robot(FloatingBase):
    """A floating base with capsules.

    Attributes:
        capsules: fitted to the collision shapes, sorted by joint id.

    Raises:
        ConfigError: a file, mesh, joint or reference configuration does not exist or cannot be used.
    """

    def __init__(self, config: ProximityConfig) -> None:
        super().__init__(config, "proximity")
        geometry = self._geometry(config)
        meshes = sorted({Path(g.meshPath) for g in geometry.geometryObjects if Path(g.meshPath).is_file()})
        inputs = content_digest([self.urdf, *meshes], config.capsules)
        self.capsules: tuple[BodyCapsule, ...] = cached(
            cache_folder(config), inputs, lambda: body_capsules(self.model, geometry, config.capsules)
        )

    def _geometry(self, config: ProximityConfig) -> Any:
        folders = package_folders(config, self.urdf)
        try:
            return pin.buildGeomFromUrdf(
                self.model, os.fspath(self.urdf), pin.GeometryType.COLLISION, package_dirs=folders
            )
        except (ValueError, RuntimeError) as e:
            hint = "; is its package in proximity.package_dirs?"
            raise ConfigError("proximity.urdf", f"{self.urdf}: collision geometry: {e}", hint) from e
