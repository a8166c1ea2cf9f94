"""Counting of a sweep: an event is not an accident, and an accident may be of another mode."""

from __future__ import annotations

from foreshock.session.run import Arm, Run
from foreshock.session.sweep import Cell, _judge
from foreshock.twin import TwinEvent

FOOT = TwinEvent(4_000_000_000, "dropped-object", "A5", 900.0, 260.0, "N")
PUT_DOWN = TwinEvent(5_000_000_000, "put-down", "", 20.0, 0.0, "N")
CRUSHED = TwinEvent(6_000_000_000, "hand-crushed", "A4", 2.0, 1.0, "1")


def run(arm: Arm, *events: TwinEvent) -> Run:
    accident = any(e.mode == "A5" for e in events)
    return Run("s", "A5", arm, "p", 0, {}, accident, "none", events, 20.0)


def test_a_load_that_is_put_down_was_saved_and_harmed_nobody() -> None:
    cell = Cell("fill_mass", "1", {"fill_mass": 1.0}, tuple(range(5)))
    alone = {0: run("off", FOOT), 1: run("off", FOOT), 2: run("off", FOOT), 3: run("off"), 4: run("off")}
    watched = {
        0: run("on", PUT_DOWN), 1: run("on"), 2: run("on", FOOT), 3: run("on", PUT_DOWN), 4: run("on", CRUSHED),
    }  # fmt: skip
    found = _judge(cell, "supervised", watched, alone)
    assert (found.accidents.k, found.accidents.n) == (1, 5)
    assert (found.averted.k, found.averted.n) == (2, 3)
    assert found.added == 1
