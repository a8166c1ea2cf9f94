"""The command line as a program: what it prints, and how it ends."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from tests.rogues.plugins.entry_points import install

from foreshock.cli.output import table

GOOD = """
[[detectors]]
use = "telemetry"
"""


def foreshock(*words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", "from foreshock.cli import main; main()", *words],
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("simulat",), "did you mean 'simulate'"),
        (("simulate", "a1-fall-onto-humn"), "did you mean 'a1-fall-onto-human'"),
        (("simulate", "missing.toml"), "missing.toml"),
        (("simulate", "a1-fall-onto-human", "--set", "mu_low"), "is not NAME=NUMBER"),
        (("simulate", "a1-fall-onto-human", "--set", "drop_m=0.1"), "did you mean 'drop_mu'"),
        (("simulate", "a1-fall-onto-human", "--policy", "lader"), "did you mean 'ladder'"),
        (("simulate", "a1-fall-onto-human", "--twin", "fmx"), "did you mean 'fmu'"),
        (("simulate", "a1-fall-onto-human", "--supervisor", "onn"), "'on', 'shadow', 'off'"),
        (("config", "check", "nowhere.toml"), "nowhere.toml"),
    ],
)
@pytest.mark.parametrize("as_json", [False, True])
def test_bad_input_is_one_error_and_exit_2(words: tuple[str, ...], message: str, as_json: bool) -> None:
    done = foreshock(*words, *(["--json"] if as_json else []))
    assert done.returncode == 2, done.stdout + done.stderr
    if as_json:
        answer = json.loads(done.stdout)
        assert answer["ok"] is False
        assert answer["result"] is None
        assert message in answer["errors"][0]["message"]
    else:
        assert message in done.stderr
        assert done.stdout == ""
        assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (GOOD + "[gates]\ncautoin = 0.5\n", "gates.cautoin: unknown key; did you mean 'caution'"),
        (GOOD.replace("telemetry", "telemetri"), "no plugin 'telemetri' is installed; did you mean 'telemetry'"),
        (GOOD.replace("telemetry", "ladder"), "plugin 'ladder' offers no detector 'ladder'"),
        (
            GOOD + "[[policies]]\nuse = 'lader'\n",
            "policies[0].use: no plugin 'lader' is installed; did you mean 'ladder'?",
        ),
        (GOOD + "[gates]\ncaution = 'high'\n", "gates.caution: Expected `float`, got `str`, got 'high'"),
        (GOOD + "[gates]\ncaution = 0.1\n", "protective 0.3 <= caution 0.1 must hold"),
        (GOOD + "[gates\n", "not TOML"),
        (GOOD + GOOD, "'telemetry' is listed twice"),
        ("[supervisor]\nperiod_s = 0.01\n", "missing required field `detectors`"),
        (GOOD + "[detectors.channels]\nodometri = 'a/b'\n", "has no such input"),
        (GOOD + "[link]\nlissten = []\n", "link.lissten: unknown key; did you mean 'listen'"),
        (GOOD + "[link]\nlisten = ['tcp/0.0.0.0:7447']\n", "link.listen: 'tcp/0.0.0.0:7447' is beyond this machine"),
        (GOOD + "[live]\nttl_s = 2.0\n", "live.ttl_s: 2.0 is not a finite number"),
        (GOOD + "[live.streams]\n'imu/state' = 'Imuu'\n", "there is no message 'Imuu'; did you mean 'Imu'"),
        (GOOD + "[journal]\nmax_byte = 1\n", "max_byte: unknown key; did you mean 'max_bytes'"),
    ],
)
def test_a_bad_configuration_names_the_place(text: str, message: str, tmp_path: Path) -> None:
    file = tmp_path / "robot.toml"
    file.write_text(text)
    done = foreshock("config", "check", str(file))
    assert done.returncode == 2
    assert message in done.stderr.replace("\n", " ")


def test_a_good_configuration_passes(tmp_path: Path) -> None:
    file = tmp_path / "robot.toml"
    file.write_text(GOOD)
    done = foreshock("config", "check", str(file), "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["result"]["detectors"] == ["telemetry"]


def test_a_file_that_run_takes_passes(tmp_path: Path) -> None:
    file = tmp_path / "talos.toml"
    page = (Path(__file__).parents[2] / "docs" / "live.md").read_text()
    file.write_text(page.partition("```toml\n")[2].partition("```")[0])
    assert "[link]" in file.read_text()
    done = foreshock("config", "check", str(file))
    assert done.returncode == 0, done.stderr
    assert "2 detectors (balance, telemetry)" in done.stdout


def test_a_wrong_detector_is_answered_with_detectors_only(tmp_path: Path) -> None:
    file = tmp_path / "robot.toml"
    file.write_text(GOOD.replace("telemetry", "ladder"))
    hint = foreshock("config", "check", str(file)).stderr.partition("offers no detector 'ladder'")[2]
    assert [word for word in ("ladder", "paper-gate", "fmu", "plants") if word in hint] == []
    assert foreshock("detectors", "check", "telemetri").stderr.endswith("did you mean 'telemetry'?\n")


def test_no_policies_is_a_warning(tmp_path: Path) -> None:
    """Allowed, for a supervisor that is only to judge; but then the minimal risk condition alone protects."""
    file = tmp_path / "robot.toml"
    file.write_text("policies = []\n" + GOOD)
    done = foreshock("config", "check", str(file))
    assert done.returncode == 0
    assert done.stdout.startswith("ok")
    assert done.stderr == "warning: policies is empty: nothing intervenes before the minimal risk condition\n"
    (warning,) = json.loads(foreshock("config", "check", str(file), "--json").stdout)["result"]["warnings"]
    assert "policies is empty" in warning
    file.write_text(GOOD)
    assert foreshock("config", "check", str(file)).stderr == ""


def test_a_title_longer_than_its_table_stays_whole(capsys: pytest.CaptureFixture[str]) -> None:
    title = f"{'/a/long/path' * 20}/[1].mcap: 7 ticks, 0.1 s"
    table(title, "topic", rows=[("x",)])
    assert capsys.readouterr().out.splitlines()[0] == title


@pytest.mark.parametrize("words", [("taxonomy", "show"), ("config", "schema"), ("scenarios", "list")])
def test_a_broken_plugin_is_said_to_be_left_out(
    words: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One line each, whole: the reason may be longer than the terminal is wide."""
    gallery = install(tmp_path / "gallery", {"bad-import": "rogue_bad_import", "exits": "rogue_exits"})
    here = str(Path(__file__).parents[2])
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(gallery), here, os.environ.get("PYTHONPATH", "")]))
    done = foreshock(*words)
    assert done.returncode == 0, done.stderr
    first, second = done.stderr.splitlines()
    assert first.startswith("plugin bad-import is left out: plugin bad-import: import failed: ")
    assert "foreshock.detektor" in first
    assert second.startswith("plugin exits is left out: plugin exits: import failed: SystemExit: ")


def test_taxonomy_as_json() -> None:
    answer = json.loads(foreshock("taxonomy", "show", "--json").stdout)
    assert answer["schema"] == "foreshock/1"
    assert [m["code"] for m in answer["result"]["taxonomy"]["modes"]] == [f"A{k}" for k in range(1, 13)]


def test_scenarios_are_listed() -> None:
    answer = json.loads(foreshock("scenarios", "list", "--json").stdout)
    assert "a1-fall-onto-human" in {s["id"] for s in answer["result"]}
