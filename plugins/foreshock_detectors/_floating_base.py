"""A floating-base robot model: URDF and SRDF through Pinocchio, checked by name before anything is computed."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from foreshock.errors import ConfigError, nearest
from foreshock_detectors._robot_files import robot_files

__all__ = ["FloatingBase", "RobotSettings"]


class RobotSettings(Protocol):
    """The settings that say which robot; see the configurations of the detectors."""

    @property
    def urdf(self) -> str: ...  # named as in the configurations
    @property
    def srdf(self) -> str: ...
    @property
    def reference(self) -> str: ...
    @property
    def held_joints(self) -> tuple[str, ...]: ...


class FloatingBase:
    """What is fixed about a robot that no base is bolted to.

    Attributes:
        model: pinocchio.Model with a free flyer as its root.
        urdf: the file that it was read from.
        reference: configuration vector q of the reference posture, shape (nq,).

    Args:
        settings: which robot.
        detector: id of the detector, for errors.

    Raises:
        ConfigError: a file, joint or reference configuration does not exist or cannot be used.
    """

    def __init__(self, settings: RobotSettings, detector: str) -> None:
        self._detector = detector
        self.urdf, srdf = robot_files(settings.urdf, settings.srdf, detector)
        try:
            self.model: Any = pin.buildModelFromUrdf(os.fspath(self.urdf), pin.JointModelFreeFlyer())
        except ValueError as e:
            raise ConfigError(f"{detector}.urdf", f"{self.urdf}: not a URDF robot model: {e}") from e
        self._names = list(self.model.names)[2:]
        for name in settings.held_joints:
            self._check_joint(name, f"{detector}.held_joints")
        self._held = frozenset(settings.held_joints)
        self.reference: NDArray[np.float64] = self._reference(settings, srdf)

    def frame(self, name: str, place: str) -> int:
        """Id of a frame. getFrameId alone would answer nframes for an unknown name.

        Raises:
            ConfigError: there is none of this name; place says where it was configured.
        """
        if not self.model.existFrame(name):
            hint = nearest(name, (f.name for f in self.model.frames))
            raise ConfigError(place, f"{self.urdf.name} has no frame {name!r}", hint)
        return int(self.model.getFrameId(name))

    def joint(self, name: str) -> Any:
        """The joint model of this name, which the model has."""
        return self.model.joints[self.model.getJointId(name)]

    def streamed(self, names: tuple[str, ...]) -> list[Any]:
        """Joint models in the order of a stream's names; each has one velocity and one q, or two (cosine and sine).

        Raises:
            ConfigError: a name is unknown or doubled, a joint of the model is neither streamed nor held, or its type
                cannot be streamed.
        """
        if len(set(names)) != len(names):
            twice = sorted({n for n in names if names.count(n) > 1})
            raise ConfigError("joints/state", f"joint named twice: {', '.join(twice)}")
        for name in names:
            self._check_joint(name, "joints/state")
        missing = sorted(set(self._names) - set(names) - self._held)
        if missing:
            hint = f"; stream them, or name them in {self._detector}.held_joints"
            raise ConfigError("joints/state", f"joints of the model are missing: {', '.join(missing)}", hint)
        joints = [self.joint(n) for n in names]
        for name, joint in zip(names, joints, strict=True):
            if joint.nv != 1 or joint.nq not in (1, 2):
                problem = f"joint {name!r} of type {joint.shortname()} cannot be streamed as a joint state"
                raise ConfigError(f"{self._detector}.urdf", problem)
        return joints

    def _check_joint(self, name: str, place: str) -> None:
        if name not in self._names:
            raise ConfigError(place, f"{self.urdf.name} has no joint {name!r}", nearest(name, self._names))

    def _reference(self, settings: RobotSettings, srdf: Path | None) -> NDArray[np.float64]:
        if srdf is None:
            if settings.held_joints:
                hint = f"; set {self._detector}.srdf"
                raise ConfigError(f"{self._detector}.held_joints", "they need a reference configuration", hint)
            return np.array(pin.neutral(self.model))
        try:
            pin.loadReferenceConfigurations(self.model, os.fspath(srdf), False)
        except (ValueError, RuntimeError) as e:
            raise ConfigError(f"{self._detector}.srdf", f"{srdf}: not an SRDF file: {e}") from e
        known = [entry.key() for entry in self.model.referenceConfigurations]
        if settings.reference not in known:
            problem = f"{srdf.name} has no reference configuration {settings.reference!r}"
            raise ConfigError(f"{self._detector}.reference", problem, nearest(settings.reference, known))
        return np.array(self.model.referenceConfigurations[settings.reference])
