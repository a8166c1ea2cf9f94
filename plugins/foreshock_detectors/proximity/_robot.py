"""The robot: a floating-base Pinocchio model with its capsules, checked by name before anything is computed."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from foreshock.errors import ConfigError, nearest
from foreshock_detectors.proximity._bodies import BodyCapsule, body_capsules
from foreshock_detectors.proximity._cache import cached, content_digest
from foreshock_detectors.proximity._config import ProximityConfig
from foreshock_detectors.proximity._files import cache_folder, package_folders, robot_files

__all__ = ["Robot"]


class Robot:
    """What is fixed about a robot.

    Attributes:
        model: pinocchio.Model with a free flyer as its root.
        reference: configuration vector of the reference posture, shape (nq,).
        capsules: fitted to the collision shapes, sorted by joint id.

    Raises:
        ConfigError: a file, mesh, joint or reference configuration does not exist or cannot be used.
    """

    def __init__(self, config: ProximityConfig) -> None:
        self._urdf, srdf = robot_files(config)
        try:
            self.model: Any = pin.buildModelFromUrdf(os.fspath(self._urdf), pin.JointModelFreeFlyer())
        except ValueError as e:
            raise ConfigError("proximity.urdf", f"{self._urdf}: not a URDF robot model: {e}") from e
        self._names = list(self.model.names)[2:]
        for name in config.held_joints:
            self._check_joint(name, "proximity.held_joints")
        self._held = frozenset(config.held_joints)
        self.reference: Any = self._reference(config, srdf)
        geometry = self._geometry(config)
        meshes = sorted({Path(g.meshPath) for g in geometry.geometryObjects if Path(g.meshPath).is_file()})
        inputs = content_digest([self._urdf, *meshes], config.capsules)
        self.capsules: tuple[BodyCapsule, ...] = cached(
            cache_folder(config), inputs, lambda: body_capsules(self.model, geometry, config.capsules)
        )

    def stream(self, names: tuple[str, ...]) -> list[Any]:
        """Joint models in the order of a stream's names.

        Raises:
            ConfigError: a name is unknown or doubled, or a joint of the model is neither streamed nor held.
        """
        if len(set(names)) != len(names):
            twice = sorted({n for n in names if names.count(n) > 1})
            raise ConfigError("joints/state", f"joint named twice: {', '.join(twice)}")
        for name in names:
            self._check_joint(name, "joints/state")
        missing = sorted(set(self._names) - set(names) - self._held)
        if missing:
            hint = "; stream them, or name them in proximity.held_joints"
            raise ConfigError("joints/state", f"joints of the model are missing: {', '.join(missing)}", hint)
        joints = [self.joint(n) for n in names]
        for name, joint in zip(names, joints, strict=True):
            if joint.nv != 1 or joint.nq not in (1, 2):
                problem = f"joint {name!r} of type {joint.shortname()} cannot be streamed as a joint state"
                raise ConfigError("proximity.urdf", problem)
        return joints

    def joint(self, name: str) -> Any:
        """The joint model of this name, which the model has."""
        return self.model.joints[self.model.getJointId(name)]

    def _check_joint(self, name: str, place: str) -> None:
        if name not in self._names:
            raise ConfigError(place, f"{self._urdf.name} has no joint {name!r}", nearest(name, self._names))

    def _geometry(self, config: ProximityConfig) -> Any:
        folders = package_folders(config, self._urdf)
        try:
            return pin.buildGeomFromUrdf(
                self.model, os.fspath(self._urdf), pin.GeometryType.COLLISION, package_dirs=folders
            )
        except (ValueError, RuntimeError) as e:
            hint = "; is its package in proximity.package_dirs?"
            raise ConfigError("proximity.urdf", f"{self._urdf}: collision geometry: {e}", hint) from e

    def _reference(self, config: ProximityConfig, srdf: Path | None) -> Any:
        if srdf is None:
            if config.held_joints:
                problem = "they need a reference configuration"
                raise ConfigError("proximity.held_joints", problem, "; set proximity.srdf")
            return np.array(pin.neutral(self.model))
        try:
            pin.loadReferenceConfigurations(self.model, os.fspath(srdf), False)
        except (ValueError, RuntimeError) as e:
            raise ConfigError("proximity.srdf", f"{srdf}: not an SRDF file: {e}") from e
        known = [entry.key() for entry in self.model.referenceConfigurations]
        if config.reference not in known:
            problem = f"{srdf.name} has no reference configuration {config.reference!r}"
            raise ConfigError("proximity.reference", problem, nearest(config.reference, known))
        return np.array(self.model.referenceConfigurations[config.reference])
