"""A whole-body humanoid in MuJoCo as a twin: ``[twin] kind = "mujoco"``; TALOS by default.

MuJoCo and Pinocchio are imported on use. Physics at 1 kHz, control, sensors and referee at 200 Hz; real contacts of the
soles, of the body with the floor, and of the body with a human of capsules.

Channels, below the robot's name, with their periods: ``joints/state`` (position, velocity, effort), ``base/odometry``,
``imu/torso``, ``left_sole/wrench``, ``right_sole/wrench`` and ``plan/motion`` 5 ms; ``joints/plan`` and
``left_arm/odometry`` (the hand), ``left_gripper/imu``, ``left_gripper/object``, ``left_gripper/object_command`` (what
it holds, seen and planned) and those of the right 10 ms; ``left_foot/odometry``, ``left_foot/plan`` and those of
the right 20 ms; ``humans/pose`` and ``human-1/gaze`` 40 ms; ``plan/path`` 100 ms. A measurement is stamped when it was
taken, and arrives ``latency`` later.

Parameters: see ``foreshock_twins.mujoco._parameters.PARAMETERS``; names that the FMU plants share mean the same.
Disturbances, each with a time: ice under a sole (``drop_*``), an unseen block (``block_*``), push (``push_*``), payload
(``payload_*``), feedback lost (``blind_*``), added latency (``lag*``), a joint that loses torque (``weak_*``). A human
stands, walks past or reaches in (``human*``, ``reach_*``).

Actions, each with a strength 0..1, ramped up and down:

- ``step-suppression``: swing foot down within 0.15 s, then the capture point over the middle of both feet; released,
  the walk goes on 1 s after the robot has come to rest;
- ``arm-reconfiguration`` arms out; ``withdraw-arm`` arms in; ``soften-arms`` their stiffness down to a tenth;
- ``compliance-tuning``: legs half as stiff again, and damped more;
- ``balance-lock``: capture point feedback three times as strong, and there when the walk's own feedback is lost;
- ``speed-scale``, ``shorten-step``: shorter, and lower, steps from the next one on;
- ``protective-stop``: the motion is stopped in 0.1 s wherever it is, and balance feedback with it; ``hold``: the same,
  with feedback: either may topple a robot on one leg;
- ``minimal-risk``: step-suppression and balance-lock;
- ``impact-mitigation``: knees yield once it falls; ``announce``: nothing that the physics sees.

Events: ``balance-lost``, ``fall`` (largest floor force on anything but the soles), ``touch``, and the accidents of the
FMU plants under their ids: ``fall-onto-human`` A1, ``arm-strike`` A2, ``leg-swing-contact`` and ``leg-held`` A3.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import msgspec

from foreshock.errors import MissingExtraError
from foreshock.hookspecs import hookimpl
from foreshock.twin import Take, Twin, TwinSpec
from foreshock_twins.mujoco._robot import RobotConfig, robot_files

__all__ = [
    "MujocoTwinConfig",
    "RobotConfig",
    "build_twin",
    "foreshock_scenarios",
    "foreshock_twins",
    "pictures",
    "twin_files",
]


class MujocoTwinConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Which robot.

    Attributes:
        robot: the humanoid; TALOS if not given.
    """

    robot: RobotConfig = RobotConfig()


def build_twin(config: MujocoTwinConfig, robot: str, scratch: Path) -> Twin:  # noqa: ARG001  # nothing is temporary
    """The twin of a robot of this name.

    Raises:
        ConfigError: the robot's files or the names in them are wrong.
        MissingExtraError: MuJoCo, Pinocchio or TALOS is not installed.
    """
    try:
        import mujoco  # noqa: F401  # said before anything is built
        import pinocchio  # noqa: F401
    except ImportError as error:
        problem = f"needs mujoco and pinocchio, one of which cannot be imported: {error}"
        raise MissingExtraError("twin mujoco", problem, "; run: pip install 'foreshock[mujoco]'") from error
    from foreshock_twins.mujoco._model import Body
    from foreshock_twins.mujoco._people import People, furnish
    from foreshock_twins.mujoco._twin import MujocoTwin

    body = Body(config.robot, furnish)
    return MujocoTwin(robot, body, People(body.model))


def twin_files(config: MujocoTwinConfig) -> Mapping[str, Path]:
    """The robot's model file and its SRDF."""
    model, srdf = robot_files(config.robot)
    return {"model": model} if srdf is None else {"model": model, "srdf": srdf}


def pictures(config: MujocoTwinConfig, takes: Sequence[Take], times_s: Sequence[float], files: Sequence[Path]) -> None:
    """Draw runs side by side: films (``.mp4``, ``.gif``) and stills (``.png``).

    Raises:
        ConfigError: the robot's files or the names in them are wrong.
        MissingExtraError: MuJoCo, av or Pillow is not installed.
        NoOpenGLError: nothing can be drawn on this machine.
    """
    try:
        import av  # noqa: F401  # said before anything is drawn
        import mujoco  # noqa: F401
        import PIL  # noqa: F401
    except ImportError as error:
        problem = f"needs {error.name}, which cannot be imported: {error}"
        raise MissingExtraError("pictures", problem, "; run: pip install 'foreshock[mujoco]'") from error
    from foreshock_twins.mujoco._pictures import draw

    draw(config.robot, takes, times_s, files)


@hookimpl
def foreshock_twins() -> Sequence[TwinSpec]:
    """The twin kind ``mujoco``."""
    summary = "A whole-body humanoid in MuJoCo, TALOS by default"
    return [TwinSpec("mujoco", build_twin, MujocoTwinConfig, summary, twin_files, pictures)]


@hookimpl
def foreshock_scenarios() -> Sequence[Path]:
    """The scenarios of this twin: those of the FMU plants under their ids with ``@mujoco``, and falls by cause."""
    return sorted((Path(__file__).parent / "scenarios").glob("*.toml"))
