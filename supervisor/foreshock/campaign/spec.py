"""What a campaign is: a TOML file of scenarios, factors, arms, metrics, replicates, seed and budget, strictly read."""

from __future__ import annotations

import math
import re
from importlib.resources import files
from pathlib import Path
from typing import Any, Literal, TypeAlias, get_args

import msgspec

from foreshock._strict import convert, read_toml, within
from foreshock.errors import ConfigError, nearest
from foreshock.session.faults import Fault

__all__ = [
    "ArmEntry",
    "Budget",
    "CampaignSpec",
    "Factor",
    "FaultEntry",
    "Metric",
    "ScenarioEntry",
    "campaign_schema",
    "load_campaign",
    "parse_campaign",
    "shipped",
]

ArmKind: TypeAlias = Literal["none", "shadow", "on", "random", "always"]
Sampler: TypeAlias = Literal["grid", "monte-carlo", "latin-hypercube", "sobol"]
Metric: TypeAlias = Literal[
    "accidents",
    "difference",
    "prevented",
    "lead-time",
    "safe-state",
    "false-interventions",
    "reduced-speed",
    "brier",
    "discrimination",
    "failures",
]
METRICS: tuple[Metric, ...] = get_args(Metric)
PAIRED = frozenset({"difference", "prevented", "lead-time", "false-interventions", "reduced-speed"})
"""Metrics that hold a run against the reference arm's of the same seed."""
_NAME = re.compile(r"[a-z0-9]+(-[a-z0-9]+)*", re.ASCII)


class ScenarioEntry(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Scenarios to run.

    Attributes:
        use: a scenario's id, a pattern of ids such as ``a1-*``, or a scenario file (``.toml``), relative to this one.
        parameters: values that differ from the scenario's own.
        duration_s: simulated time, where it differs from the scenario's own.
        replicates: seeds per point, where it differs from the campaign's.
    """

    use: str
    parameters: dict[str, float] = {}
    duration_s: float | None = None
    replicates: int | None = None

    def __post_init__(self) -> None:
        if self.duration_s is not None:
            within("scenarios.duration_s", self.duration_s, 0.0, above=True)
        if self.replicates is not None:
            within("scenarios.replicates", self.replicates, 1)


class Factor(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A parameter that is varied: one of values, uniform, log_uniform and normal.

    Attributes:
        parameter: name of the twin's parameter.
        scenarios: ids or patterns of the scenarios that have it; by default all.
        values: these, all as likely; a grid takes each of them, and refuses one that is there twice.
        uniform: low and high.
        log_uniform: low and high, above 0; its logarithm is uniform.
        normal: mean and standard deviation.
        levels: of a distribution, how many values a grid takes: the middles of so many equally likely parts.
    """

    parameter: str
    scenarios: tuple[str, ...] = ("*",)
    values: tuple[float, ...] | None = None
    uniform: tuple[float, float] | None = None
    log_uniform: tuple[float, float] | None = None
    normal: tuple[float, float] | None = None
    levels: int = 5

    def __post_init__(self) -> None:
        place = f"factors.{self.parameter}"
        given = [v for v in (self.values, self.uniform, self.log_uniform, self.normal) if v is not None]
        if len(given) != 1:
            raise ConfigError(place, f"{len(given)} of values, uniform, log_uniform and normal are given; expected one")
        if not given[0] or not all(math.isfinite(v) for v in given[0]):
            raise ConfigError(place, f"{list(given[0])!r} are not finite numbers")
        for name, span in (("uniform", self.uniform), ("log_uniform", self.log_uniform)):
            if span is not None and not span[0] < span[1]:
                raise ConfigError(f"{place}.{name}", f"low {span[0]!r} is not below high {span[1]!r}")
        if self.log_uniform is not None:
            within(f"{place}.log_uniform", self.log_uniform[0], 0.0, above=True)
        if self.normal is not None:
            within(f"{place}.normal", self.normal[1], 0.0, above=True)
        within(f"{place}.levels", self.levels, 1)


class ArmEntry(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What is compared; every arm runs on the same seeds.

    Attributes:
        id: kebab-case.
        kind: ``none`` (no supervisor), ``shadow`` (judges, does not act), ``on``, or the interventions of another arm's
            run of the same seed without a supervisor: all moved to a ``random`` time, or ``always`` held; where that
            run did not act, what its policies do at the mode's protective gate.
        title: for people.
        policy: replaces the scenario's policies.
        config: tables that are merged into the scenario's configuration, key by key; lists replace lists. The text
            ``{mode}`` stands for the code of the scenario's mode.
        scenarios: ids or patterns of the scenarios that it runs in; by default all.
        of: for random and always: id of the arm whose interventions they are; the first that is on by default.
        acts_by: what counts as an intervention: reaching the protective ``level``, or any ``action`` of the scenario's
            mode, for policies that do not follow levels.
    """

    id: str
    kind: ArmKind
    title: str = ""
    policy: str | None = None
    config: dict[str, Any] = {}
    scenarios: tuple[str, ...] = ("*",)
    of: str = ""
    acts_by: Literal["level", "action"] = "level"

    @property
    def scripted(self) -> bool:
        """Whether its interventions are those of another arm."""
        return self.kind in ("random", "always")

    @property
    def judged(self) -> bool:
        """Whether a supervisor runs."""
        return self.kind in ("shadow", "on")

    @property
    def acts(self) -> bool:
        """Whether anything is done to the plant."""
        return self.kind == "on" or self.scripted

    @property
    def foreshock(self) -> bool:
        """Whether it stands for Foreshock: it acts, and by protection levels, which its model of risk gives."""
        return self.kind == "on" and self.acts_by == "level"

    def __post_init__(self) -> None:
        place = f"arms.{self.id}"
        if not _NAME.fullmatch(self.id):
            raise ConfigError("arms.id", f"{self.id!r} is not kebab-case")
        if not self.judged and (self.policy is not None or self.config):
            raise ConfigError(place, f"policy and config have no meaning for an arm of kind {self.kind!r}")
        if self.of and not self.scripted:
            raise ConfigError(f"{place}.of", f"has no meaning for an arm of kind {self.kind!r}")


class FaultEntry(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Faults that are injected together; every point runs without any and with each entry.

    Attributes:
        id: kebab-case.
        faults: as in a scenario, whose own stay.
        scenarios: ids or patterns of the scenarios that have them; by default all.
    """

    id: str
    faults: tuple[Fault, ...]
    scenarios: tuple[str, ...] = ("*",)

    def __post_init__(self) -> None:
        if not _NAME.fullmatch(self.id):
            raise ConfigError("faults.id", f"{self.id!r} is not kebab-case")
        if not self.faults:
            raise ConfigError(f"faults.{self.id}.faults", "is empty")


class Budget(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What it may cost at most.

    Attributes:
        runs: a campaign of more runs is refused.
        hours: of wall time for one call of ``run`` or ``resume``; then it ends early, and can be resumed.
    """

    runs: int | None = None
    hours: float | None = None

    def __post_init__(self) -> None:
        if self.runs is not None:
            within("budget.runs", self.runs, 1)
        if self.hours is not None:
            within("budget.hours", self.hours, 0.0, above=True)


class CampaignSpec(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A campaign.

    Attributes:
        id: kebab-case.
        scenarios: what is run.
        arms: what is compared.
        title: one line for people.
        factors: what is varied; without any, each scenario has one point.
        faults: what is injected, beside runs without.
        sampler: how points are chosen.
        points: how many of them for each scenario; a grid has as many as it has. Sobol wants a power of two.
        replicates: seeds per point.
        seed: seeds count from here; it is the sampler's seed as well.
        reference: id of the arm that the others are paired with; by default the first of kind none or shadow.
        metrics: what is reported.
        timeout_s: wall-clock limit of one run; by default 60 s and ten times the simulated time.
        budget: what it may cost.
    """

    id: str
    scenarios: tuple[ScenarioEntry, ...]
    arms: tuple[ArmEntry, ...]
    title: str = ""
    factors: tuple[Factor, ...] = ()
    faults: tuple[FaultEntry, ...] = ()
    sampler: Sampler = "grid"
    points: int | None = None
    replicates: int = 1
    seed: int = 0
    reference: str = ""
    metrics: tuple[Metric, ...] = METRICS
    timeout_s: float | None = None
    budget: Budget = Budget()

    def __post_init__(self) -> None:
        if not _NAME.fullmatch(self.id):
            raise ConfigError("id", f"{self.id!r} is not kebab-case")
        for name in ("scenarios", "arms"):
            if not getattr(self, name):
                raise ConfigError(name, "is empty")
        within("replicates", self.replicates, 1)
        within("seed", self.seed, 0)
        if self.timeout_s is not None:
            within("timeout_s", self.timeout_s, 0.0, above=True)
        self._check_points()
        self._check_arms()

    def _check_points(self) -> None:
        if self.sampler == "grid":
            if self.points is not None:
                raise ConfigError("points", "has no meaning for a grid", "; factors have values, or levels")
            for factor in self.factors:  # points of a grid share their seeds: it would be the same run twice
                for value in factor.values or ():
                    if (factor.values or ()).count(value) > 1:
                        problem = f"{value!r} is given twice"
                        raise ConfigError(f"factors.{factor.parameter}.values", problem, "; replicates are more seeds")
            return
        if not self.factors:
            raise ConfigError("factors", f"is empty: sampler {self.sampler!r} has nothing to sample")
        if self.points is None:
            raise ConfigError("points", f"missing; sampler {self.sampler!r} needs it")
        within("points", self.points, 1)
        if self.sampler == "sobol" and self.points & (self.points - 1):
            raise ConfigError("points", f"{self.points} is no power of two", "; Sobol points are balanced only then")

    def _check_arms(self) -> None:
        ids = [arm.id for arm in self.arms]
        for name, given in (("arms", ids), ("faults", [f.id for f in self.faults])):
            for id_ in given:
                if given.count(id_) > 1:
                    raise ConfigError(name, f"id {id_!r} is given twice")
        if self.reference and self.reference not in ids:
            raise ConfigError("reference", f"there is no arm {self.reference!r}", nearest(self.reference, ids))
        for arm in self.arms:
            if arm.scripted:
                self.source(arm)

    @property
    def reference_arm(self) -> ArmEntry | None:
        """The arm that the others are paired with; None if there is none."""
        for arm in self.arms:
            if arm.id == self.reference or (not self.reference and arm.kind in ("none", "shadow")):
                return arm
        return None

    @property
    def unpaired(self) -> tuple[Metric, ...]:
        """Metrics that it asks for and cannot have, since there is no reference arm."""
        return () if self.reference_arm is not None else tuple(m for m in self.metrics if m in PAIRED)

    def arm(self, id_: str) -> ArmEntry:
        """The arm with this id."""
        return next(arm for arm in self.arms if arm.id == id_)

    def source(self, arm: ArmEntry) -> ArmEntry:
        """The arm whose interventions a scripted arm takes."""
        on = {a.id: a for a in self.arms if a.kind == "on"}
        if arm.of and arm.of not in on:
            raise ConfigError(f"arms.{arm.id}.of", f"{arm.of!r} is no arm of kind 'on'", nearest(arm.of, on))
        if not on:
            raise ConfigError(f"arms.{arm.id}", "takes the interventions of an arm of kind 'on', and there is none")
        return on[arm.of] if arm.of else next(iter(on.values()))


def parse_campaign(data: object, place: str) -> CampaignSpec:
    """Tables as a campaign.

    Raises:
        ConfigError: names place, key path, value and nearest name of the first thing that is wrong.
    """
    return convert(data, CampaignSpec, place)


def shipped() -> dict[str, Path]:
    """Files of the campaigns that come with Foreshock, by id."""
    folder = Path(str(files("foreshock").joinpath("data/campaigns")))
    return {path.stem: path for path in sorted(folder.glob("*.toml"))}


def load_campaign(name: str) -> tuple[CampaignSpec, Path]:
    """A campaign file, or one that comes with Foreshock by its id; and the folder that its paths start from.

    Raises:
        ConfigError: there is none, or it does not hold what it must.
    """
    if name.endswith(".toml"):
        path = Path(name)
    elif name in shipped():
        path = shipped()[name]
    else:
        raise ConfigError("campaign", f"no campaign {name!r}", nearest(name, shipped()) or "; expected a .toml file")
    return parse_campaign(read_toml(path), str(path)), path.parent.resolve()


def campaign_schema() -> dict[str, Any]:
    """JSON schema (2020-12) of a campaign file."""
    refs, components = msgspec.json.schema_components([CampaignSpec], ref_template="#/$defs/{name}")
    return {**refs[0], "$defs": components, "$schema": "https://json-schema.org/draft/2020-12/schema"}
