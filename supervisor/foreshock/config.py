"""Configuration: TOML, strictly validated, with a generated JSON schema."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import msgspec

from foreshock._strict import convert, read_toml, within
from foreshock.detector import DetectorSpec, Isolation
from foreshock.errors import ConfigError
from foreshock.evidence import Window
from foreshock.policy import PolicySpec
from foreshock.risk import RiskSettings
from foreshock.trust import Gates, TrustSettings

__all__ = [
    "Config",
    "DetectorEntry",
    "PolicyEntry",
    "SupervisorSettings",
    "config_schema",
    "load_config",
    "parse_config",
]


class SupervisorSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The supervisor itself.

    Attributes:
        robot: first part of every channel.
        period_s: tick period.
        release_s: how long a released intervention ramps down.
        taxonomy: a TOML file with further precursor kinds, relative to the configuration; empty for none.
    """

    robot: str = "talos"
    period_s: float = 0.005
    release_s: float = 1.0
    taxonomy: str = ""

    def __post_init__(self) -> None:
        within("supervisor.period_s", self.period_s, 1e-6)
        within("supervisor.release_s", self.release_s, 0.0)
        if not self.robot or "/" in self.robot:
            raise ConfigError("supervisor.robot", f"{self.robot!r} cannot be the first part of a channel name")


class DetectorEntry(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One detector to run.

    Attributes:
        use: id of the detector, which is the name of its plugin's entry point.
        isolation: where it runs; its own choice if not given.
        channels: channel per input name, where it differs from the detector's default.
        config: its settings.
        standstill_s: longest standstill per input name (s), where it differs from the detector's default; 0 does not
            check, for a sensor that is ideal, or coarser than its noise.
    """

    use: str
    isolation: Isolation | None = None
    channels: dict[str, str] = {}
    config: dict[str, Any] = {}
    standstill_s: dict[str, float] = {}


class PolicyEntry(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One policy to run: its id and settings."""

    use: str
    config: dict[str, Any] = {}


class Config(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Everything that makes a supervisor, with defaults; ``detectors`` has none."""

    detectors: tuple[DetectorEntry, ...]
    supervisor: SupervisorSettings = SupervisorSettings()
    window: Window = Window()
    risk: RiskSettings = RiskSettings()
    trust: TrustSettings = TrustSettings()
    gates: Gates = Gates()
    policies: tuple[PolicyEntry, ...] = (PolicyEntry("ladder"),)


def parse_config(data: object, place: str) -> Config:
    """Tables as a configuration.

    Raises:
        ConfigError: names place, key path, value and nearest name of the first thing that is wrong.
    """
    config = convert(data, Config, place)
    if not config.detectors:
        raise ConfigError(f"{place}: detectors", "empty; a supervisor without detectors observes nothing")
    uses = [d.use for d in config.detectors]
    for use in uses:
        if uses.count(use) > 1:
            raise ConfigError(f"{place}: detectors", f"{use!r} is listed twice")
    return config


def load_config(path: Path) -> Config:
    """A configuration file."""
    return parse_config(read_toml(path), str(path))


def config_schema(detectors: Iterable[DetectorSpec] = (), policies: Iterable[PolicySpec] = ()) -> dict[str, Any]:
    """JSON schema (2020-12) of a configuration, with the settings of these detectors and policies."""
    groups: dict[type, tuple[DetectorSpec | PolicySpec, ...]] = {
        DetectorEntry: tuple(detectors),
        PolicyEntry: tuple(policies),
    }
    settings = {spec.config for specs in groups.values() for spec in specs}
    types = [Config, *groups, *sorted(settings, key=lambda t: (t.__module__, t.__qualname__))]
    # all at once: two plugins may give their settings the same name, or one that is taken here
    refs, components = msgspec.json.schema_components(types, ref_template="#/$defs/{name}")
    ref_of = dict(zip(types, refs, strict=True))
    name_of = {t: ref["$ref"].removeprefix("#/$defs/") for t, ref in ref_of.items()}
    components[name_of[Config]]["properties"]["detectors"]["minItems"] = 1
    for entry, specs in groups.items():
        cases = [
            {"if": {"properties": {"use": {"const": s.id}}}, "then": {"properties": {"config": ref_of[s.config]}}}
            for s in specs
        ]
        if cases:
            components[name_of[entry]]["allOf"] = cases
    return {**ref_of[Config], "$defs": components, "$schema": "https://json-schema.org/draft/2020-12/schema"}
