"""Simulated runs as events."""

from __future__ import annotations

import math
from pathlib import Path

import msgspec
import pytest

from foreshock.errors import BadInputError
from foreshock.events import EventPrecursor, read_events, write_events
from foreshock.events.record import episode, jobs, record
from foreshock.evidence import Window
from foreshock.session.isolated import Failure
from foreshock.session.run import Run, TimelineRow
from foreshock.session.scenario import Scenario, load_scenario
from foreshock.taxonomy import builtin_taxonomy
from foreshock.twin import TwinEvent

ROGUE = Path(__file__).parents[1] / "rogues" / "fmus" / "rogue"
LEFT, RIGHT = "foot-micro-slip@left", "foot-micro-slip@right"


def row(t_s: float, *precursors: str) -> TimelineRow:
    return TimelineRow(t_s, precursors, *[math.nan] * 5, "normal")


ROWS = (
    row(0.005),
    row(2.0, f"+{LEFT}"),
    row(2.5, LEFT, "+torso-angular-spike"),
    row(4.25, "torso-angular-spike"),  # left foot: last present 1.5 s ago
    row(4.75, "torso-angular-spike", f"+{RIGHT}"),
    row(5.0, RIGHT, "torso-angular-spike", f"+{LEFT}"),
    row(6.5, RIGHT, LEFT, "+com-lateral-deviation"),
)
FALL = TwinEvent(5_000_000_000, "balance-lost", "", 1.0, 0.5, "1")
STRIKE = TwinEvent(6_000_000_000, "fall-onto-human", "A1", 700.0, 280.0, "N")
RUN = Run("a1", "A1", "shadow", "ladder", 7, {"drop_mu": 0.04}, True, STRIKE.id, (FALL, STRIKE), 6.5, timeline=ROWS)


def test_onsets_and_ends_follow_from_the_window() -> None:
    got = episode(RUN, platform="talos")
    assert got.precursors == (
        EventPrecursor("foot-micro-slip", 2.0, 2.75, 1.0, "left"),
        EventPrecursor("torso-angular-spike", 2.5, 5.0),
        EventPrecursor("foot-micro-slip", 4.75, None, 1.0, "right"),
        EventPrecursor("foot-micro-slip", 5.0, None, 1.0, "left"),
    )  # what began after the accident announced nothing
    assert (got.id, got.group, got.source, got.coder) == ("a1-seed-7", "a1-seed-7", "simulated", "detectors")
    assert (got.outcome, got.outcome_s, got.observed_s) == ("A1", 6.0, 6.5)
    assert (got.platform, got.environment, got.deviation) == ("talos", "simulated (drop_mu=0.04)", ("kinematic",))
    assert got.escalation.startswith("foot-micro-slip left at 2.000 s, then torso-angular-spike at 2.500 s, then ")
    assert got.escalation.endswith(
        "balance-lost at 5.000 s, then foot-micro-slip left at 5.000 s, then fall-onto-human at 6.000 s"
    )


def test_another_window_gives_other_ends() -> None:
    got = episode(RUN, window=Window(0.5))
    assert got.precursors[0].end_s == pytest.approx(3.75)
    assert episode(RUN, window=Window(0.1, kernel="exponential")).precursors[0].end_s == pytest.approx(3.75)


def test_a_run_without_accident_is_a_near_miss() -> None:
    got = episode(msgspec.structs.replace(RUN, accident=False, outcome="balance-lost", events=(FALL,)))
    assert (got.outcome, got.outcome_s, got.accident) == ("none", None, False)
    assert got.precursors[-1] == EventPrecursor("com-lateral-deviation", 6.5)


@pytest.mark.parametrize("lacking", [{"supervisor": "off"}, {"timeline": ()}])
def test_a_run_that_nobody_judged_says_nothing_of_precursors(lacking: dict) -> None:
    with pytest.raises(BadInputError, match=r"run a1, seed 7: .*run it in shadow"):
        episode(msgspec.structs.replace(RUN, **lacking))


@pytest.fixture
def scenario(tmp_path: Path) -> Scenario:
    file = tmp_path / "rogue.toml"
    file.write_text(f"""
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
""")
    return load_scenario(file)


def test_parameters_are_drawn_by_seed(scenario: Scenario) -> None:
    other = msgspec.structs.replace(scenario, id="other")
    made = jobs([scenario, other], range(3), {"from": (0.01, 0.02), "behaviour": (0.0, 0.0)})
    assert [(j.scenario.id, j.seed, j.arm) for j in made] == [
        (s, k, "shadow") for s in ("rogue", "other") for k in range(3)
    ]
    drawn = [j.scenario.parameters["from"] for j in made]
    assert drawn[:3] == drawn[3:]
    assert len(set(drawn)) == 3
    assert all(0.01 <= v < 0.02 for v in drawn)
    assert jobs([scenario], range(3), {"from": (0.01, 0.02)})[2].scenario.parameters["from"] != 0.01


def test_what_would_give_one_id_twice_is_refused(scenario: Scenario) -> None:
    with pytest.raises(BadInputError, match="scenario rogue stands there twice"):
        jobs([scenario, scenario], [0])
    with pytest.raises(BadInputError, match="seed 1 stands there twice"):
        jobs([scenario], [1, 1])
    with pytest.raises(BadInputError, match=r"vary from: 2 is above 1"):
        jobs([scenario], [1], {"from": (2.0, 1.0)})


def test_a_run_that_fails_costs_no_other(scenario: Scenario, tmp_path: Path) -> None:
    failing = msgspec.structs.replace(scenario.with_({"behaviour": 1.0}), id="failing")  # rogue.toml: an error
    told: dict[int, object] = {}
    events = record([scenario, failing], [0, 1], workers=1, done=told.__setitem__)
    assert [e.id for e in events] == ["rogue-seed-0", "rogue-seed-1"]
    assert [isinstance(told[k], Failure) for k in range(4)] == [False, False, True, True]
    assert all((e.outcome, e.precursors, e.observed_s) == ("none", (), pytest.approx(0.1)) for e in events)
    write_events(tmp_path / "a.csv", events)
    table = read_events(tmp_path / "a.csv", builtin_taxonomy())
    assert (list(table.events), table.problems) == (events, ())
