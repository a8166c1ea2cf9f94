"""The robot model: URDF and SRDF through Pinocchio, checked by name before anything is computed."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from foreshock.errors import ConfigError, nearest
from foreshock_detectors.balance._config import BalanceConfig

__all__ = ["RobotModel", "talos_files"]

_TALOS = Path("example-robot-data/robots/talos_data")


def talos_files() -> tuple[Path, Path]:
    """URDF and SRDF of TALOS (the reduced model) from example-robot-data.

    The wheel has no Python module; its files lie in the share folder of the same cmeel.prefix as Pinocchio.
    """
    prefix = next((p for p in Path(pin.__file__).parents if p.name == "cmeel.prefix"), None)
    share = (prefix or Path(pin.__file__).parents[4]) / "share"
    return share / _TALOS / "robots/talos_reduced.urdf", share / _TALOS / "srdf/talos.srdf"


class RobotModel:
    """A floating-base Pinocchio model with the frames that the detector needs.

    Attributes:
        model: pinocchio.Model with a free flyer as its root.
        reference: configuration vector q of the reference posture, shape (nq,).
        mass_kg: total mass.
        left: frame id of the left sole.
        right: frame id of the right sole.
        torso: frame id of the torso.

    Raises:
        ConfigError: a file, frame, joint or reference configuration does not exist or cannot be used.
    """

    def __init__(self, config: BalanceConfig) -> None:
        urdf, srdf = _files(config)
        self._urdf = urdf
        try:
            self.model: Any = pin.buildModelFromUrdf(os.fspath(urdf), pin.JointModelFreeFlyer())
        except ValueError as e:
            raise ConfigError("balance.urdf", f"{urdf}: not a URDF robot model: {e}") from e
        self.reference = self._reference(config, srdf)
        self.mass_kg = float(pin.computeTotalMass(self.model))
        if not self.mass_kg > 0.0:
            raise ConfigError("balance.urdf", f"{urdf}: the robot has no mass")
        self.left = self.frame(config.left_sole_frame, "balance.left_sole_frame")
        self.right = self.frame(config.right_sole_frame, "balance.right_sole_frame")
        self.torso = self.frame(config.torso_frame, "balance.torso_frame")
        if config.imu_frame:
            self.frame(config.imu_frame, "balance.imu_frame")
        self._names = list(self.model.names)[2:]
        for name in config.held_joints:
            self._check_joint(name, "balance.held_joints")
        self._held = frozenset(config.held_joints)

    def frame(self, name: str, place: str) -> int:
        """Id of a frame. getFrameId alone would answer nframes for an unknown name."""
        if not self.model.existFrame(name):
            hint = nearest(name, (f.name for f in self.model.frames))
            raise ConfigError(place, f"{self._urdf.name} has no frame {name!r}", hint)
        return int(self.model.getFrameId(name))

    def joint_indices(self, names: tuple[str, ...]) -> JointIndices:
        """Where the joints of a stream stand in q and v.

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
            hint = "; stream them, or name them in balance.held_joints"
            raise ConfigError("joints/state", f"joints of the model are missing: {', '.join(missing)}", hint)
        return JointIndices([self.model.joints[self.model.getJointId(n)] for n in names])

    def _check_joint(self, name: str, place: str) -> None:
        if name not in self._names:
            raise ConfigError(place, f"{self._urdf.name} has no joint {name!r}", nearest(name, self._names))

    def _reference(self, config: BalanceConfig, srdf: Path | None) -> Any:
        if srdf is None:
            if config.held_joints:
                raise ConfigError("balance.held_joints", "they need a reference configuration", "; set balance.srdf")
            return pin.neutral(self.model)
        try:
            pin.loadReferenceConfigurations(self.model, os.fspath(srdf), False)
        except (ValueError, RuntimeError) as e:
            raise ConfigError("balance.srdf", f"{srdf}: not an SRDF file: {e}") from e
        known = [entry.key() for entry in self.model.referenceConfigurations]
        if config.reference not in known:
            problem = f"{srdf.name} has no reference configuration {config.reference!r}"
            raise ConfigError("balance.reference", problem, nearest(config.reference, known))
        return self.model.referenceConfigurations[config.reference].copy()


class JointIndices:
    """Writes streamed joint positions and velocities into q and v.

    A revolute or prismatic joint has one q; an unlimited (``continuous``) one has cosine and sine.
    """

    def __init__(self, joints: list[Any]) -> None:
        for j in joints:
            if j.nv != 1 or j.nq not in (1, 2):
                raise ConfigError("balance.urdf", f"joint type {j.shortname()} cannot be streamed as a joint state")
        plain = [k for k, j in enumerate(joints) if j.nq == 1]
        self._round = [(k, int(j.idx_q)) for k, j in enumerate(joints) if j.nq == 2]
        self._q = np.array([joints[k].idx_q for k in plain], dtype=np.intp)
        self._v = np.array([j.idx_v for j in joints], dtype=np.intp)
        self._plain = np.array(plain, dtype=np.intp) if self._round else None

    def write(self, q: Any, v: Any, position: tuple[float, ...], velocity: tuple[float, ...]) -> None:
        """Fill q (nq,) and v (nv,) in place from positions (rad or m) and velocities (rad/s or m/s)."""
        v[self._v] = velocity
        if self._plain is None:
            q[self._q] = position
            return
        angles = np.array(position)
        q[self._q] = angles[self._plain]
        for k, i in self._round:
            q[i], q[i + 1] = np.cos(angles[k]), np.sin(angles[k])


def _files(config: BalanceConfig) -> tuple[Path, Path | None]:
    if config.urdf:
        urdf, srdf = Path(config.urdf), Path(config.srdf) if config.srdf else None
    else:
        urdf, talos_srdf = talos_files()
        srdf = Path(config.srdf) if config.srdf else talos_srdf
    for place, path in (("balance.urdf", urdf), ("balance.srdf", srdf)):
        if path is not None and not path.is_file():
            hint = "" if config.urdf else "; is example-robot-data installed? pip install 'foreshock[balance]'"
            beside = [p.name for p in path.parent.glob(f"*{path.suffix}")] if path.parent.is_dir() else []
            raise ConfigError(place, f"{path}: no such file", nearest(path.name, beside) or hint)
    return urdf, srdf
