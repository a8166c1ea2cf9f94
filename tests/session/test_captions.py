"""Captions and times of stills, from what a run was."""

from __future__ import annotations

from itertools import pairwise

import msgspec
import pytest

from foreshock.errors import BadInputError
from foreshock.registry import Registry
from foreshock.session.captions import captions, moments
from foreshock.session.isolated import Job, run_all
from foreshock.session.run import Run
from foreshock.session.scenario import find_scenario
from foreshock.twin import Caption, TwinEvent

NAN = float("nan")
SERIES = {
    "t_s": [0.01, 0.02, 0.03, 0.04],
    "trust": [1.0, 1.0, 0.204, 0.2],
    "level": [0.0, 0.0, 2.0, 3.0],
    "action:step-suppression": [NAN, 0.0, 1.0, 1.0],
    "action:balance-lock": [NAN, NAN, NAN, 0.5],
    "action:speed-scale": [0.3, 0.3, 0.3, 0.3],
}


def run(arm="on", **more):
    events = (
        TwinEvent(20_000_000, "fall-onto-human", "A1", 1.0, 0.0, "N"),
        TwinEvent(40_000_000, "fall", "", 1, 1, "N"),
    )
    return Run("s", "A1", arm, "", 0, {}, True, "fall", events, 0.04, series=SERIES, **more)


def test_a_caption_begins_when_something_changes_and_an_accident_is_told_first():
    assert captions(run()) == (
        Caption(0.0, "normal", 1.0),
        Caption(0.02, "normal", 1.0, "fall-onto-human"),
        Caption(0.03, "protective: step-suppression", 0.2, "fall-onto-human"),
        Caption(0.04, "minimal risk: balance-lock, step-suppression", 0.2, "fall-onto-human"),
    )


def test_who_only_watches_has_no_actions_and_nobody_has_no_trust():
    assert {c.text for c in captions(run("shadow"))} == {"normal", "protective", "minimal risk"}
    unjudged = msgspec.structs.replace(run("off"), series={"t_s": SERIES["t_s"]})
    assert captions(unjudged) == (Caption(0.0), Caption(0.02, alarm="fall-onto-human"))


def test_stills_begin_before_the_first_sign_and_end_after_the_last_event():
    long = msgspec.structs.replace(run(first_s={"foot-micro-slip": 2.0}), end_s=9.0, events=())
    fell = msgspec.structs.replace(long, events=(TwinEvent(5_000_000_000, "fall", "", 1, 1, "N"),), first_s={})
    times = moments([long, fell], 4)
    assert times[0] == pytest.approx(1.7)
    assert times[-1] == pytest.approx(5.6)
    assert [b - a for a, b in pairwise(times)] == pytest.approx([1.3] * 3)
    quiet = msgspec.structs.replace(long, first_s={})
    assert moments([quiet], 4) == pytest.approx((0.0, 3.0, 6.0, 9.0))


def test_a_twin_that_keeps_no_poses_is_named():
    scenario = msgspec.structs.replace(find_scenario("a1-fall-onto-human", Registry()), duration_s=0.1)
    with pytest.raises(BadInputError, match="a1-fall-onto-human: twin: 'fmu' keeps no poses"):
        run_all([Job(scenario, "off", 0, poses="p.npz")])
