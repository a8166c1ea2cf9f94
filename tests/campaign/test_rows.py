"""What a row says of the time under an action, and of the safe state, against the run's own series."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest

from foreshock.campaign.ledger import Row, row_of
from foreshock.campaign.plan import Case
from foreshock.records import Intervention
from foreshock.registry import Registry
from foreshock.session.isolated import Job, run_all
from foreshock.session.run import Arm, Run
from foreshock.session.scenario import find_scenario
from foreshock.session.scripted import held

CASE = Case("k", "s", "A1", 0, 0, 1, "on", {})


def run(scenario: str, arm: Arm, seed: int, scripted: tuple[Intervention, ...] = ()) -> Run:
    (result,) = run_all([Job(find_scenario(scenario, Registry()), arm, seed, detail=True, scripted=scripted)], 1, None)
    assert isinstance(result, Run)
    return result


def row(result: Run, scripted: tuple[Intervention, ...] = ()) -> Row:
    return row_of(CASE, result, 0.0, scripted)


def made(*changes: Intervention, ignored: tuple[str, ...] = (), end_s: float = 10.0) -> Run:
    return Run("s", "A1", "on", "", 1, {}, False, "none", (), end_s, interventions=changes, ignored=ignored)


def act(t_s: float, action: str, strength: float) -> Intervention:
    return Intervention(round(t_s * 1e9), action, strength)


def test_time_under_an_action_is_the_union_of_all_but_announcing() -> None:
    changes = (
        act(1.0, "speed-scale", 0.4),
        act(1.5, "announce", 1.0),
        act(2.0, "hold", 1.0),
        act(3.0, "speed-scale", 0.0),
        act(4.0, "hold", 0.5),  # a release that ramps
        act(4.5, "hold", 0.0),
        act(8.0, "hold", 1.0),  # until the end
    )
    assert row(made(*changes)).reduced_s == pytest.approx(3.5 + 2.0)
    assert row(made(*changes, ignored=("hold",))).reduced_s == pytest.approx(2.0)
    assert row(made(act(1.0, "announce", 1.0))).reduced_s == 0.0
    assert row(made(act(12.0, "hold", 1.0))).reduced_s == 0.0


@pytest.mark.parametrize(("arm", "seed"), [("on", 3), ("shadow", 4)])
def test_the_safe_state_is_where_trust_came_back_for_good(arm: Arm, seed: int) -> None:
    result = run("a1-fall-onto-human", arm, seed)
    times, trust = result.series["t_s"], result.series["control_trust"]
    low = [k for k, v in enumerate(trust) if not v >= 0.6]  # the caution gate's default
    assert low, "the scenario has a knock"
    if result.accident:
        assert result.safe_s is None
    else:
        assert result.safe_s == (times[low[-1] + 1] if low[-1] + 1 < len(times) else None)


def test_time_under_an_action_is_that_of_the_run_itself() -> None:
    """The series hold what was in force after each tick; held from the start it is the whole run."""
    result = run("a1-fall-onto-human", "on", 3)
    columns = [
        c
        for name, c in result.series.items()
        if name.startswith("action:") and name != "action:announce" and name.split(":")[1] not in result.ignored
    ]
    times = [*result.series["t_s"], result.end_s]
    active = [any(c[k] > 0.0 for c in columns if not math.isnan(c[k])) for k in range(len(times) - 1)]
    seen = sum(b - a for (a, b), on in zip(pairwise(times), active, strict=True) if on)
    assert row(result).reduced_s == pytest.approx(seen, abs=1e-6)
    assert seen > 0.0
    always = held(result.interventions)
    again = run("a1-fall-onto-human", "off", 3, always)
    assert row(again, always).reduced_s == pytest.approx(again.end_s)
    assert again.safe_s is None, "nobody judged"
    assert set(again.ignored) == set(result.ignored)
