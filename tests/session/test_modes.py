"""Every accident mode in short: its scenario harms unsupervised and not supervised, its harmless ones never do.

The figures with intervals come from `foreshock scenarios verify` (docs/results/modes.md); here one seed of each.
"""

from __future__ import annotations

import msgspec
import pytest

from foreshock.config import PolicyEntry
from foreshock.records import ProtectionLevel
from foreshock.registry import Registry
from foreshock.session.isolated import Job, run_all
from foreshock.session.ladder import check_ladder
from foreshock.session.run import Run
from foreshock.session.scenario import scenario_ids
from foreshock.session.verify import plan_of
from foreshock.taxonomy import builtin_taxonomy

MODES = builtin_taxonomy().codes
KNOWN = scenario_ids(Registry())


@pytest.mark.parametrize("mode", MODES)
def test_the_accident_happens_unsupervised_and_not_supervised(mode: str) -> None:
    plan = plan_of(mode, KNOWN)
    assert plan is not None
    assert len(plan.harmless) >= 2, "a nominal twin and a near miss"
    nominal = [msgspec.structs.replace(s, duration_s=min(s.duration_s, 12.0)) for s in plan.harmless]
    jobs = [Job(plan.accident, arm, seed, False) for arm in ("shadow", "on") for seed in (0, 1, 2)]
    jobs += [Job(s, "on", 0, False) for s in nominal]
    runs = run_all(jobs, 1)
    assert all(isinstance(r, Run) for r in runs), runs
    shadow, on, calm = runs[:3], runs[3:6], runs[6:]
    assert sum(r.accident for r in shadow) >= 2
    assert sum(r.accident for r in on) <= 1
    cascade = builtin_taxonomy().mode(mode).cascade
    kinds = {builtin_taxonomy().kind(k).id for k in cascade}
    assert any(kinds <= set(r.first_s) for r in shadow if r.accident)
    assert not any(r.accident or r.max_level >= ProtectionLevel.PROTECTIVE for r in calm)


@pytest.mark.parametrize("mode", MODES)
def test_worse_evidence_never_lowers_the_level(mode: str) -> None:
    _, broken = check_ladder(mode, [PolicyEntry("protocol", {"mode": mode})])
    assert broken == []


def test_every_kind_of_the_taxonomy_has_a_detector() -> None:
    registry = Registry()
    assert registry.load_all() == ()
    seen = {registry_kind for spec in registry.detectors() for registry_kind in spec.kinds}
    assert {k.id for k in builtin_taxonomy().kinds} <= seen
