"""``foreshock scenarios``."""

from __future__ import annotations

import click
import msgspec

from foreshock.cli._severity import severity_command
from foreshock.cli._verify import verify_command
from foreshock.cli.output import console, emit, left_out, table
from foreshock.registry import Registry
from foreshock.session.scenario import broken_scenarios, find_scenario, scenario_ids

__all__ = ["scenarios"]


@click.group()
def scenarios() -> None:
    """Declared situations to run."""


@scenarios.command("list")
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def list_(as_json: bool) -> None:
    """List the scenarios of the installed plugins."""
    registry = Registry()
    known = scenario_ids(registry, variants=True)
    left_out((*registry.load_all(), *broken_scenarios(registry)))
    if as_json:
        emit([{"id": s.id, "mode": s.mode, "expect": s.expect, "title": s.title} for s in known.values()])
        return
    rows = [(s.id, s.mode, s.expect, f"{s.duration_s:g} s", s.title) for s in known.values()]
    table("Scenarios", "id", "mode", "unsupervised", "time", "what", rows=rows)


@scenarios.command()
@click.argument("scenario")
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def show(scenario: str, as_json: bool) -> None:
    """Show one scenario: an id, or a TOML file."""
    found = find_scenario(scenario, Registry())
    if as_json:
        emit(found)
    else:
        console.print_json(msgspec.json.encode(found).decode())


scenarios.add_command(severity_command)
scenarios.add_command(verify_command)
