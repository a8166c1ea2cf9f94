"""A frame buffer that is not on any screen: EGL, else OSMesa, else what the platform has; MUJOCO_GL names one.

mujoco.Renderer chooses when mujoco is first imported and takes a window system then; a twin that runs long before
anybody wants pictures could not have them. Hence the context is made here, when it is needed.
"""

from __future__ import annotations

import importlib
import os
import sys
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from foreshock.errors import NoOpenGLError

__all__ = ["Painter"]

_OFFERED = {"linux": ("egl", "osmesa"), "darwin": ("cgl",)}.get(sys.platform, ("glfw",))
_OFF = ("disable", "disabled", "off", "false", "0")


def _context(width: int, height: int) -> Any:
    """A current OpenGL context.

    Raises:
        NoOpenGLError: no backend works here; it says what each of them said.
    """
    wanted = os.environ.get("MUJOCO_GL", "").strip().lower()
    if wanted in _OFF:
        raise NoOpenGLError(f"MUJOCO_GL={wanted}")
    said = []
    for name in (wanted,) if wanted else _OFFERED:
        try:
            context = importlib.import_module(f"mujoco.{name}").GLContext(width, height)
            context.make_current()
        except Exception as e:  # noqa: BLE001 # PyOpenGL and the drivers fail in any way, AttributeError among them
            said.append(f"{name}: {type(e).__name__}: {str(e).splitlines()[0] if str(e) else ''}".rstrip(": "))
        else:
            return context
    raise NoOpenGLError("; ".join(said))


class Painter:
    """Draws a model off screen. To be closed; use it in a with statement.

    Args:
        model: compiled; its offscreen buffer must be as large as a picture.
        width: of a picture, in pixels.
        height: the same.

    Raises:
        NoOpenGLError: there is no OpenGL here.
    """

    def __init__(self, model: Any, width: int, height: int) -> None:
        self._gl = _context(width, height)
        self._model, self._rect = model, mujoco.MjrRect(0, 0, width, height)
        self._scene = mujoco.MjvScene(model, maxgeom=2000)
        self._option, self._camera = mujoco.MjvOption(), mujoco.MjvCamera()
        # collision shapes are in group 3; they are seen where a robot has nothing else to show
        shown = bool(np.any((model.geom_type == mujoco.mjtGeom.mjGEOM_MESH) & (model.geom_group < 3)))
        self._option.geomgroup[3] = not shown
        self._context = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_150.value)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, self._context)
        self._pixels = np.empty((height, width, 3), np.uint8)

    def __enter__(self) -> Painter:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def frame(
        self, data: Any, target: tuple[float, float, float], distance_m: float, azimuth_deg: float, elevation_deg: float
    ) -> NDArray[np.uint8]:
        """The picture of a MjData whose kinematics are computed, from a camera that looks at a point."""
        camera = self._camera
        camera.lookat, camera.distance = target, distance_m
        camera.azimuth, camera.elevation = azimuth_deg, elevation_deg
        everything = mujoco.mjtCatBit.mjCAT_ALL.value
        mujoco.mjv_updateScene(self._model, data, self._option, None, camera, everything, self._scene)
        mujoco.mjr_render(self._rect, self._scene, self._context)
        mujoco.mjr_readPixels(self._pixels, None, self._rect, self._context)
        return self._pixels[::-1].copy()

    def close(self) -> None:
        """Free what the graphics driver holds; idempotent."""
        if self._gl is not None:
            self._gl.make_current()
            self._context.free()
            self._gl.free()
            self._gl = None
