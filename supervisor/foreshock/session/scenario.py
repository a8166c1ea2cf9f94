"""Scenarios: which twin, with which parameters, under which supervisor, and what is expected unsupervised."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Literal

import msgspec

from foreshock._strict import convert, read_toml
from foreshock.config import Config, parse_config
from foreshock.errors import ConfigError, nearest
from foreshock.registry import Registry

__all__ = ["Scenario", "find_scenario", "load_scenario", "scenario_ids"]


class Scenario(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One declared situation.

    Attributes:
        id: e.g. ``a1-fall-onto-human``.
        title: one line for people.
        mode: accident mode that it is about.
        expect: what happens when unsupervised: ``accident``, ``none`` or ``open``.
        duration_s: simulated time.
        twin: kind of twin (``kind``) and its settings.
        config: the supervisor's configuration, inline.
        parameters: values of the twin's parameters, where they differ from its defaults.
        folder: where the file lies; relative paths start there.
    """

    id: str
    title: str
    mode: str
    expect: Literal["accident", "none", "open"]
    duration_s: float
    twin: dict[str, Any]
    config: dict[str, Any]
    parameters: dict[str, float] = {}
    folder: str = ""

    def __post_init__(self) -> None:
        if not self.duration_s > 0.0:
            raise ConfigError(f"{self.id}: duration_s", f"{self.duration_s!r} is not a positive time")
        if not isinstance(self.twin.get("kind"), str):
            raise ConfigError(f"{self.id}: twin.kind", "missing; it names a kind of twin, e.g. 'fmu'")

    def supervisor(self) -> Config:
        """The supervisor's configuration, checked."""
        return parse_config(self.config, f"{self.id}: config")

    def with_(self, parameters: Mapping[str, float] | None = None, policy: str | None = None) -> Scenario:
        """This scenario with other parameter values or another policy."""
        config = dict(self.config)
        if policy is not None:
            config["policies"] = [{"use": policy}]
        return msgspec.structs.replace(self, config=config, parameters={**self.parameters, **(parameters or {})})


def load_scenario(path: Path) -> Scenario:
    """A scenario file.

    Raises:
        ConfigError: it is missing or does not hold what it must.
    """
    data = read_toml(path)
    data.setdefault("folder", str(path.parent.resolve()))
    return convert(data, Scenario, str(path))


def _by_id(paths: Iterable[Path]) -> dict[str, Scenario]:
    found: dict[str, Scenario] = {}
    for path in paths:
        scenario = load_scenario(path)
        if scenario.id in found:
            raise ConfigError(str(path), f"scenario id {scenario.id!r} is taken by {found[scenario.id].folder}")
        found[scenario.id] = scenario
    return found


def scenario_ids(registry: Registry) -> dict[str, Scenario]:
    """All scenarios of the installed plugins, by id."""
    registry.load_all()
    return dict(sorted(_by_id(registry.scenarios()).items()))


def find_scenario(name: str, registry: Registry) -> Scenario:
    """The scenario with this id, or in this TOML file.

    Raises:
        ConfigError: there is none; the nearest ids are named.
    """
    if name.endswith(".toml"):
        return load_scenario(Path(name))
    known = scenario_ids(registry)
    if name not in known:
        raise ConfigError("scenario", f"no scenario {name!r}", nearest(name, known))
    return known[name]
