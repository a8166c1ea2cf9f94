"""Falsification finds what the supervisor does not prevent, and takes neither noise nor a failure for that."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import msgspec
import pytest

from foreshock.campaign import begin, load_campaign, reopen
from foreshock.campaign.falsify import FRESH, Found, Search, _Source, falsify
from foreshock.campaign.ledger import LEDGER, Ledger
from foreshock.campaign.optimiser import Optimiser
from foreshock.campaign.plan import plan_of
from foreshock.campaign.robustness import Robustness
from foreshock.campaign.spec import parse_campaign
from foreshock.errors import BadInputError, ConfigError
from foreshock.registry import Registry
from foreshock.session.isolated import Job, run_one
from foreshock.session.run import Run
from foreshock.session.scenario import Distribution, find_scenario
from foreshock.twin import TwinEvent
from tests.campaign.conftest import SCENARIO

COMMAND = [sys.executable, "-c", "from foreshock.cli import main; main()", "falsify"]
LIFT = Search("a11-co-carry-instability", {"lift": (0.1, 0.6)}, runs=60, seeds=3)  # nothing saves the highest lifts


def of_result(found: Found) -> Found:
    """Without what may differ between folders and calls."""
    cases = tuple(msgspec.structs.replace(c, file="") for c in found.cases)
    return msgspec.structs.replace(found, known=0, cases=cases)


def test_it_finds_a_case_that_a_simulation_of_the_file_replays(tmp_path: Path) -> None:
    told: list[Found] = []
    found = falsify(LIFT, tmp_path / "one", Registry(), 1, told=told.append)
    (case,) = found.cases
    assert 2 * case.supervised.k > case.supervised.n == FRESH
    assert 0.1 <= case.parameters["lift"] <= 0.6
    assert found.failed == {}
    assert found.runs <= LIFT.runs
    assert [f.runs for f in told] == sorted(f.runs for f in told)
    scenario = find_scenario(case.file, Registry())
    assert "lift" not in scenario.distributions
    run = run_one(Job(scenario, "on", scenario.seed))
    assert run.accident
    hit = next(e for e in run.events if e.mode == "A11")
    assert case.accident.startswith(f"{hit.id} at {hit.stamp_ns / 1e9:.3f} s")
    # any number of workers gives the same; and what the ledger knows is not run again
    assert of_result(falsify(LIFT, tmp_path / "two", Registry(), 2)) == of_result(found)
    before = Path(case.file).read_bytes()
    again = falsify(LIFT, tmp_path / "one", Registry(), 1)
    assert of_result(again) == of_result(found)
    assert again.known == len(told)
    assert Path(case.file).read_bytes() == before


def test_killed_it_goes_on_to_the_same_result(tmp_path: Path) -> None:
    words = [LIFT.scenario, "--vary", "lift=0.1:0.6", "--runs", "60", "--seeds", "3", "--workers", "1"]
    process = subprocess.Popen([*COMMAND, *words, "--out", str(tmp_path / "broken")], stderr=subprocess.DEVNULL)
    deadline = time.monotonic() + 60.0
    while _rows(tmp_path / "broken") < 4 and process.poll() is None and time.monotonic() < deadline:
        time.sleep(0.01)
    process.send_signal(signal.SIGKILL)
    process.wait()
    kept = _rows(tmp_path / "broken")
    assert kept >= 4
    done = subprocess.run(
        [*COMMAND, *words, "--out", str(tmp_path / "broken"), "--json"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 1, done.stderr  # a case is a negative result
    result = msgspec.convert(json.loads(done.stdout)["result"], Found)
    assert result.known == kept
    assert of_result(result) == of_result(falsify(LIFT, tmp_path / "whole", Registry(), 1))


def _rows(folder: Path) -> int:
    if not (folder / LEDGER).exists():
        return 0
    try:
        with Ledger(folder) as ledger:
            return int(ledger._db.execute("select count(*) from meta where name != 'falsify'").fetchone()[0])
    except BadInputError:  # being made
        return 0


def test_failures_are_classified_and_are_no_accident(tmp_path: Path) -> None:
    (tmp_path / "rogue.toml").write_text(SCENARIO)
    search = Search(str(tmp_path / "rogue.toml"), {"behaviour": (5.0, 5.9)}, "always(count <= 1)", runs=6, seeds=3)
    found = falsify(search, tmp_path / "out", Registry(), 1)
    assert found.failed == {"crash": 6}
    assert (found.cases, found.candidates, found.robustness) == ((), 0, None)


def _run(job: Job, *, accident: bool, height: float) -> Run:
    event = TwinEvent(0, "load-on-foot", job.scenario.mode, 300.0, 260.0, "N")
    events = (event,) if accident else ()
    series = {"t_s": [0.0, 0.1], "true:leg_force": [0.0, 260.0 * height], "true:tilt": [0.0, 0.0]}
    where = (job.scenario.id, job.scenario.mode, job.arm, "", job.seed, {})
    return Run(*where, accident, "", events, 0.1, series=series if job.detail else {})


@pytest.mark.parametrize(
    ("of_search", "of_fresh", "candidates", "cases"),
    [(2, 0, True, 0), (2, 5, True, 0), (2, 6, True, 1), (1, 9, False, 0)],
)
def test_noise_is_not_taken_for_a_weakness(
    tmp_path: Path, of_search: int, of_fresh: int, candidates: bool, cases: int
) -> None:
    """An accident on so many of three seeds, and on so many of the ten fresh ones."""
    search = msgspec.structs.replace(LIFT, runs=12)
    entry = {"id": "c", "scenarios": [{"use": search.scenario}]}
    arms = [{"id": "on", "kind": "on"}, {"id": "none", "kind": "none"}]
    source = _Source(
        search, plan_of(parse_campaign({**entry, "arms": arms}, "c"), tmp_path, Registry()), tmp_path, None
    )
    with Ledger(tmp_path, new=True) as source.ledger:
        while (given := source.next()) is not None:
            key, job = given
            accident = job.seed < of_search if job.seed < 3 else job.seed < 3 + of_fresh
            source.done(key, _run(job, accident=accident, height=0.5), 0.0)
    assert (source.found.candidates > 0) == candidates
    assert len(source.found.cases) == cases
    for case in source.found.cases:
        assert (case.supervised.k, case.supervised.n) == (of_fresh, FRESH)
        assert find_scenario(case.file, Registry()).seed == case.seed == 3


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"bounds": {"lfit": (0.1, 0.6)}}, "no parameter 'lfit'; did you mean 'lift'"),
        ({"scenario": "a11-co-carry-instabilty"}, "did you mean 'a11-co-carry-instability'"),
        ({"scenario": "a11-*"}, "3 scenarios; expected one"),
        ({"formula": "always(leg_forse <= 260)"}, "'leg_forse' is no probe of the plant; did you mean 'leg_force'"),
        ({"formula": "always(leg_force/260 <= 1)"}, "'leg_force/260' is no probe .* put spaces around a slash"),
        ({"formula": "always(leg_force <= "}, "RTAMT refuses"),
        ({"formula": "always(1 <= 2)"}, "names no probe"),
        ({"policy": "protocoll"}, "did you mean 'protocol'"),
        ({"scenario": "a11-co-carry-instability-nominal"}, "has no `safe`"),
        ({"scenario": "a1-fall-onto-human", "bounds": {}}, "draws no parameter; name bounds"),
    ],
)
def test_what_is_wrong_is_named(change: dict[str, object], said: str, tmp_path: Path) -> None:
    with pytest.raises(BadInputError, match=said):
        falsify(msgspec.structs.replace(LIFT, **change), tmp_path / "out", Registry(), 1)


@pytest.mark.parametrize("bounds", [(0.6, 0.1), (0.1, 0.1), (0.1, float("inf")), (float("nan"), 1.0)])
def test_bad_bounds_are_refused(bounds: tuple[float, float]) -> None:
    with pytest.raises(ConfigError, match=r"bounds\.lift"):
        Search(LIFT.scenario, {"lift": bounds})


def test_a_folder_of_something_else_is_refused(tmp_path: Path) -> None:
    (tmp_path / "rogue.toml").write_text(SCENARIO)
    search = Search(str(tmp_path / "rogue.toml"), {"behaviour": (5.0, 5.9)}, "always(count <= 1)", runs=3, seeds=3)
    falsify(search, tmp_path / "out", Registry(), 1)
    assert falsify(msgspec.structs.replace(search, runs=6), tmp_path / "out", Registry(), 1).known == 3
    with pytest.raises(ConfigError, match=r"search\.seed was 0, is 1\ntake another folder"):
        falsify(msgspec.structs.replace(search, seed=1), tmp_path / "out", Registry(), 1)
    (tmp_path / "rogue.toml").write_text(SCENARIO.replace("duration_s = 0.3", "duration_s = 0.4"))
    with pytest.raises(ConfigError, match=r"rogue\.duration_s was 0\.3, is 0\.4\ntake another folder"):
        falsify(search, tmp_path / "out", Registry(), 1)


def test_bad_input_leaves_nothing_in_the_way(tmp_path: Path) -> None:
    with pytest.raises(BadInputError, match="did you mean 'lift'"):
        falsify(msgspec.structs.replace(LIFT, bounds={"lfit": (0.1, 0.6)}, runs=3), tmp_path / "out", Registry(), 1)
    assert falsify(msgspec.structs.replace(LIFT, runs=3), tmp_path / "out", Registry(), 1).runs >= 3


def test_a_search_and_a_campaign_refuse_each_others_folders(campaign_file: Path, tmp_path: Path) -> None:
    search = Search(str(tmp_path / "rogue.toml"), {"behaviour": (5.0, 5.9)}, "always(count <= 1)", runs=3, seeds=3)
    spec, origin = load_campaign(str(campaign_file))
    begin(spec, origin, tmp_path / "campaign", Registry())
    with pytest.raises(ConfigError, match="holds a campaign, and no search; take another folder"):
        falsify(search, tmp_path / "campaign", Registry(), 1)
    assert falsify(search, tmp_path / "search", Registry(), 1).runs == 3
    said = "holds a search of foreshock falsify, and no campaign"
    with pytest.raises(ConfigError, match=f"{said}; take another folder"):
        begin(spec, origin, tmp_path / "search", Registry())
    with pytest.raises(ConfigError, match=said):
        reopen(tmp_path / "search", Registry())


@pytest.mark.parametrize("kind", ["tpe", "random"])
def test_points_keep_to_the_support_and_follow_from_the_seed(kind: str) -> None:
    space = {
        "u": Distribution(uniform=(2.0, 5.0)),
        "n": Distribution(normal=(1.0, 0.5)),
        "c": Distribution(choice=(0.0, 3.0, 7.0)),
    }

    def points(seed: int) -> list[dict[str, float]]:
        optimiser = Optimiser(space, kind, seed)  # type: ignore[arg-type]
        found = []
        for _ in range(8):
            asked = [optimiser.ask() for _ in range(4)]
            for trial, values in asked:
                optimiser.tell(trial, None if values["c"] == 7.0 else values["u"])
                found.append(values)
        return found

    one = points(3)
    assert one == points(3) != points(4)
    for p in one:
        assert 2.0 <= p["u"] <= 5.0
        assert -0.5 <= p["n"] <= 2.5  # cut off at three standard deviations, as in a draw
        assert p["c"] in (0.0, 3.0, 7.0)


def test_robustness_is_that_of_the_formula() -> None:
    """Quantitative semantics of Donzé and Maler (2010): always is a minimum over time, and of two sides the lesser."""
    series = {"t_s": [0.0, 0.1, 0.2], "true:x": [1.0, 4.0, 2.0], "true:y": [0.5, -0.25, 3.0]}
    assert Robustness("always(x <= 5)", 0.1).of(series) == pytest.approx(1.0, abs=1e-12)
    assert Robustness("always(x <= 5 and y >= 0)", 0.1).of(series) == pytest.approx(-0.25, abs=1e-12)
    assert Robustness("eventually(x / 2 >= 1)", 0.1).of(series) == pytest.approx(1.0, abs=1e-12)
