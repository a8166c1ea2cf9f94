"""Bad input is found before the bulk of a campaign: in every arm's configuration and files, and in every fault.

What needs no twin is built at once. Detectors and faults are built by the first tick of a run, which is done of each
combination that no whole run at the beginning has.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import msgspec

from foreshock.campaign.identity import digest
from foreshock.campaign.plan import Case, Plan, runs_in, under
from foreshock.errors import BadInputError, ConfigError
from foreshock.registry import Registry
from foreshock.session.isolated import Job
from foreshock.supervisor import Supervisor

__all__ = ["first_tick", "place_of", "refuse_arms", "to_try"]

TICK_S = 1e-9
"""Shorter than any tick: the run ends after its first."""


def refuse_arms(plan: Plan, registry: Registry) -> None:
    """Build every arm's supervisor without its detectors: risk model, taxonomy, trust, gates and policies.

    Args:
        plan: whose arms they are.
        registry: of plugins.

    Raises:
        ConfigError: what an arm names does not exist, or does not fit.
    """
    for scenario in plan.scenarios.values():
        built: set[str] = set()
        for arm in plan.spec.arms:
            if not arm.judged or not runs_in(scenario.id, arm.scenarios):
                continue
            changed = under(scenario, arm, Path(plan.folder))
            if (of := digest(changed.config)) in built:
                continue
            built.add(of)
            config = msgspec.structs.replace(changed.supervisor(), detectors=())
            try:
                Supervisor(config, Path(changed.folder), registry)
            except BadInputError as e:
                raise ConfigError(f"{scenario.id}, arm {arm.id}: {e.place}", e.problem, e.hint) from None


def to_try(plan: Plan, left: Iterable[Case], whole: Iterable[Case]) -> list[Case]:
    """Runs whose first tick builds what none before has: of each scenario every fault with every set of detectors.

    Args:
        plan: of the campaign.
        left: its runs that are to be done.
        whole: those of them that are done first, as a whole.
    """
    known: dict[tuple[str, str], str] = {}

    def detectors(case: Case) -> str:
        at = case.scenario, case.arm
        if at not in known:
            arm = plan.spec.arm(case.arm)
            config = under(plan.scenarios[case.scenario], arm).config
            known[at] = digest([config.get("detectors"), config.get("supervisor")]) if arm.judged else ""
        return known[at]

    tried: dict[tuple[str, str], set[str]] = {}
    for case in whole:
        tried.setdefault((case.scenario, case.fault), set()).add(detectors(case))
    found = []
    for case in sorted((c for c in left if not c.source), key=lambda c: not detectors(c)):
        tried_with = tried.setdefault((case.scenario, case.fault), set())
        # a run that is judged has the twin and its faults as well
        if detectors(case) not in tried_with and (detectors(case) or not tried_with):
            tried_with.add(detectors(case))
            found.append(case)
    return found


def first_tick(job: Job) -> Job:
    """The run, ended after its first tick."""
    return msgspec.structs.replace(job, scenario=msgspec.structs.replace(job.scenario, duration_s=TICK_S))


def place_of(case: Case) -> str:
    """Where in the campaign a run stands, for messages."""
    return f"{case.scenario}, arm {case.arm}" + (f", fault {case.fault}" if case.fault else "")
