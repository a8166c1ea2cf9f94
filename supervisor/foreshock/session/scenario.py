"""Scenarios: which twin, with which parameters, under which supervisor, and what is expected unsupervised."""

from __future__ import annotations

import math
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

import msgspec
import numpy as np

from foreshock._strict import convert, read_toml, within
from foreshock.config import Config, parse_config
from foreshock.errors import ConfigError, ForeshockError, nearest
from foreshock.registry import Broken, Registry
from foreshock.session.faults import Fault
from foreshock.taxonomy import builtin_taxonomy

__all__ = [
    "VARIANT",
    "Distribution",
    "Scenario",
    "Severity",
    "broken_scenarios",
    "find_scenario",
    "load_scenario",
    "scenario_ids",
]


VARIANT = "@"
"""Between the id of a scenario and the kind of twin that a variant of it runs on."""


class Distribution(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What a parameter is drawn from: one of uniform, normal and choice.

    Attributes:
        uniform: low and high.
        normal: mean and standard deviation; a draw beyond three of them is cut off there.
        choice: the values, all as likely.
    """

    uniform: tuple[float, float] | None = None
    normal: tuple[float, float] | None = None
    choice: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        given = [v for v in (self.uniform, self.normal, self.choice) if v is not None]
        if len(given) != 1:
            raise ConfigError("distributions", f"{len(given)} of uniform, normal and choice are given; expected one")
        values = given[0]
        if not values or not all(math.isfinite(v) for v in values):
            raise ConfigError("distributions", f"{list(values)!r} are not finite numbers")
        if self.uniform is not None and not self.uniform[0] <= self.uniform[1]:
            raise ConfigError("distributions.uniform", f"low {self.uniform[0]!r} is above high {self.uniform[1]!r}")
        if self.normal is not None and self.normal[1] < 0.0:
            raise ConfigError("distributions.normal", f"the standard deviation {self.normal[1]!r} is below 0")

    def draw(self, rng: np.random.Generator) -> float:
        """A value."""
        if self.uniform is not None:
            return float(rng.uniform(*self.uniform))
        if self.normal is not None:
            mean, sd = self.normal
            return mean + sd * float(np.clip(rng.standard_normal(), -3.0, 3.0))
        return float(rng.choice(self.choice or (0.0,)))


class Severity(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """How severe the cause is: the parameter that says so, and values from what needs no action to what none saves."""

    parameter: str
    values: tuple[float, ...]


def _stream(seed: int, name: str) -> np.random.Generator:
    return np.random.default_rng([0x73, seed, zlib.crc32(name.encode())])


class Scenario(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One declared situation.

    Attributes:
        id: e.g. ``a1-fall-onto-human``; ``a1-fall-onto-human@mujoco`` is its variant on a twin of kind ``mujoco``.
        title: one line for people.
        mode: code of the accident mode that it is about.
        expect: what happens when unsupervised: ``accident``, ``none`` or ``open``.
        duration_s: simulated time, finite and above 0.
        twin: kind of twin (``kind``) and its settings.
        config: the supervisor's configuration, inline.
        parameters: values of the twin's parameters, where they differ from its defaults; finite.
        distributions: parameters that each seed draws anew.
        severity: the parameter to sweep, and its values; None if none was chosen.
        accidents: ids of the plant's events that count as its accident, beside those that the plant gives to the mode.
        folder: where the file lies; relative paths start there.
        faults: of sensors, messages, actuators and detectors.
        safe: what must hold, as a formula of signal temporal logic over the twin's probes, whose robustness leads
            falsification; what an accident is, the referee says.
        seed: of a simulation that names none.
    """

    id: str
    title: str
    mode: str
    expect: Literal["accident", "none", "open"]
    duration_s: float
    twin: dict[str, Any]
    config: dict[str, Any]
    parameters: dict[str, float] = {}
    distributions: dict[str, Distribution] = {}
    severity: Severity | None = None
    accidents: tuple[str, ...] = ()
    folder: str = ""
    faults: tuple[Fault, ...] = ()
    safe: str = ""
    seed: int = 0

    def __post_init__(self) -> None:
        within(f"{self.id}: duration_s", self.duration_s, 0.0, above=True)
        within(f"{self.id}: seed", self.seed, 0)
        codes = builtin_taxonomy().codes
        if self.mode not in codes:
            hint = nearest(self.mode, codes)
            raise ConfigError(f"{self.id}: mode", f"{self.mode!r} is not the code of an accident mode", hint)
        for name, value in self.parameters.items():
            if not math.isfinite(value):
                raise ConfigError(f"{self.id}: parameters.{name}", f"{value!r} is not a finite number")
        if both := sorted(self.parameters.keys() & self.distributions.keys()):
            raise ConfigError(f"{self.id}: distributions.{both[0]}", "has a fixed value under parameters as well")
        kind = self.twin.get("kind")
        if not isinstance(kind, str):
            raise ConfigError(f"{self.id}: twin.kind", "missing; it names a kind of twin, e.g. 'fmu'")
        if VARIANT in self.id and self.id.partition(VARIANT)[2] != kind:
            raise ConfigError("id", f"{self.id!r} names another twin than twin.kind = {kind!r}")

    def supervisor(self) -> Config:
        """The supervisor's configuration, checked."""
        return parse_config(self.config, f"{self.id}: config")

    def with_(
        self,
        parameters: Mapping[str, float] | None = None,
        policy: str | None = None,
        config: Mapping[str, Any] | None = None,
    ) -> Scenario:
        """This scenario with other parameter values, another policy, or other tables of the configuration."""
        tables = {**self.config, **(config or {})}
        if policy is not None:
            tables["policies"] = [{"use": policy}]
        given = parameters or {}
        return msgspec.structs.replace(
            self,
            config=tables,
            parameters={**self.parameters, **given},
            distributions={k: d for k, d in self.distributions.items() if k not in given},
        )

    def drawn(self, seed: int) -> dict[str, float]:
        """The parameter values of this seed: fixed ones, and a draw from each distribution.

        Each parameter has a stream of its own, so that one more distribution leaves the other draws as they are.
        """
        drawn = {name: d.draw(_stream(seed, name)) for name, d in self.distributions.items()}
        return {**self.parameters, **drawn}


def load_scenario(path: Path) -> Scenario:
    """A scenario file.

    Raises:
        ConfigError: it is missing or does not hold what it must.
    """
    data = read_toml(path)
    data.setdefault("folder", str(path.parent.resolve()))
    return convert(data, Scenario, str(path))


def scenario_ids(registry: Registry, *, variants: bool = False) -> dict[str, Scenario]:
    """All scenarios of the installed plugins that can be read, by id; variants on other twins only if asked for."""
    return {id_: s for id_, s in _sifted(registry)[0].items() if variants or VARIANT not in id_}


def broken_scenarios(registry: Registry) -> tuple[Broken, ...]:
    """Plugins and what is wrong with a scenario file of theirs, or with their list of files; one entry for each."""
    return _sifted(registry)[1]


def find_scenario(name: str, registry: Registry, twin: str = "") -> Scenario:
    """The scenario with this id, or in this TOML file; its variant on this kind of twin, if there is one.

    Raises:
        ConfigError: there is none; the nearest ids are named, and all that could not be read: it may be among them.
    """
    if name.endswith(".toml"):
        return load_scenario(Path(name))
    known, broken = _sifted(registry)
    if twin and f"{name}{VARIANT}{twin}" in known:
        return known[f"{name}{VARIANT}{twin}"]
    if name not in known:
        left_out = "".join(f"\nplugin {b.name} is left out: {b.reason}" for b in (*registry.load_all(), *broken))
        raise ConfigError("scenario", f"no scenario {name!r}", nearest(name, known) + left_out)
    return known[name]


def _sifted(registry: Registry) -> tuple[dict[str, Scenario], tuple[Broken, ...]]:
    """The scenarios by id, and what is left out.

    An id that two files claim is left out as well: whichever ran, it might not be the one that was meant.
    """
    registry.load_all()
    files, failed = registry.scenario_files()
    broken = list(failed)
    found: dict[str, dict[Path, tuple[str, Scenario]]] = {}
    for plugin, path in files:
        try:
            scenario = load_scenario(path)
        except (ForeshockError, OSError, ValueError) as e:  # a path may hold what the file system refuses
            broken.append(Broken(plugin, str(e)))
        else:
            # A plugin with several names gives one file several times.
            found.setdefault(scenario.id, {}).setdefault(path.resolve(), (plugin, scenario))
    known: dict[str, Scenario] = {}
    for id_, claims in sorted(found.items()):
        if len(claims) == 1:
            known[id_] = next(iter(claims.values()))[1]
            continue
        where = " and ".join(f"{path} of plugin {plugin}" for path, (plugin, _) in claims.items())
        broken += [
            Broken(p, f"scenario id {id_!r} is claimed by {where}") for p in sorted({p for p, _ in claims.values()})
        ]
    return known, tuple(broken)
