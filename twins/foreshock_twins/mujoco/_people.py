"""The human in the twin: where he is at each step, what pushes between him and the robot, how perception sees him."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import msgspec
import numpy as np

from foreshock.clock import NS_PER_S
from foreshock.messages import Capsule, Gaze, HumanPose, Humans
from foreshock.twin import Channel
from foreshock_twins.mujoco._contact import HumanContacts, Touch, untouchable
from foreshock_twins.mujoco._human import PARTS, HumanMotion, HumanSettings, MovedHuman, add_human, apply
from foreshock_twins.mujoco._model import HUMAN_BIT

__all__ = ["ID", "PERIOD_NS", "People", "furnish"]

ID = "human-1"
PERIOD_NS = 40_000_000
"""A camera at 25 Hz."""

_POSE, _GAZE = "humans/pose", f"{ID}/gaze"
_MOTIONS = ("stand", "walk-past", "reach-in")


def furnish(spec: Any) -> None:
    """Put the human into a MjSpec; the robot's parts feel him through HumanContacts alone."""
    add_human(spec, HUMAN_BIT)
    for part in PARTS:
        for geom in spec.body(f"human-{part.name}").geoms:
            untouchable(geom)


class People:
    """Nobody, or one human. He looks at the robot, or ahead while he walks past.

    Attributes:
        channels: what perception tells of him.

    Args:
        model: compiled MuJoCo model with the human.
    """

    def __init__(self, model: Any) -> None:
        self.channels = (Channel(_POSE, "Humans", PERIOD_NS), Channel(_GAZE, "Gaze", PERIOD_NS))
        self._rows = [int(model.body_mocapid[model.body(f"human-{p.name}").id]) for p in PARTS]
        self._contacts = HumanContacts(model, [(f"human-{p.name}", p.region) for p in PARTS])

    def reset(self, parameters: Mapping[str, float], model: Any, data: Any, rng: np.random.Generator) -> None:
        """Begin a run.

        Raises:
            ConfigError: the motion is not one of those that there are, or cannot be done.
        """
        p = parameters
        self._p, self._model, self._data, self._rng = p, model, data, rng
        self._contacts.reset()
        self._motion: HumanMotion | None = None
        self._waiting: deque[tuple[int, Humans, Gaze]] = deque()
        kind = round(p["human"])
        if kind > 0:
            settings = HumanSettings(
                motion=_MOTIONS[kind - 1],  # type: ignore[arg-type]  # one of the literals
                x_m=p["human_x"],
                y_m=p["human_y"],
                yaw_rad=p["human_yaw"],
                start_s=p["human_start"],
                speed_m_s=p["human_speed"],
                reach_m=(p["reach_x"], p["reach_y"], p["reach_z"]),
                reach_s=p["reach_duration"],
            )
            self._motion = HumanMotion(settings)
            self._moves = kind > 1
            self._now = self._next = self._motion.pose(0)
            self._velocities = np.zeros((len(PARTS), 3))
            apply(model, data, self._now)

    def plan(self, until_ns: int) -> None:
        """The tick that begins now ends at until_ns."""
        if self._motion is None:
            return
        self._now = self._next
        if self._moves:
            self._next = self._motion.pose(until_ns)
            self._from, self._way = self._now.pos, self._next.pos - self._now.pos
            self._velocities = self._way * (NS_PER_S / 5_000_000)
            apply(self._model, self._data, self._now)
        if until_ns % PERIOD_NS == 0:
            pose = self._perceived(self._next)
            self._waiting.append((until_ns, Humans((pose,)), self._looks(pose)))

    def go(self, share: float) -> None:
        """Be where he is after a share of the tick."""
        if self._motion is not None and self._moves:
            self._data.mocap_pos[self._rows] = self._from + share * self._way

    def near(self, place: Any, within_m: float) -> bool:
        """Whether any part of him is so near to a place on the floor."""
        if self._motion is None:
            return False
        off = self._next.pos[:, :2] - place
        return bool((off * off).sum(axis=1).min() < within_m * within_m)

    def push(self, dt: float) -> Sequence[Touch]:
        """Contact forces at this step, see HumanContacts."""
        return self._contacts.apply(self._model, self._data, self._velocities, dt)

    def seen(self, now_ns: int) -> Iterator[tuple[int, str, Humans | Gaze]]:
        """What perception delivers now: stamp of the image, channel, message; an empty scene if nobody is there."""
        if self._motion is None:
            if now_ns % PERIOD_NS == 0:
                yield now_ns, _POSE, Humans(())
                yield now_ns, _GAZE, Gaze(ID, (1.0, 0.0, 0.0), 0.0)
            return
        latency = round(self._p["camera_latency"] * NS_PER_S)
        while self._waiting and self._waiting[0][0] + latency <= now_ns:
            stamp_ns, pose, gaze = self._waiting.popleft()
            yield stamp_ns, _POSE, pose
            yield stamp_ns, _GAZE, gaze

    def _looks(self, pose: HumanPose) -> Gaze:
        """From the middle of his head to the robot's base, or where he walks to."""
        head = pose.capsules[0]
        at = 0.5 * (np.array(head.a) + np.array(head.b))
        yaw = self._p["human_yaw"]
        ahead = np.array((np.cos(yaw), np.sin(yaw), 0.0))
        way = ahead if _MOTIONS[round(self._p["human"]) - 1] == "walk-past" else self._data.qpos[:3] - at
        way = way / np.linalg.norm(way) + self._p["gaze_noise"] * self._rng.standard_normal(3)
        way /= np.linalg.norm(way)
        return Gaze(ID, (float(way[0]), float(way[1]), float(way[2])))

    def _perceived(self, moved: MovedHuman) -> HumanPose:
        """One noisy offset for the whole body, as of a tracker, and a noisy velocity."""
        noise = self._p["human_noise"]
        offset = noise * self._rng.standard_normal(3)
        offset[2] = 0.0
        velocity = np.array(moved.velocity) + 2.0 * noise * self._rng.standard_normal(3)
        truth = moved.truth(ID, self._p["human_uncertainty"])
        x, y = float(offset[0]), float(offset[1])
        capsules = tuple(
            Capsule(c.region, (c.a[0] + x, c.a[1] + y, c.a[2]), (c.b[0] + x, c.b[1] + y, c.b[2]), c.radius)
            for c in truth.capsules
        )
        flat = (float(velocity[0]), float(velocity[1]), 0.0)
        return msgspec.structs.replace(truth, capsules=capsules, velocity=flat)
