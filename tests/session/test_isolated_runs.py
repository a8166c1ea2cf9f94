"""Runs in watched processes: what an FMU can do to a run, and that it costs no other run and leaves nothing behind."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import msgspec
import pytest

import foreshock
from foreshock.errors import BadInputError, ConfigError
from foreshock.session.isolated import Failure, Job, run_all
from foreshock.session.run import Run
from foreshock.session.scenario import Scenario, load_scenario

ROGUE = Path(__file__).parents[1] / "rogues" / "fmus" / "rogue"
BEHAVIOURS = {"error": 1, "discard": 2, "nan": 3, "hang": 4, "crash": 5}  # rogue.toml

SCENARIO = f"""
id = "rogue"
title = "A plant that misbehaves"
mode = "A1"
expect = "open"
duration_s = 0.1

[twin]
kind = "fmu"
plant = "{ROGUE}"
binding = "{ROGUE / "binding.toml"}"

[config.supervisor]
period_s = 0.001

[[config.detectors]]
use = "telemetry"
"""


@pytest.fixture
def scenario(tmp_path: Path) -> Scenario:
    file = tmp_path / "rogue.toml"
    file.write_text(SCENARIO)
    return load_scenario(file)


@pytest.fixture
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A temporary folder of this test's own, for this process and its children: other tests run beside it."""
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setenv("TMPDIR", str(folder))
    monkeypatch.setattr(tempfile, "tempdir", None)  # asked for anew
    return folder


def test_each_failure_is_classified_and_costs_no_other_run(scenario: Scenario, temporary: Path) -> None:
    jobs = [Job(scenario, "shadow", seed) for seed in range(3)]
    for kind, behaviour in BEHAVIOURS.items():
        jobs.append(Job(scenario.with_({"behaviour": float(behaviour)}), "shadow", 0))
        jobs.append(Job(scenario, "shadow", len(kind)))
    results = run_all(jobs, workers=2, timeout_s=10.0)
    kinds = [r.kind if isinstance(r, Failure) else "ok" for r in results]
    wanted = ["ok"] * 3
    for kind in BEHAVIOURS:
        wanted += [kind, "ok"]
    assert kinds == wanted
    assert tempfile.gettempdir() == str(temporary)
    assert list(temporary.iterdir()) == []
    crash = results[kinds.index("crash")]
    assert isinstance(crash, Failure)
    assert "SIGSEGV" in crash.detail
    for kind in ("error", "discard"):
        failure = results[kinds.index(kind)]
        assert isinstance(failure, Failure)
        assert "on purpose" in failure.log  # the FMU's own words
    nan = results[kinds.index("nan")]
    assert isinstance(nan, Failure)
    assert "count" in nan.detail


def test_results_do_not_depend_on_workers_or_what_ran_before(scenario: Scenario) -> None:
    jobs = [Job(scenario, "shadow", seed) for seed in range(4)]
    one = run_all(jobs, workers=1)
    two = run_all(jobs[::-1], workers=2)[::-1]
    assert all(isinstance(r, Run) and r.digest for r in one)
    # series hold NaN where a value does not exist, and NaN equals nothing
    assert [msgspec.structs.replace(r, series={}) for r in one] == [msgspec.structs.replace(r, series={}) for r in two]
    assert [str(r.series) for r in one] == [str(r.series) for r in two]


def test_bad_input_of_a_job_is_raised(scenario: Scenario) -> None:
    with pytest.raises(BadInputError, match="did you mean 'behaviour'"):
        run_all([Job(scenario.with_({"behavior": 1.0}), "off", 0)])


@pytest.mark.parametrize("kind", ["error", "crash", "hang"])
def test_the_command_ends_with_one_message_and_exit_3(tmp_path: Path, kind: str) -> None:
    file = tmp_path / "rogue.toml"
    file.write_text(SCENARIO)
    words = ["simulate", str(file), "--set", f"behaviour={BEHAVIOURS[kind]}", "--timeout", "4", "--json"]
    done = subprocess.run(
        [sys.executable, "-c", "from foreshock.cli import main; main()", *words],
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )
    assert done.returncode == 3
    answer = json.loads(done.stdout)
    assert answer["ok"] is False
    assert answer["errors"][0]["kind"] == f"twin {kind}"


BLIND = "warning: no detector can see A1 coming: no kind of telemetry is tied to it"


@pytest.mark.parametrize(
    ("mode", "policies", "warnings"),
    [
        ("A1", "", [BLIND]),
        ("A9", "", []),
        ("A9", "[config]\npolicies = []\n", ["warning: policies is empty"]),
        ("A1", "[config]\npolicies = []\n", [BLIND, "warning: policies is empty"]),
    ],
)
def test_a_run_without_sight_or_means_says_so(tmp_path: Path, mode: str, policies: str, warnings: list[str]) -> None:
    """Telemetry is tied to A9 (Table 3: stop not honoured after a delay) and A12, not to A1."""
    file = tmp_path / "rogue.toml"
    file.write_text(
        SCENARIO.replace('"A1"', f'"{mode}"').replace("[config.supervisor]", f"{policies}[config.supervisor]")
    )
    # where the progress bar was is an empty line
    said = [line for line in _simulate(str(file)).stderr.splitlines() if line]
    assert [line.startswith(w) for line, w in zip(said, warnings, strict=True)] == [True] * len(warnings)
    result = json.loads(_simulate(str(file), "--json").stdout)["result"]
    assert [f"warning: {w}" for w in result["warnings"]] == said
    assert json.loads(_simulate(str(file), "--supervisor", "off", "--json").stdout)["result"]["warnings"] == []


def _simulate(*words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", "from foreshock.cli import main; main()", "simulate", *words],
        capture_output=True,
        text=True,
        check=True,
        timeout=120,
    )


def test_a_twin_whose_step_does_not_divide_the_tick_is_refused(scenario: Scenario) -> None:
    config = {**scenario.config, "supervisor": {"period_s": 0.0015}}
    with pytest.raises(ConfigError, match=r"period_s.*not a multiple"):
        run_all(
            [
                Job(
                    Scenario(**{f: getattr(scenario, f) for f in scenario.__struct_fields__} | {"config": config}),
                    "on",
                    0,
                )
            ]
        )


def test_a_configuration_means_the_files_beside_its_scenario(tmp_path: Path) -> None:
    """Two folders with the same scenario and other parameters: one worker does not take one for the other."""
    shipped = (Path(foreshock.__file__).parent / "data" / "parameters" / "table-3.toml").read_text()
    jobs = []
    for name, text in (("good", shipped), ("bad", "[")):
        folder = tmp_path / name
        folder.mkdir()
        (folder / "mine.toml").write_text(text)
        risk = '[config.risk]\nmodel = "correlated"\nparameters = "mine.toml"\n'
        (folder / "rogue.toml").write_text(SCENARIO + risk)
        jobs.append(Job(load_scenario(folder / "rogue.toml"), "shadow", 1))
    assert isinstance(run_all(jobs[:1])[0], Run)
    with pytest.raises(BadInputError, match=r"bad/mine\.toml"):
        run_all(jobs)
