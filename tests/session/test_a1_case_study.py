"""The paper's case study in closed loop, on seeds that nothing was tuned on."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import msgspec
import pytest

from foreshock.registry import Registry
from foreshock.session.isolated import Job, run_all
from foreshock.session.run import Run
from foreshock.session.scenario import find_scenario

SEEDS = range(20_000, 20_004)
CASCADE = ("foot-micro-slip", "torso-angular-spike", "com-lateral-deviation")  # Table 3, A1


def runs(scenario: str, arm: str, parameters: dict[str, float] | None = None, policy: str | None = None) -> list[Run]:
    found = find_scenario(scenario, Registry()).with_(parameters, policy)
    results = run_all([Job(found, arm, seed, detail=False) for seed in SEEDS], workers=2)
    assert all(isinstance(r, Run) for r in results), results
    return results


@pytest.fixture(scope="module")
def unsupervised() -> list[Run]:
    return runs("a1-fall-onto-human", "shadow")


def test_unsupervised_it_falls_onto_the_human(unsupervised: list[Run]) -> None:
    for run in unsupervised:
        assert run.accident
        fall = next(e for e in run.events if e.id == "fall-onto-human")
        assert fall.value > fall.limit  # beyond the transient limit for the chest


def test_the_cascade_is_found_in_the_order_of_table_3(unsupervised: list[Run]) -> None:
    for run in unsupervised:
        times = [run.first_s[kind] for kind in CASCADE]
        assert times == sorted(times)
        assert len(set(times)) == 3
        assert times[-1] < min(e.stamp_ns for e in run.events) / 1e9


def test_shadow_leaves_the_plant_alone(unsupervised: list[Run]) -> None:
    assert [r.events for r in runs("a1-fall-onto-human", "off")] == [r.events for r in unsupervised]


def test_with_the_ladder_it_stays_upright() -> None:
    for run in runs("a1-fall-onto-human", "on"):
        assert run.events == ()
        assert run.gate_s["caution"] <= run.gate_s.get("protective", 99.0)


def test_the_cascade_follows_the_patch_to_the_other_foot() -> None:
    """Patch under the right foot, gait and human mirrored: the right foot slips, the fall goes to the other side."""
    mirrored = {"drop_foot": 1.0, "first_support": -1.0, "human_place_y": 0.9, "com_bias": -0.0017}
    for run in runs("a1-fall-onto-human", "shadow", mirrored):
        assert run.accident
        assert [run.first_s[k] for k in CASCADE] == sorted(run.first_s[k] for k in CASCADE)


@pytest.mark.parametrize("scenario", ["a1-fall-onto-human-nominal", "a1-fall-onto-human-nominal-standing"])
def test_nominal_motion_raises_no_intervention(scenario: str) -> None:
    """Five minutes each of stepping and of standing, ten in all."""
    found = msgspec.structs.replace(find_scenario(scenario, Registry()), duration_s=75.0)
    for run in run_all([Job(found, "on", seed, detail=False) for seed in SEEDS], workers=2):
        assert isinstance(run, Run)
        assert run.interventions == ()
        assert run.max_level == 0
        assert run.events == ()


def test_a_near_miss_recovers_by_itself() -> None:
    assert all(r.events == () for r in runs("a1-fall-onto-human-near-miss", "off"))


def test_demo_writes_a_report_that_stands_alone(tmp_path: Path) -> None:
    words = ["demo", "--out", str(tmp_path), "--seeds", "2", "--per-cell", "1", "--json"]
    done = subprocess.run(
        [sys.executable, "-c", "from foreshock.cli import main; main()", *words],
        capture_output=True,
        text=True,
        check=False,
        timeout=600,
    )
    assert done.returncode == 0, done.stderr
    answer = json.loads(done.stdout)
    assert answer["ok"] is True
    assert len(answer["result"]["runs"]) == 3
    page = (tmp_path / "report.html").read_text()
    assert not re.search(r"(src|href)=[\"'](?!data:)", page)
    assert "<script" not in page
    assert page.count("data:image/svg+xml;base64,") == 2
    assert all((tmp_path / name).stat().st_size > 20_000 for name in ("runs.png", "sweep.png"))
