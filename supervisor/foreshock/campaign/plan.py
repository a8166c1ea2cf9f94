"""From a campaign to its runs: every scenario, point, replicate and arm, each with the key of its result."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping, Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import msgspec

from foreshock._strict import convert
from foreshock.campaign.identity import beside, digest, named_files, twin_files, versions
from foreshock.campaign.sampling import points_of
from foreshock.campaign.spec import ArmEntry, CampaignSpec, FaultEntry, ScenarioEntry
from foreshock.errors import ConfigError, nearest
from foreshock.records import Intervention
from foreshock.registry import Registry
from foreshock.session.isolated import Job
from foreshock.session.run import Arm
from foreshock.session.scenario import VARIANT, Scenario, find_scenario, load_scenario, scenario_ids
from foreshock.session.scripted import acts_of, held, moved, protective

__all__ = ["Case", "Plan", "declared", "files_of", "plan_of", "runs_in", "under"]

SUPERVISOR: Mapping[str, Arm] = {"none": "off", "shadow": "shadow", "on": "on", "random": "off", "always": "off"}


class Case(msgspec.Struct, frozen=True):
    """One run to do.

    Attributes:
        key: hash of all that its result depends on.
        scenario: id.
        mode: the scenario's accident mode.
        point: number of the point among the scenario's.
        replicate: number of the seed at this point.
        seed: of the run.
        arm: id.
        parameters: values of the factors.
        fault: id of what is injected; empty for nothing.
        source: key of the run whose interventions it takes; empty for none.
    """

    key: str
    scenario: str
    mode: str
    point: int
    replicate: int
    seed: int
    arm: str
    parameters: dict[str, float]
    fault: str = ""
    source: str = ""


class Plan(msgspec.Struct, frozen=True):
    """All runs of a campaign, in the order in which they are begun.

    Attributes:
        spec: the campaign.
        scenarios: by id, with the campaign's changes but no arm's.
        identity: what results and their verdicts depend on: campaign, scenarios, and hashes of the twins' files, of
            files that configurations name, and of the code.
        cases: the runs.
        protective: by scenario and arm, for arms whose interventions others take, what their policies do at the mode's
            protective gate.
        folder: that the files of arms are relative to.
    """

    spec: CampaignSpec
    scenarios: dict[str, Scenario]
    identity: dict[str, Any]
    cases: tuple[Case, ...]
    protective: dict[tuple[str, str], tuple[Intervention, ...]] = {}
    folder: str = ""

    def scenario(self, case: Case) -> Scenario:
        """The scenario of a run, under its arm, with its values and faults."""
        arm = self.spec.arm(case.arm)
        scenario = under(self.scenarios[case.scenario], arm, Path(self.folder)).with_(case.parameters)
        return _with_faults(scenario, next((f for f in self.spec.faults if f.id == case.fault), None))

    def job(self, case: Case, changes: tuple[Intervention, ...] = ()) -> Job:
        """The run, given the interventions of the run that it takes them from.

        Where that one did not act, it takes what that one's policies do at the protective gate.
        """
        arm = self.spec.arm(case.arm)
        scenario = self.scenario(case)
        if arm.scripted and not acts_of(changes, case.mode):
            changes = self.protective[case.scenario, self.spec.source(arm).id]
        scripted: tuple[Intervention, ...] = ()
        if arm.kind == "random":
            scripted = moved(changes, scenario.duration_s, case.seed)
        elif arm.kind == "always":
            scripted = held(changes)
        return Job(scenario, SUPERVISOR[arm.kind], case.seed, detail=False, scripted=scripted)

    def simulated_s(self, cases: Iterable[Case]) -> float:
        """Simulated time of runs, at most."""
        return sum(self.scenarios[c.scenario].duration_s for c in cases)


def under(scenario: Scenario, arm: ArmEntry, folder: Path | None = None) -> Scenario:
    """A scenario with the configuration of an arm.

    Args:
        scenario: the scenario.
        arm: the arm.
        folder: that the arm's files are relative to; without one they keep their names, as in a run's key.
    """
    changed = scenario.with_(policy=arm.policy)
    config = arm.config if folder is None else beside(arm.config, folder)
    return msgspec.structs.replace(changed, config=merged(changed.config, _filled(config, scenario.mode)))


def _filled(value: Any, mode: str) -> Any:
    if isinstance(value, Mapping):
        return {k: _filled(v, mode) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [_filled(v, mode) for v in value]
    return mode if value == "{mode}" else value


def _with_faults(scenario: Scenario, entry: FaultEntry | None) -> Scenario:
    if entry is None:
        return scenario
    return msgspec.structs.replace(scenario, faults=(*scenario.faults, *entry.faults))


def runs_in(id_: str, patterns: Iterable[str]) -> bool:
    """Whether a scenario is among these ids and patterns."""
    return any(fnmatchcase(id_, pattern) for pattern in patterns)


def merged(base: Mapping[str, Any], change: Mapping[str, Any]) -> dict[str, Any]:
    """Tables merged key by key; anything else is replaced."""
    result = dict(base)
    for key, value in change.items():
        before = result.get(key)
        both = isinstance(value, Mapping) and isinstance(before, Mapping)
        result[key] = merged(before, value) if both and isinstance(before, Mapping) else value
    return result


def plan_of(spec: CampaignSpec, folder: Path, registry: Registry) -> Plan:
    """All runs of a campaign.

    Args:
        spec: the campaign.
        folder: that its paths start from.
        registry: where scenarios and plugins are found.

    Raises:
        BadInputError: a scenario, factor, arm or twin is wrong; what can be known before a run is.
    """
    entries = _scenarios(spec, folder, registry)
    scenarios = {s.id: s for s, _ in entries}
    plugins = _check_arms(spec, scenarios, registry)
    code = versions(plugins)
    files = {id_: twin_files(s, registry) for id_, s in scenarios.items()}
    folder = folder.absolute()
    named = files_of(spec, scenarios, folder)
    acts = {
        (s.id, source.id): protective(under(s, source, folder).supervisor(), s.mode, registry)
        for source in {a.id: spec.source(a) for a in spec.arms if a.scripted}.values()
        for s in scenarios.values()
        if runs_in(s.id, source.scenarios)
    }
    cases: list[Case] = []
    for scenario, replicates in entries:
        cases += _cases(spec, scenario, replicates, {"files": files[scenario.id], "code": code}, named, acts)
    if spec.budget.runs is not None and len(cases) > spec.budget.runs:
        raise ConfigError("budget.runs", f"{spec.budget.runs} runs, but the campaign has {len(cases)}")
    identity = {
        "campaign": declared(spec),
        # what a scenario expects changes no run, but what its runs count as
        "scenarios": {id_: _content(s) | {"expect": s.expect} for id_, s in scenarios.items()},
        "twins": files,
        "files": named,
        "code": code,
        "plugins": sorted(plugins),
    }
    # as it will be read from the ledger: lists, not tuples
    decoded = msgspec.json.decode(msgspec.json.encode(identity))
    return Plan(spec, scenarios, decoded, tuple(cases), acts, str(folder))


def declared(spec: CampaignSpec) -> dict[str, Any]:
    """What of a campaign results depend on, as it will be read from the ledger: lists, not tuples."""
    tables: dict[str, Any] = msgspec.json.decode(msgspec.json.encode(spec))
    return {k: v for k, v in tables.items() if k not in ("title", "metrics", "budget")}


def files_of(spec: CampaignSpec, scenarios: Mapping[str, Scenario], folder: Path) -> dict[str, dict[str, str]]:
    """Hashes of the files that the configurations of a campaign name, by scenario and arm; those without are left out.

    Args:
        spec: the campaign.
        scenarios: of it, by id.
        folder: that the files of arms are relative to; those of a scenario are relative to its own.
    """
    found = {
        f"{s.id}, {arm.id}": named_files(under(s, arm).config, Path(s.folder)) | named_files(arm.config, folder)
        for s in scenarios.values()
        for arm in spec.arms
        if arm.judged and runs_in(s.id, arm.scenarios)
    }
    return {place: files for place, files in found.items() if files}


def _content(scenario: Scenario) -> dict[str, Any]:
    """What of a scenario decides a run: its files count by content, not by place."""
    tables: dict[str, Any] = msgspec.to_builtins(scenario)
    return {k: v for k, v in tables.items() if k not in ("folder", "title", "severity", "expect", "safe", "seed")}


def _scenarios(spec: CampaignSpec, folder: Path, registry: Registry) -> list[tuple[Scenario, int]]:
    found: dict[str, tuple[Scenario, int]] = {}
    for entry in spec.scenarios:
        for scenario in _matching(entry, folder, registry):
            changed = scenario.with_(entry.parameters)
            if entry.duration_s is not None:
                changed = msgspec.structs.replace(changed, duration_s=entry.duration_s)
            if scenario.id in found:
                raise ConfigError("scenarios.use", f"{entry.use!r} gives {scenario.id!r} a second time")
            found[scenario.id] = (changed, entry.replicates or spec.replicates)
    entries = [(f"factors.{f.parameter}", f.scenarios) for f in spec.factors]
    entries += [(f"faults.{f.id}", f.scenarios) for f in spec.faults]
    entries += [(f"arms.{a.id}", a.scenarios) for a in spec.arms]
    for place, patterns in entries:
        for pattern in patterns:
            if not any(fnmatchcase(id_, pattern) for id_ in found):
                problem = f"{pattern!r} is none of the campaign's scenarios"
                raise ConfigError(f"{place}.scenarios", problem, nearest(pattern, found))
    for id_ in found:
        parameters = [f.parameter for f in spec.factors if runs_in(id_, f.scenarios)]
        for name in parameters:
            if parameters.count(name) > 1:
                problem = f"is given twice for scenario {id_!r}"
                raise ConfigError(f"factors.{name}", problem, "; make one of them, or limit their `scenarios`")
    return list(found.values())


def _matching(entry: ScenarioEntry, folder: Path, registry: Registry) -> list[Scenario]:
    if entry.use.endswith(".toml"):
        return [load_scenario(folder / entry.use)]
    if not any(c in entry.use for c in "*?["):
        return [find_scenario(entry.use, registry)]
    known = scenario_ids(registry, variants=VARIANT in entry.use)
    matching = [known[id_] for id_ in sorted(known) if fnmatchcase(id_, entry.use)]
    if not matching:
        raise ConfigError("scenarios.use", f"no scenario matches {entry.use!r}")
    return matching


def _check_arms(spec: CampaignSpec, scenarios: Mapping[str, Scenario], registry: Registry) -> set[str]:
    """Parse every configuration, and look every plugin up; their names."""
    plugins: set[str] = set()
    for scenario in scenarios.values():
        plugins.add(scenario.twin["kind"])
        for arm in spec.arms:
            if not arm.judged or not runs_in(scenario.id, arm.scenarios):
                continue
            place = f"{scenario.id}, arm {arm.id}"
            config = under(scenario, arm).supervisor()
            for detector in config.detectors:
                convert(detector.config, registry.detector(detector.use, f"{place}: detectors").config, place)
            for policy in config.policies:
                convert(policy.config, registry.policy(policy.use, f"{place}: policies").config, place)
            plugins |= {d.use for d in config.detectors} | {p.use for p in config.policies}
    return plugins


def _cases(
    spec: CampaignSpec,
    scenario: Scenario,
    replicates: int,
    identity: dict[str, Any],
    named: Mapping[str, Mapping[str, str]],
    acts: Mapping[tuple[str, str], Sequence[Intervention]],
) -> list[Case]:
    factors = [f for f in spec.factors if runs_in(scenario.id, f.scenarios)]
    faults = [None, *(f for f in spec.faults if runs_in(scenario.id, f.scenarios))]
    arms = sorted((a for a in spec.arms if runs_in(scenario.id, a.scenarios)), key=lambda a: a.scripted)
    cases = []
    for p, values in enumerate(points_of(spec, factors, scenario.id)):
        for r, fault in itertools.product(range(replicates), faults):
            # a grid compares its points on the same seeds; sampled points are independent, and so are their seeds
            seed = spec.seed + r + (0 if spec.sampler == "grid" else p * replicates)
            keys: dict[str, str] = {}
            for arm in arms:
                source = keys.get(spec.source(arm).id, "") if arm.scripted else ""
                if arm.scripted and not source:
                    continue
                parts = {
                    **identity,
                    "scenario": _content(_with_faults(under(scenario, arm).with_(values), fault)),
                    "arm": arm.kind,
                    "seed": seed,
                    "source": source,
                }
                if found := named.get(f"{scenario.id}, {arm.id}"):
                    parts["named"] = found
                if arm.scripted:
                    parts["acts"] = [(i.action, i.strength) for i in acts[scenario.id, spec.source(arm).id]]
                if not arm.judged:
                    parts["scenario"]["config"] = {"supervisor": scenario.config.get("supervisor")}
                fault_id = fault.id if fault is not None else ""
                keys[arm.id] = digest([arm.id, p, r, fault_id, parts])
                at = (keys[arm.id], scenario.id, scenario.mode, p, r, seed, arm.id, values, fault_id, source)
                cases.append(Case(*at))
    return cases
