"""Runs next to each other on a stage: sky, light, ground, a camera that follows, and a caption above each."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import msgspec
import mujoco
import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from foreshock.errors import BadInputError
from foreshock.twin import Caption, Take
from foreshock_twins.mujoco._gl import Painter
from foreshock_twins.mujoco._poses import Array, Recording

__all__ = ["WIDTH", "Frame", "Shown", "Stage", "dress"]

Frame = NDArray[np.uint8]

WIDTH, HEIGHT = 640, 480
"""Of one picture, in pixels."""
_RED, _AMBER, _GREEN, _INK, _PAPER = (214, 51, 38), (220, 140, 20), (50, 150, 80), (25, 28, 33), (255, 255, 255)
_BAR_H = 60
_DISTANCE_M, _AZIMUTH_DEG, _ELEVATION_DEG, _HEIGHT_M = 3.2, 125.0, -15.0, 0.8
"""The camera: from the robot; 0 looks along x, 90 along y; negative looks down; the point that it looks at."""


class Shown(msgspec.Struct, frozen=True):
    """A take with what its file holds."""

    take: Take
    poses: Recording

    def caption(self, time_s: float) -> Caption:
        """The last one that has begun."""
        return next((c for c in reversed(self.take.captions) if c.t_s <= time_s + 1e-9), Caption(0.0))


def dress(spec: Any) -> None:
    """Sky, light, shadow, and a tiled ground for the geom ``floor``: looks alone, before compile.

    Raises:
        KeyError: there is no geom ``floor``.
    """
    floor = spec.geom("floor")
    if floor is None:
        raise KeyError("there is no geom 'floor' to dress")
    visual = spec.visual
    visual.global_.offwidth, visual.global_.offheight = WIDTH, HEIGHT
    visual.quality.shadowsize, visual.quality.offsamples = 2048, 2
    visual.headlight.ambient, visual.headlight.diffuse = [0.35] * 3, [0.25] * 3
    visual.headlight.specular = [0.1] * 3
    visual.rgba.haze = [0.84, 0.88, 0.92, 1.0]
    # what lies ready out of sight, as a human who is not there, must not count for the size of the scene; a smaller
    # one has shadows with stripes
    spec.stat.extent, spec.stat.center = 8.0, [0.0, 0.0, 1.0]
    texture, plain, tiles = mujoco.mjtTexture, mujoco.mjtBuiltin.mjBUILTIN_GRADIENT, mujoco.mjtBuiltin.mjBUILTIN_CHECKER
    spec.add_texture(
        name="sky", type=texture.mjTEXTURE_SKYBOX, builtin=plain, width=256, height=1536,
        rgb1=[0.93, 0.95, 0.97], rgb2=[0.62, 0.70, 0.80],
    )  # fmt: skip
    spec.add_texture(
        name="tiles", type=texture.mjTEXTURE_2D, builtin=tiles, width=512, height=512,
        rgb1=[0.80, 0.82, 0.84], rgb2=[0.74, 0.76, 0.79], mark=mujoco.mjtMark.mjMARK_EDGE, markrgb=[0.66, 0.69, 0.72],
    )  # fmt: skip
    material = spec.add_material(name="tiles", texrepeat=[1.0, 1.0], texuniform=True)
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = "tiles"
    floor.material, floor.rgba = "tiles", [1.0, 1.0, 1.0, 1.0]
    directional = mujoco.mjtLightType.mjLIGHT_DIRECTIONAL
    spec.worldbody.add_light(
        name="sun", type=directional, pos=[0.0, 0.0, 6.0], dir=[0.35, 0.45, -1.0], castshadow=True,
        diffuse=[0.65] * 3, specular=[0.25] * 3, ambient=[0.05] * 3,
    )  # fmt: skip


class Stage:
    """Draws takes of one robot at a time, next to each other. To be closed."""

    def __init__(self, model: Any, takes: Sequence[Shown]) -> None:
        if not takes:
            raise BadInputError("pictures", "no run is given", "; expected at least one")
        for shown in takes:
            shape = (len(shown.poses.times_s), model.nq)
            if shown.poses.qpos.shape != shape or not shape[0]:
                problem = f"its poses have the shape {shown.poses.qpos.shape}"
                raise BadInputError(f"pictures: {shown.take.title}", problem, f"; expected {shape}, of the same robot")
        self._model, self._takes = model, takes
        self._data = mujoco.MjData(model)
        free = np.flatnonzero(model.jnt_type == mujoco.mjtJoint.mjJNT_FREE)
        base = int(model.jnt_qposadr[free[0]]) if len(free) else 0
        self._tracks = [_smoothed(t.poses.times_s, t.poses.qpos[:, base : base + 2]) for t in takes]
        self._painter = Painter(model, WIDTH, HEIGHT)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of a picture of all takes."""
        return len(self._takes) * WIDTH, _BAR_H + HEIGHT

    def times(self, fps: int) -> list[float]:
        """Times of a film of all of the longest take."""
        return [k / fps for k in range(int(max(t.poses.times_s[-1] for t in self._takes) * fps + 1e-9) + 1)]

    def picture(self, time_s: float) -> Frame:
        """All takes at a time, from left to right, each with its caption above."""
        return np.hstack([self._one(k, time_s) for k in range(len(self._takes))])

    def _one(self, k: int, time_s: float) -> Frame:
        shown, data = self._takes[k], self._data
        poses, row = shown.poses, shown.poses.at(time_s)
        data.qpos[:] = poses.qpos[row]
        data.mocap_pos[:], data.mocap_quat[:] = poses.mocap_pos[row], poses.mocap_quat[row]
        mujoco.mj_kinematics(self._model, data)
        mujoco.mj_camlight(self._model, data)
        x, y = self._tracks[k][row].tolist()
        scene = self._painter.frame(data, (x, y, _HEIGHT_M), _DISTANCE_M, _AZIMUTH_DEG, _ELEVATION_DEG)
        return np.vstack([_headline(shown, time_s), scene])

    def close(self) -> None:
        """Close the painter."""
        self._painter.close()


def _smoothed(times_s: Array, track: Array) -> Array:
    """The mean of a track over half a second before and after, so that the camera does not sway with the robot."""
    first = np.searchsorted(times_s, times_s - 0.5, side="left")
    after = np.searchsorted(times_s, times_s + 0.5, side="right")
    total = np.vstack([np.zeros((1, track.shape[1])), np.cumsum(track, axis=0)])
    mean: Array = (total[after] - total[first]) / (after - first)[:, None]
    return mean


def _headline(shown: Shown, time_s: float) -> Frame:
    """The strip above a picture: title, time, what is known, and trust as a bar."""
    caption = shown.caption(time_s)
    image = Image.new("RGB", (WIDTH, _BAR_H), _PAPER)
    draw = ImageDraw.Draw(image)
    large, small = ImageFont.load_default(20), ImageFont.load_default(16)
    right = WIDTH - 12
    draw.text((12, 6), shown.take.title, _INK, large)
    draw.text((right, 6), f"{time_s:.2f} s", _INK, large, anchor="ra")
    draw.text((right - 90, 6), caption.alarm, _RED, large, anchor="ra")
    if caption.trust is not None:
        colour = _GREEN if caption.trust >= 0.6 else _AMBER if caption.trust >= 0.3 else _RED
        draw.text((right, 32), f"trust {caption.trust:.2f}", colour, small, anchor="ra")
        draw.rectangle((0, _BAR_H - 4, min(max(caption.trust, 0.0), 1.0) * WIDTH, _BAR_H - 1), colour)
        right -= 96
    text = caption.text
    while draw.textlength(text, small) > right - 12:
        text = text.removesuffix("…")[:-1] + "…"
    draw.text((12, 32), text, _INK, small)
    return np.asarray(image)
