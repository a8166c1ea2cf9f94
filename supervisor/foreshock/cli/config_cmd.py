"""``foreshock config``."""

from __future__ import annotations

from pathlib import Path

import click
import msgspec

from foreshock.cli.output import console, emit, left_out, warn
from foreshock.config import config_schema
from foreshock.live import load_run
from foreshock.registry import Registry
from foreshock.session.simulate import warnings_of
from foreshock.supervisor import Supervisor

__all__ = ["config"]


@click.group()
def config() -> None:
    """Configuration files."""


@config.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def check(file: Path, as_json: bool) -> None:
    """Check a configuration or a run's file: every key, every plugin, every detector's settings."""
    supervisor = Supervisor(load_run(file).config, file.parent)
    ids = [spec.id for spec in supervisor.detectors]
    supervisor.close()
    warnings = warnings_of(supervisor)
    if as_json:
        emit({"file": str(file), "detectors": ids, "config": supervisor.config, "warnings": warnings})
    else:
        warn(warnings)
        console.print(f"[green]ok[/] {file}: {len(ids)} detectors ({', '.join(ids)})", soft_wrap=True)


@config.command()
def schema() -> None:
    """Print the JSON schema of a configuration, with the settings of all installed plugins."""
    registry = Registry()
    left_out(registry.load_all())
    generated = config_schema(registry.detectors(), registry.policies())
    click.echo(msgspec.json.format(msgspec.json.encode(generated, order="sorted"), indent=2).decode())
