"""foreshock detectors list, check and new, as programs see them."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from tests.rogues.plugins.entry_points import GALLERY, install

ROOT = Path(__file__).parents[2]


class Program:
    """The command line in a folder of its own, with the rogue gallery installed."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        gallery = install(folder / "gallery")
        path = os.pathsep.join(filter(None, (str(gallery), str(ROOT), os.environ.get("PYTHONPATH"))))
        self._env = {**os.environ, "PYTHONPATH": path, "COLUMNS": "100"}

    def run(self, *words: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, "-c", "from foreshock.cli import main; main()", "detectors", *words],
            cwd=self.folder,
            env=self._env,
            capture_output=True,
            text=True,
            check=False,
            timeout=120,
        )

    def json(self, *words: str, code: int = 0) -> dict[str, Any]:
        done = self.run(*words, "--json")
        assert done.returncode == code, done.stdout + done.stderr
        answer: dict[str, Any] = json.loads(done.stdout)
        assert set(answer) == {"schema", "ok", "result", "errors"}
        return answer


@pytest.fixture
def program(tmp_path: Path) -> Program:
    return Program(tmp_path)


def test_list_says_what_each_detector_is(program: Program) -> None:
    result = program.json("list")["result"]
    found = {d["id"]: d for d in result["detectors"]}
    assert {"balance", "grip", "telemetry", "knee-torque", "needs-extra"} <= found.keys()
    knee = found["knee-torque"]
    assert knee["kinds"] == ["torque-saturation"]
    assert knee["inputs"] == [
        {"name": "torque", "channel": "knee/torque", "type": "Scalar", "required": True},
        {"name": "speed", "channel": "knee/speed", "type": "Scalar", "required": False},
    ]
    assert (knee["isolation"], knee["plugin"]) == ("in-process", "knee-torque")
    assert knee["distribution"] == "rogue-gallery 1.2"
    assert knee["extra"]["installed"] is True
    assert found["needs-extra"]["extra"] == {
        "name": "thermal-camera-driver",
        "installed": False,
        "missing": ["thermal-camera-driver"],
        "command": "pip install 'thermal-camera-driver'",
    }


def test_list_shows_every_broken_plugin_with_its_reason(program: Program) -> None:
    broken = {b["name"]: b["reason"] for b in program.json("list")["result"]["broken"]}
    fine = {"knee-torque", "needs-extra"}
    assert set(GALLERY) - fine <= set(broken)
    assert not fine & set(broken)
    assert "did you mean 'foreshock_detectors'" in broken["misspelt-hook"]
    assert "needs a licence" in broken["exits"]
    assert "lacks @hookimpl" in broken["unmarked"]
    assert "id 'knee-torque' is that of another plugin" in broken["other-id"]
    printed = program.run("list").stdout
    assert "did you mean 'foreshock_detectors'" in printed
    assert "thermal-camera-driver" in printed


def test_check_of_a_good_detector(program: Program) -> None:
    checks = program.json("check", "knee-torque")["result"]["checks"]
    assert [c for c in checks if not c["ok"]] == []
    lines = program.run("check", "knee-torque").stdout.splitlines()
    assert len(lines) == len(checks)
    assert all(line.startswith("ok ") for line in lines)


def test_check_names_everything_that_is_wrong(program: Program) -> None:
    checks = program.json("check", "bad-kind", code=1)["result"]["checks"]
    wrong = {c["name"]: c["problem"] for c in checks if not c["ok"]}
    assert "did you mean 'torque-saturation'" in wrong["kinds are known to the taxonomy"]
    assert "lacks frozen=True and forbid_unknown_fields=True" in " ".join(wrong.values())
    assert "deadline_s is 0.0" in wrong["times are sensible"]
    assert "summary is empty" in wrong["has a summary of one line"]
    done = program.run("check", "bad-kind")
    assert done.returncode == 1
    assert sum(line.startswith("failed ") for line in done.stdout.splitlines()) == len(wrong)


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("needs-extra", "run: pip install 'thermal-camera-driver'"),
        ("misspelt-hook", "did you mean 'foreshock_detectors'"),
        ("raises", "ZeroDivisionError"),
        ("unmarked", "lacks @hookimpl"),
        ("other-id", "offers no detector 'other-id'"),
    ],
)
def test_check_of_a_plugin_that_cannot_run_is_negative(program: Program, name: str, says: str) -> None:
    checks = program.json("check", name, code=1)["result"]["checks"]
    assert says in " ".join(c["problem"] for c in checks)


def test_check_of_an_unknown_name_is_bad_input(program: Program) -> None:
    answer = program.json("check", "knee-torqe", code=2)
    assert "did you mean 'knee-torque'" in answer["errors"][0]["message"]


def test_new_writes_a_project_once(program: Program) -> None:
    made = program.json("new", "wobbly-hip")["result"]
    assert made["folder"] == "foreshock-wobbly-hip"
    files = {str(f.relative_to(program.folder)) for f in (program.folder / made["folder"]).rglob("*") if f.is_file()}
    assert files == set(made["files"])
    before = {f: (program.folder / f).read_text() for f in files}
    again = program.json("new", "wobbly-hip", code=2)
    assert "exists already" in again["errors"][0]["message"]
    assert {f: (program.folder / f).read_text() for f in files} == before


@pytest.mark.parametrize("kind", [(), ("--kind", "micro-slip")])
def test_tests_of_a_new_project_pass_as_written(program: Program, kind: tuple[str, ...]) -> None:
    program.json("new", "wobbly-hip", *kind, "--dir", "here/plugin")
    folder = program.folder / "here" / "plugin"
    env = {k: v for k, v in os.environ.items() if k != "PYTEST_ADDOPTS"}
    words = [sys.executable, "-m", "pytest", "-q"]
    done = subprocess.run(words, cwd=folder, env=env, capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 0, done.stdout + done.stderr
    text = (folder / "src" / "foreshock_wobbly_hip" / "__init__.py").read_text()
    assert ('kinds=("foot-micro-slip",)' in text) == bool(kind)  # an alias is written as the kind that it means
    assert ("foreshock_precursors" in text) != bool(kind)


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("Wobbly_Hip",), "not lower-case words joined by hyphens"),
        (("grip",), "'grip' is taken"),
        (("knee-torque",), "'knee-torque' is taken"),
        (("foreshock-hip",), "begins with foreshock"),
        (("twins",), "foreshock_twins exists already"),
        (("torque-saturation",), "--kind torque-saturation"),
        (("wobbly-hip", "--kind", "torque-saturatio"), "did you mean 'torque-saturation'"),
        (("wobbly-hip", "--dir", "gallery"), "not an empty folder"),
    ],
)
def test_new_refuses_what_cannot_work(program: Program, words: tuple[str, ...], says: str) -> None:
    before = sorted(program.folder.rglob("*"))
    answer = program.json("new", *words, code=2)
    assert says in answer["errors"][0]["message"]
    assert sorted(program.folder.rglob("*")) == before
