"""Simulated runs as events."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import msgspec
import pytest

from foreshock import evidence as ev
from foreshock.errors import BadInputError
from foreshock.events import EventPrecursor, read_events, write_events
from foreshock.events._stretches import Stretches
from foreshock.events.record import episode, jobs, record
from foreshock.records import Decision, Indication, Precursor, ProtectionLevel, RiskEstimate, Trust
from foreshock.session.isolated import Failure
from foreshock.session.run import Run
from foreshock.session.scenario import Scenario, load_scenario
from foreshock.taxonomy import builtin_taxonomy
from foreshock.twin import TwinEvent

ROGUE = Path(__file__).parents[1] / "rogues" / "fmus" / "rogue"
SLIP, TORSO, COM = "foot-micro-slip", "torso-angular-spike", "com-lateral-deviation"
FALL = TwinEvent(5_000_000_000, "balance-lost", "", 1.0, 0.5, "1")
STRIKE = TwinEvent(6_000_000_000, "fall-onto-human", "A1", 700.0, 280.0, "N")
RUN = Run("a1", "A1", "shadow", "ladder", 7, {"drop_mu": 0.04}, True, STRIKE.id, (FALL, STRIKE), 6.5)
SEEN = (
    EventPrecursor(SLIP, 2.0, 2.75, 0.4, "left"),
    EventPrecursor(TORSO, 2.5, 5.0),
    EventPrecursor(SLIP, 5.0, None, 0.9, "left"),
    EventPrecursor(COM, 6.5),
)


def test_an_event_holds_what_began_before_the_accident() -> None:
    got = episode(RUN, SEEN, platform="talos")
    assert got.precursors == SEEN[:3]  # what began after the accident announced nothing
    assert (got.id, got.group, got.source, got.coder) == ("a1-seed-7", "a1-seed-7", "simulated", "detectors")
    assert (got.outcome, got.outcome_s, got.observed_s) == ("A1", 6.0, 6.5)
    assert (got.platform, got.environment, got.deviation) == ("talos", "simulated (drop_mu=0.04)", ("kinematic",))
    assert got.escalation.startswith("foot-micro-slip left at 2.000 s, then torso-angular-spike at 2.500 s, then ")
    assert got.escalation.endswith(
        "balance-lost at 5.000 s, then foot-micro-slip left at 5.000 s, then fall-onto-human at 6.000 s"
    )


def test_a_run_without_accident_is_a_near_miss() -> None:
    got = episode(msgspec.structs.replace(RUN, accident=False, outcome="balance-lost", events=(FALL,)), SEEN)
    assert (got.outcome, got.outcome_s, got.accident) == ("none", None, False)
    assert got.precursors == SEEN


def test_a_run_that_nobody_judged_says_nothing_of_precursors() -> None:
    with pytest.raises(BadInputError, match=r"run a1, seed 7: .*run it in shadow"):
        episode(msgspec.structs.replace(RUN, supervisor="off"), ())


def decision(now_ns: int, precursors: Sequence[Precursor], said: Sequence[Indication]) -> Decision:
    risk = RiskEstimate(0.0, 0.0, 0.0, 0.0, 0.0, {}, {}, {})
    trust = Trust(1.0, 1.0, {}, {}, {}, {})
    return Decision(
        now_ns,
        0,
        tuple(precursors),
        risk,
        trust,
        ProtectionLevel.NORMAL,
        {},
        (),
        (),
        (),
        True,
        indications=tuple(said),
    )


def test_every_stretch_is_kept_with_its_highest_severity() -> None:
    """A slip that comes back within the window, seen by two detectors, and a torso that is outside of what is kept.

    Ticks of 0.1 s through foreshock.evidence with its window of 1.5 s, so that the second slip finds the first there.
    """
    severities = {0.2: 0.3, 0.3: 0.7, 0.4: 0.5, 1.0: 0.2, 1.1: 0.9}
    kept = Stretches(frozenset({SLIP}))
    state = ev.Evidence()
    for k in range(12):
        t, now = round(0.1 * k, 1), k * 100_000_000
        said = [
            Indication(SLIP, "left", now, t in severities, 1.0, 1.0, "1", severities.get(t, 0.0)),
            Indication(SLIP, "left", now, t == 0.3, 1.0, 1.0, "1", 0.1),
            Indication(TORSO, "", now, True, 1.0, 1.0, "1"),
        ]
        heard = {(i.kind, i.subject, f"detector-{n}"): i for n, i in enumerate(said)}
        state, precursors = ev.step(state, ev.Window(), now, heard)
        kept.tick((), decision(now, precursors, said))
    first, second = (0.2, 0.4, 0.7), (1.0, None, 0.9)
    assert [(p.onset_s, p.end_s, p.severity) for p in kept.found(1.1)] == [first, second]
    assert {(p.kind, p.subject) for p in kept.found(1.1)} == {(SLIP, "left")}
    # what an accident at 1.05 s cut short: the rise at 1.1 s came after it
    assert [(p.onset_s, p.end_s, p.severity) for p in kept.found(1.05)] == [first, (1.0, None, 0.2)]
    assert [(p.onset_s, p.end_s, p.severity) for p in kept.found(0.3)] == [(0.2, None, 0.7)]


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
