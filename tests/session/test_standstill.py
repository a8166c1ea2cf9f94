"""No sensor of a ready plant repeats itself where a detector takes that for frozen: not in one pair of samples."""

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


class Repeats:
    """A journal that keeps how often each channel repeated its values."""

    def __init__(self) -> None:
        self.last: dict[str, Sample] = {}
        self.count: dict[str, int] = {}

    def tick(self, samples: Any, decision: object, verdicts: object) -> None:
        for s in samples:
            before = self.last.get(s.channel)
            self.count[s.channel] = self.count.get(s.channel, 0) + (
                before is not None and stands_still(before.value, s.value)
            )
            self.last[s.channel] = s


@pytest.mark.slow
@pytest.mark.parametrize("mode", builtin_taxonomy().codes)
def test_what_a_detector_calls_frozen_never_stands_still_in_a_ready_scenario(mode: str, tmp_path: Path) -> None:
    for id_, scenario in SCENARIOS.items():
        if scenario.mode != mode:
            continue
        twin = build_twin(scenario, REGISTRY, tmp_path / id_)
        judge = Supervisor(scenario.supervisor(), Path(scenario.folder), REGISTRY)
        watched = {i.channel for i in judge.inputs() if i.max_standstill_s > 0.0}
        assert watched, f"{id_}: nothing is watched for standing still"
        repeats = Repeats()
        simulate(
            msgspec.structs.replace(scenario, duration_s=min(scenario.duration_s, 12.0)),
            twin,
            judge,
            "on",
            1,
            detail=False,
            journals=[repeats],
        )  # type: ignore[list-item]
        judge.close()
        twin.close()
        assert watched <= repeats.count.keys(), f"{id_}: {sorted(watched - repeats.count.keys())} never came"
        assert {c: repeats.count[c] for c in watched if repeats.count[c]} == {}, id_
