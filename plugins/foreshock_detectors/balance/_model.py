"""The robot model: a floating base with the frames that the detector needs."""

from __future__ import annotations

import pinocchio as pin

from foreshock.errors import ConfigError
from foreshock_detectors._floating_base import FloatingBase
from foreshock_detectors._robot_files import talos_files
from foreshock_detectors.balance._config import BalanceConfig

__all__ = ["RobotModel", "talos_files"]


class RobotModel(FloatingBase):
    """A floating base with a mass, two soles and a torso.

    Attributes:
        mass_kg: total mass.
        left: frame id of the left sole.
        right: frame id of the right sole.
        torso: frame id of the torso.

    Raises:
        ConfigError: a file, frame, joint or reference configuration does not exist or cannot be used.
    """

    def __init__(self, config: BalanceConfig) -> None:
        super().__init__(config, "balance")
        self.mass_kg = float(pin.computeTotalMass(self.model))
        if not self.mass_kg > 0.0:
            raise ConfigError("balance.urdf", f"{self.urdf}: the robot has no mass")
        self.left = self.frame(config.left_sole_frame, "balance.left_sole_frame")
        self.right = self.frame(config.right_sole_frame, "balance.right_sole_frame")
        self.torso = self.frame(config.torso_frame, "balance.torso_frame")
        if config.imu_frame:
            self.frame(config.imu_frame, "balance.imu_frame")
