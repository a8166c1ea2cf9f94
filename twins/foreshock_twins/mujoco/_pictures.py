"""Film and stills of runs side by side, from the poses that their twins saved: nothing is simulated again.

av (FFmpeg's libraries) writes MP4 as H.264, Pillow GIF and PNG.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import closing
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np
from PIL import Image

from foreshock.errors import BadInputError, nearest
from foreshock.twin import Take
from foreshock_twins.mujoco._model import Body
from foreshock_twins.mujoco._people import furnish
from foreshock_twins.mujoco._poses import load
from foreshock_twins.mujoco._robot import RobotConfig
from foreshock_twins.mujoco._stage import WIDTH, Shown, Stage, dress

__all__ = ["GIF_FPS", "MP4_FPS", "draw"]

MP4_FPS, GIF_FPS = 20, 10
"""Pictures a second; a GIF is for pages that cannot play films, and small."""


def draw(robot: RobotConfig, takes: Sequence[Take], times_s: Sequence[float], files: Sequence[Path]) -> None:
    """Write the files, each by its suffix.

    Args:
        robot: that all takes are of.
        takes: from left to right; one that ends early stands still from then on.
        times_s: of the stills.
        files: ``.mp4`` and ``.gif`` are films in real time from 0 on; ``.png`` has a row for each take and a column
            for each time.

    Raises:
        BadInputError: another suffix, no times for stills, or poses of another robot.
        NoOpenGLError: there is no OpenGL here.
    """
    for path in files:
        if path.suffix not in _WRITERS:
            raise BadInputError(str(path), f"{path.suffix!r} is no kind of picture", nearest(path.suffix, _WRITERS))
    shown = [Shown(take, load(take.recording)) for take in takes]
    with closing(Stage(_dressed(robot), shown)) as stage:
        for path in files:
            path.parent.mkdir(parents=True, exist_ok=True)
            _WRITERS[path.suffix](path, stage, times_s)


def _dressed(robot: RobotConfig) -> Any:
    """The twin's model with all that is for show."""

    def all_of_it(spec: Any) -> None:
        furnish(spec)
        dress(spec)

    return Body(robot, all_of_it, visual=True).model


def _mp4(path: Path, stage: Stage, _: Sequence[float]) -> None:
    with av.open(str(path), "w", options={"movflags": "faststart"}) as container:
        stream = container.add_stream("libx264", rate=Fraction(MP4_FPS), options={"crf": "24", "preset": "fast"})
        stream.width, stream.height = stage.size
        stream.pix_fmt = "yuv420p"
        for t in stage.times(MP4_FPS):
            picture = np.ascontiguousarray(stage.picture(t))
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")))
        container.mux(stream.encode())


def _gif(path: Path, stage: Stage, _: Sequence[float]) -> None:
    """At half the size."""
    images = [Image.fromarray(stage.picture(t)).reduce(2).quantize(64) for t in stage.times(GIF_FPS)]
    images[0].save(path, save_all=True, append_images=images[1:], duration=1000 // GIF_FPS, loop=0)


def _png(path: Path, stage: Stage, times_s: Sequence[float]) -> None:
    if not times_s:
        raise BadInputError(str(path), "no times are given", "; expected at least one")
    columns = [stage.picture(t) for t in times_s]
    rows = [np.hstack([c[:, x : x + WIDTH] for c in columns]) for x in range(0, stage.size[0], WIDTH)]
    Image.fromarray(np.vstack(rows)).reduce(2).save(path, optimize=True)


_WRITERS = {".mp4": _mp4, ".gif": _gif, ".png": _png}
