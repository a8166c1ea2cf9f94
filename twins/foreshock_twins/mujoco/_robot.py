"""Which humanoid, and what its parts are called: TALOS of example-robot-data unless another is named."""

from __future__ import annotations

import math
from pathlib import Path

import msgspec

from foreshock.errors import ConfigError, MissingExtraError, nearest

__all__ = ["RobotConfig", "robot_files", "share_folder"]

_TALOS = Path("example-robot-data/robots/talos_data")
_TALOS_ARMS = {
    "arms_out": {"arm_left_2_joint": 0.6, "arm_right_2_joint": -0.6},
    "arms_in": {
        "arm_left_1_joint": 0.215,
        "arm_left_2_joint": -0.123,
        "arm_left_3_joint": -0.511,
        "arm_right_1_joint": -0.215,
        "arm_right_2_joint": 0.123,
        "arm_right_3_joint": 0.511,
    },
    "arms_forward": {
        "arm_left_1_joint": -0.981,
        "arm_left_2_joint": 0.233,
        "arm_left_3_joint": 0.080,
        "arm_left_4_joint": -0.560,
        "arm_right_1_joint": 0.981,
        "arm_right_2_joint": -0.233,
        "arm_right_3_joint": -0.080,
        "arm_right_4_joint": -0.560,
    },
}
"""From half_sitting: hands out as far as the shoulders hold them; beside the thighs; 0.48 m ahead and 0.95 m high."""


class RobotConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A humanoid with two flat feet whose joints are hinges. The defaults are TALOS's.

    Attributes:
        model: URDF or MJCF file (by its suffix, ``.urdf`` or ``.xml``); ``""`` is TALOS.
        srdf: SRDF file with reference configurations; ``""`` is TALOS's, or none when model is set.
        reference: reference configuration of the SRDF; without one all joints start at posture, else 0.
        posture: joint positions (rad) that differ from the reference configuration.
        base: link that floats; ``""`` is the root of the model.
        torso: link that carries the inertial unit and takes pushes.
        left_foot: link or frame of the left foot, x forward and z up when the robot stands.
        right_foot: the same for the right.
        left_hand: link that a payload in the hands hangs from; ``""``: it has none.
        right_hand: the same for the right.
        sole_z_m: height of the sole's surface in the frame of the foot.
        sole_x_min_m: heel edge of the sole in that frame.
        sole_x_max_m: toe edge.
        sole_y_half_m: half width.
        arms_out: change of joint positions (rad) that stretches the arms out sideways; None is TALOS's, or none when
            model is set.
        arms_in: the same, which draws the arms back to the body.
        arms_forward: the same, which holds the hands out in front.
        package_dirs: folders that ``package://`` paths of meshes start from, beside that of example-robot-data.
    """

    model: str = ""
    srdf: str = ""
    reference: str = "half_sitting"
    posture: dict[str, float] = {}
    base: str = ""
    torso: str = "torso_2_link"
    left_foot: str = "left_sole_link"
    right_foot: str = "right_sole_link"
    left_hand: str = "gripper_left_base_link"
    right_hand: str = "gripper_right_base_link"
    sole_z_m: float = 0.0
    sole_x_min_m: float = -0.105
    sole_x_max_m: float = 0.10
    sole_y_half_m: float = 0.06
    arms_out: dict[str, float] | None = None
    arms_in: dict[str, float] | None = None
    arms_forward: dict[str, float] | None = None
    package_dirs: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for name in ("sole_z_m", "sole_x_min_m", "sole_x_max_m", "sole_y_half_m"):
            if not math.isfinite(getattr(self, name)):
                raise ConfigError(f"twin.robot.{name}", f"{getattr(self, name)!r} is not a finite number")
        if not self.sole_x_min_m < self.sole_x_max_m:
            problem = f"{self.sole_x_min_m!r} is not below sole_x_max_m = {self.sole_x_max_m!r}"
            raise ConfigError("twin.robot.sole_x_min_m", problem)
        if not self.sole_y_half_m > 0.0:
            raise ConfigError("twin.robot.sole_y_half_m", f"{self.sole_y_half_m!r} is not above 0")

    def arms(self, name: str) -> dict[str, float]:
        """One of the tables arms_out, arms_in and arms_forward, with its default."""
        given: dict[str, float] | None = getattr(self, name)
        if given is not None:
            return given
        return {} if self.model else _TALOS_ARMS[name]


def share_folder() -> Path:
    """The share folder of Pinocchio's own prefix, where the wheel of example-robot-data puts its files."""
    import pinocchio as pin

    prefix = next((p for p in Path(pin.__file__).parents if p.name == "cmeel.prefix"), None)
    return (prefix or Path(pin.__file__).parents[4]) / "share"


def robot_files(robot: RobotConfig) -> tuple[Path, Path | None]:
    """Model file and, if there is one, SRDF.

    Raises:
        ConfigError: a file does not exist, or is of no known kind.
        MissingExtraError: TALOS is meant, and example-robot-data is not installed.
    """
    if robot.model:
        model, srdf = Path(robot.model), Path(robot.srdf) if robot.srdf else None
        if model.suffix not in (".urdf", ".xml"):
            raise ConfigError("twin.robot.model", f"{model}: is neither .urdf nor .xml (MJCF)")
    else:
        talos = share_folder() / _TALOS
        model = talos / "robots/talos_reduced.urdf"
        srdf = Path(robot.srdf) if robot.srdf else talos / "srdf/talos.srdf"
        if not model.is_file():
            raise MissingExtraError("twin mujoco", f"{model}: no such file", "; run: pip install 'foreshock[mujoco]'")
    for place, path in (("twin.robot.model", model), ("twin.robot.srdf", srdf)):
        if path is not None and not path.is_file():
            beside = [p.name for p in path.parent.glob(f"*{path.suffix}")] if path.parent.is_dir() else []
            raise ConfigError(place, f"{path}: no such file", nearest(path.name, beside))
    return model, srdf
