"""A run's file: a supervisor's configuration with the tables [link], [live] and [journal]; [topics] is for bags."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import msgspec

from foreshock._strict import convert, read_toml
from foreshock.config import Config, parse_config
from foreshock.link import LinkSettings
from foreshock.live._settings import JournalSettings, LiveSettings

__all__ = ["RunConfig", "load_run", "parse_run"]

TABLES: dict[str, type] = {"link": LinkSettings, "live": LiveSettings, "journal": JournalSettings}


class RunConfig(msgspec.Struct, frozen=True):
    """Everything that makes a live supervisor; tables is the supervisor's part as it was read."""

    config: Config
    tables: dict[str, Any]
    link: LinkSettings = LinkSettings()
    live: LiveSettings = LiveSettings()
    journal: JournalSettings = JournalSettings()


def parse_run(data: dict[str, Any], place: str) -> RunConfig:
    """Tables as a run's configuration.

    Raises:
        ConfigError: names place, key path, value and nearest name of the first thing that is wrong.
    """
    mine: dict[str, Any] = {
        name: convert(data[name], cls, f"{place}: {name}") for name, cls in TABLES.items() if name in data
    }
    tables = {name: value for name, value in data.items() if name not in TABLES and name != "topics"}
    return RunConfig(parse_config(tables, place), tables, **mine)


def load_run(path: Path) -> RunConfig:
    """A run's file."""
    return parse_run(read_toml(path), str(path))
