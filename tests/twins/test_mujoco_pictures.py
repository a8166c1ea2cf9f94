"""Poses that a run keeps, and the films and stills drawn from them. Skipped where there is no OpenGL."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import av
import mujoco
import numpy as np
import pytest
from PIL import Image

from foreshock.errors import BadInputError, NoOpenGLError
from foreshock.twin import Caption, Recorder, Take
from foreshock_twins.mujoco import MujocoTwinConfig, build_twin, pictures
from foreshock_twins.mujoco import _pictures as writers
from foreshock_twins.mujoco._gl import Painter
from foreshock_twins.mujoco._poses import Poses, Recording, load
from foreshock_twins.mujoco._stage import HEIGHT, WIDTH, Shown, Stage, dress

SCENARIO = """
id = "p1"
title = "a walk"
mode = "A1"
expect = "none"
duration_s = 0.4
[twin]
kind = "mujoco"
[config.supervisor]
robot = "talos"
period_s = 0.01
[[config.detectors]]
use = "balance"
[parameters]
human = 2
human_y = 1.0
"""


@pytest.fixture(scope="module")
def opengl():
    try:
        Painter(mujoco.MjModel.from_xml_string("<mujoco/>"), 32, 32).close()
    except NoOpenGLError as e:
        pytest.skip(str(e))


def cube():
    """A red cube that can fly, over a floor."""
    spec = mujoco.MjSpec()
    spec.worldbody.add_geom(name="floor", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 0.1])
    body = spec.worldbody.add_body(name="cube", pos=[0, 0, 0.8])
    body.add_freejoint()
    body.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=[0.2, 0.2, 0.2], rgba=[1, 0, 0, 1])
    dress(spec)
    return spec.compile()


def flight(model, to_s, vx=0.0, jump=0.0):
    """Poses at 50 Hz of the cube, flying along x, and from half of the time on higher by jump."""
    times = np.arange(0.0, to_s + 1e-9, 0.02)
    qpos = np.tile(model.qpos0, (len(times), 1))
    qpos[:, 0] += vx * times
    qpos[times > 0.5 * to_s, 2] += jump
    return Recording(times, qpos, np.empty((len(times), 0, 3)), np.empty((len(times), 0, 4)))


def shown(poses, title="run", captions=()):
    return Shown(Take(title, Path(), captions), poses)


def red(picture):
    """Rows and columns of the cube's pixels."""
    p = picture[-HEIGHT:].astype(int)
    return np.nonzero((p[..., 0] > 90) & (p[..., 1] < 60) & (p[..., 2] < 60))


def test_a_film_has_the_size_and_the_frames_that_it_should(opengl, tmp_path):
    model = cube()
    takes = [shown(flight(model, 0.2)), shown(flight(model, 0.1))]
    stage = Stage(model, takes)
    writers._mp4(tmp_path / "f.mp4", stage, ())
    writers._gif(tmp_path / "f.gif", stage, ())
    stage.close()
    with av.open(str(tmp_path / "f.mp4")) as film:
        frames = list(film.decode(video=0))
        assert film.streams.video[0].average_rate == writers.MP4_FPS
    assert len(frames) == writers.MP4_FPS // 5 + 1
    assert (frames[0].width, frames[0].height) == stage.size == (2 * WIDTH, HEIGHT + 60)
    assert len(red(frames[0].to_ndarray(format="rgb24"))[0]) > 1000
    with Image.open(tmp_path / "f.gif") as gif:
        assert gif.size == (WIDTH, (HEIGHT + 60) // 2)
        # equal pictures that follow each other may be stored as one that stays longer
        shown_ms = 0
        for k in range(gif.n_frames):
            gif.seek(k)
            shown_ms += gif.info["duration"]
        assert shown_ms == 1000 // writers.GIF_FPS * (writers.GIF_FPS // 5 + 1)


def test_the_camera_follows_over_the_floor_and_shows_what_rises(opengl):
    model = cube()
    stage = Stage(model, [shown(flight(model, 4.0, vx=2.0, jump=0.4))])
    early, late, high = (red(stage.picture(t)) for t in (1.0, 1.8, 3.0))
    stage.close()
    assert abs(early[1].mean() - late[1].mean()) < 5, "it flew 1.6 m and stays in the middle"
    assert abs(late[1].mean() - WIDTH / 2) < 10
    assert high[0].mean() < late[0].mean() - 30


def test_captions_change_with_time(opengl):
    model = cube()
    captions = (Caption(0.0, "normal", 1.0), Caption(0.5, "protective", 0.1, "fall"))
    stage = Stage(model, [shown(flight(model, 1.0), "with supervisor", captions)])
    before, after = stage.picture(0.4)[:60].astype(int), stage.picture(0.6)[:60].astype(int)
    stage.close()
    green = (before[58, :, 1] > before[58, :, 0] + 30).sum()
    crimson = (after[58, :, 0] > after[58, :, 1] + 100).sum()
    assert green == pytest.approx(WIDTH, abs=2), "the bar is as long as trust is high"
    assert crimson == pytest.approx(0.1 * WIDTH, abs=2)


def test_poses_of_another_robot_and_no_runs_are_refused():
    model = cube()
    other = Recording(np.zeros(1), np.zeros((1, 3)), np.empty((1, 0, 3)), np.empty((1, 0, 4)))
    with pytest.raises(BadInputError, match=r"pictures: left: its poses have the shape \(1, 3\); expected \(1, 7\)"):
        Stage(model, [shown(other, "left")])
    with pytest.raises(BadInputError, match="no run"):
        Stage(model, [])


def test_poses_are_kept_at_their_rate_and_come_back_as_they_were(tmp_path):
    data, poses = mujoco.MjData(cube()), Poses(20.0)
    for k in range(101):
        data.qpos[0] = k
        poses.take(k * 5_000_000, data)
    poses.save(tmp_path / "p.npz")
    found = load(tmp_path / "p.npz")
    np.testing.assert_allclose(found.times_s, np.arange(11) * 0.05)
    np.testing.assert_array_equal(found.qpos[:, 0], np.arange(11) * 10)
    assert [found.at(t) for t in (-1.0, 0.0, 0.049, 0.05, 9.0)] == [0, 0, 0, 1, 10]
    poses.begin()
    with pytest.raises(BadInputError, match="no poses were kept"):
        poses.save(tmp_path / "none.npz")
    (tmp_path / "bad.npz").write_bytes(b"no zip")
    with pytest.raises(BadInputError, match=r"bad.npz: is not a file of poses"):
        load(tmp_path / "bad.npz")


def test_an_unknown_kind_of_file_is_refused_before_anything_is_drawn(tmp_path):
    with pytest.raises(BadInputError, match=r"f.mp3: '.mp3' is no kind of picture; did you mean '.mp4'"):
        pictures(MujocoTwinConfig(), [], [], [tmp_path / "f.mp3"])


def test_talos_and_the_human_are_in_the_picture_of_a_run(opengl, tmp_path):
    twin = build_twin(MujocoTwinConfig(), "talos", tmp_path)
    assert isinstance(twin, Recorder)
    still = {}
    for human in (0.0, 1.0):
        twin.record(50.0)
        twin.reset({"human": human, "human_x": 0.3, "human_y": 1.0, "human_yaw": -1.6}, 1)
        twin.advance(100_000_000)
        twin.save(tmp_path / "run.npz")
        file = tmp_path / f"{human}.png"
        pictures(MujocoTwinConfig(), [Take("a", tmp_path / "run.npz")], [0.1], [file])
        with Image.open(file) as image:
            assert image.size == (WIDTH // 2, (HEIGHT + 60) // 2)
            still[human] = np.asarray(image.convert("RGB")).astype(int)[30:]
    blue = {h: (p[..., 2] - p[..., 0] > 60).sum() for h, p in still.items()}
    assert blue[1.0] > blue[0.0] + 200, "his shirt is blue"
    dark = (still[0.0].max(axis=2) < 45).sum()
    assert dark > 1000, "TALOS's legs are black"
    twin.close()


def run_cli(tmp_path, backend):
    (tmp_path / "p1.toml").write_text(SCENARIO)
    command = [sys.executable, "-m", "foreshock", "pictures", "p1.toml", "--out", "o", "--film", "none", "--json"]
    env = {k: v for k, v in os.environ.items() if k != "MUJOCO_GL"} | ({"MUJOCO_GL": backend} if backend else {})
    done = subprocess.run(command, cwd=tmp_path, env=env, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)["result"]


@pytest.mark.slow
def test_the_command_draws_both_runs(opengl, tmp_path):
    result = run_cli(tmp_path, "")
    assert result["skipped"] == ""
    assert result["files"] == ["o/p1-0.png"]
    assert list(result["runs"]) == ["without supervisor", "with supervisor"]
    with Image.open(tmp_path / "o" / "p1-0.png") as image:
        assert image.size == (5 * WIDTH // 2, HEIGHT + 60)


def test_without_opengl_the_command_says_so_and_is_no_failure(tmp_path):
    result = run_cli(tmp_path, "glx")  # a name that mujoco accepts and has no module for
    assert result["files"] == []
    assert "no OpenGL is to be had here (glx: ModuleNotFoundError" in result["skipped"]
    assert result["runs"]["with supervisor"]["outcome"] == "none"
    assert not list(tmp_path.glob("o/*"))
