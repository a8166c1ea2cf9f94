"""No sensor of a ready plant comes near the standstill that a detector takes for frozen."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import msgspec
import pytest

from foreshock.messages import stands_still
from foreshock.records import Sample
from foreshock.registry import Registry
from foreshock.session.isolated import build_twin
from foreshock.session.scenario import scenario_ids
from foreshock.session.simulate import simulate
from foreshock.supervisor import Supervisor
from foreshock.taxonomy import builtin_taxonomy

REGISTRY = Registry()
SCENARIOS = scenario_ids(REGISTRY)


class Standstills:
    """A journal that keeps the longest standstill of each channel (s)."""

    def __init__(self) -> None:
        self.moved: dict[str, Sample] = {}
        self.longest_s: dict[str, float] = {}

    def tick(self, samples: Any, decision: object, verdicts: object) -> None:
        for s in samples:
            moved = self.moved.get(s.channel)
            if moved is None or not stands_still(moved.value, s.value):
                self.moved[s.channel] = moved = s
            still_s = (s.stamp_ns - moved.stamp_ns) / 1e9
            self.longest_s[s.channel] = max(still_s, self.longest_s.get(s.channel, 0.0))


@pytest.mark.slow
@pytest.mark.parametrize("mode", builtin_taxonomy().codes)
def test_no_ready_scenario_stands_still_for_a_quarter_of_what_is_allowed(mode: str, tmp_path: Path) -> None:
    for id_, scenario in SCENARIOS.items():
        if scenario.mode != mode:
            continue
        twin = build_twin(scenario, REGISTRY, tmp_path / id_)
        judge = Supervisor(scenario.supervisor(), Path(scenario.folder), REGISTRY)
        watched = [i for i in judge.inputs() if i.max_standstill_s > 0.0]
        assert watched, f"{id_}: nothing is watched for standing still"
        found = Standstills()
        simulate(
            msgspec.structs.replace(scenario, duration_s=min(scenario.duration_s, 12.0)),
            twin,
            judge,
            "on",
            1,
            detail=False,
            journals=[found],
        )  # type: ignore[list-item]
        judge.close()
        twin.close()
        assert {i.channel for i in watched} <= found.longest_s.keys(), id_
        slow = {
            i.channel: found.longest_s[i.channel]
            for i in watched
            if found.longest_s[i.channel] > i.max_standstill_s / 4
        }
        assert slow == {}, id_
