"""Configuration: TOML, strictly validated, with a generated JSON schema."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import msgspec

from foreshock._strict import convert, read_toml
from foreshock.detector import DetectorSpec, Isolation
from foreshock.errors import ConfigError
from foreshock.evidence import Window
from foreshock.policy import PolicySpec
from foreshock.risk import LogisticExponential
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
        if not self.period_s > 0.0:
            raise ConfigError("supervisor.period_s", f"{self.period_s!r} is not a positive time")


class DetectorEntry(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One detector to run.

    Attributes:
        use: id of the detector, which is the name of its plugin's entry point.
        isolation: where it runs; its own choice if not given.
        channels: channel per input name, where it differs from the detector's default.
        config: its settings.
    """

    use: str
    isolation: Isolation | None = None
    channels: dict[str, str] = {}
    config: dict[str, Any] = {}


class PolicyEntry(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One policy to run: its id and settings."""

    use: str
    config: dict[str, Any] = {}


class Config(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Everything that makes a supervisor, with defaults; ``detectors`` has none."""

    detectors: tuple[DetectorEntry, ...]
    supervisor: SupervisorSettings = SupervisorSettings()
    window: Window = Window()
    risk: LogisticExponential = LogisticExponential()
    trust: TrustSettings = TrustSettings()
    gates: Gates = Gates()
    policies: tuple[PolicyEntry, ...] = (PolicyEntry("ladder"),)


def parse_config(data: object, place: str) -> Config:
    """Tables as a configuration.

    Raises:
        ConfigError: names place, key path, value and nearest name of the first thing that is wrong.
    """
    config = convert(data, Config, place)
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
    schema = msgspec.json.schema(Config)
    schema["$schema"] = "https://json-schema.org/draft/2020-12/schema"
    for specs, entry in ((detectors, "DetectorEntry"), (policies, "PolicyEntry")):
        cases = []
        for spec in specs:
            own = msgspec.json.schema(spec.config)
            schema["$defs"].update(own.pop("$defs"))
            own_ref = {"config": own}
            cases.append({"if": {"properties": {"use": {"const": spec.id}}}, "then": {"properties": own_ref}})
        if cases:
            schema["$defs"][entry]["allOf"] = cases
    return schema
