"""Plugins in distributions of their own, installed as anybody installs them: the example and a generated project."""

from __future__ import annotations

import importlib.util
import json
import os
import shutil
import site
import subprocess
import sys
import venv
from pathlib import Path

import pytest

EXAMPLE = Path(__file__).parents[2] / "docs" / "examples" / "foreshock-hot-motor"
FORESHOCK = ("-c", "from foreshock.cli import main; main()")


def started(words: list[str], **how: object) -> subprocess.CompletedProcess[str]:
    """Run a program to its end, without this checkout on its path."""
    env = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "PYTEST_ADDOPTS")}
    return subprocess.run(words, capture_output=True, text=True, check=False, timeout=300, env=env, **how)  # type: ignore[call-overload,no-any-return]


@pytest.fixture(scope="module")
def plugins(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path, Path]:
    """A fresh environment with both plugins installed; its interpreter, and the two projects."""
    home = tmp_path_factory.mktemp("plugins")
    example = home / EXAMPLE.name
    shutil.copytree(EXAMPLE, example, ignore=shutil.ignore_patterns("__pycache__", ".pytest_cache"))
    made = started([sys.executable, *FORESHOCK, "detectors", "new", "wobbly-knee"], cwd=home)
    assert made.returncode == 0, made.stderr
    generated = home / "foreshock-wobbly-knee"

    venv.EnvBuilder(symlinks=True).create(home / "venv")
    python = home / "venv" / "bin" / "python"
    (packages,) = (home / "venv" / "lib").glob("python*/site-packages")
    # what is installed here is visible there, with its own .pth files, as if it had been installed there as well
    here = [p for p in (*site.getsitepackages(), *sys.path) if p.endswith("site-packages")]
    (packages / "outer.pth").write_text("".join(f"import site; site.addsitedir({p!r})\n" for p in dict.fromkeys(here)))
    pip = [sys.executable, "-m", "pip", "--python", str(python), "install", "--quiet", "--no-deps"]
    if importlib.util.find_spec("hatchling"):  # else pip fetches it to build with
        pip += ["--no-index", "--no-build-isolation"]
    done = started([*pip, str(example), str(generated)])
    assert done.returncode == 0, done.stdout + done.stderr
    return python, example, generated


def test_list_shows_both(plugins: tuple[Path, Path, Path]) -> None:
    done = started([str(plugins[0]), *FORESHOCK, "detectors", "list", "--json"])
    assert done.returncode == 0, done.stderr
    answer = json.loads(done.stdout)
    found = {d["id"]: d for d in answer["result"]["detectors"]}
    assert answer["ok"]
    assert {"hot-motor", "wobbly-knee"} <= found.keys()
    assert found["hot-motor"]["distribution"] == "foreshock-hot-motor 0.1.0"
    assert found["hot-motor"]["kinds"] == ["motor-overload"]
    assert found["hot-motor"]["inputs"] == [
        {"name": "joints", "channel": "joints/state", "type": "JointState", "required": True}
    ]
    assert found["wobbly-knee"]["distribution"] == "foreshock-wobbly-knee 0.1.0"
    broken = {b["name"] for b in answer["result"]["broken"]}
    assert not broken & {"hot-motor", "wobbly-knee"}


@pytest.mark.parametrize("name", ["hot-motor", "wobbly-knee"])
def test_check_passes(plugins: tuple[Path, Path, Path], name: str) -> None:
    done = started([str(plugins[0]), *FORESHOCK, "detectors", "check", name, "--json"])
    assert done.returncode == 0, done.stdout + done.stderr
    assert all(c["ok"] for c in json.loads(done.stdout)["result"]["checks"])


@pytest.mark.parametrize("which", [1, 2], ids=["example", "generated"])
def test_own_tests_pass_where_it_is_installed(plugins: tuple[Path, Path, Path], which: int) -> None:
    done = started([str(plugins[0]), "-m", "pytest", "-q", "-o", "pythonpath="], cwd=plugins[which])
    assert done.returncode == 0, done.stdout + done.stderr
    # 15 of the inherited class with one required input, at least
    assert int(done.stdout.split(" passed")[0].rsplit(maxsplit=1)[-1]) >= 15


def test_a_configuration_runs_it(plugins: tuple[Path, Path, Path], tmp_path: Path) -> None:
    """The configuration in the example's README is accepted, with the plugin found by its entry point."""
    text = (plugins[1] / "README.md").read_text().split("```toml\n")[1].split("```")[0]
    (tmp_path / "config.toml").write_text(text)
    done = started([str(plugins[0]), *FORESHOCK, "config", "check", str(tmp_path / "config.toml"), "--json"])
    assert done.returncode == 0, done.stdout + done.stderr
    assert json.loads(done.stdout)["result"]["detectors"] == ["hot-motor"]
