"""``foreshock detectors``: what is installed, whether it keeps the contract, and a project to write one."""

from __future__ import annotations

from pathlib import Path

import click
from rich.markup import escape

from foreshock.cli._installed import Extra, distribution_of, extra_of, installed
from foreshock.cli._new_plugin import write_project
from foreshock.cli.output import NEGATIVE, OK, console, emit, table
from foreshock.errors import ForeshockError
from foreshock.registry import Registry
from foreshock.taxonomy import builtin_taxonomy
from foreshock.testing.spec_checks import Check, spec_checks

__all__ = ["detectors"]


@click.group()
def detectors() -> None:
    """Detector plugins: list them, check one, start one."""


@detectors.command("list")
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def list_(as_json: bool) -> None:
    """List the installed detectors: kinds, inputs, isolation, what is missing, and plugins that cannot be loaded."""
    found, broken = installed()
    if as_json:
        emit({"detectors": found, "broken": broken})
        return
    rows = [
        (
            f"{d.id}\n{d.distribution}\n{d.isolation}\n{_packages(d.extra)}",
            "\n".join(d.kinds),
            "\n".join(f"{i.channel} {i.type}" + ("" if i.required else "?") for i in d.inputs),
        )
        for d in found
    ]
    table("Detectors (? marks an optional input)", "detector", "kinds", "inputs below <robot>/", rows=rows)
    for b in broken:
        console.print(f"[red]broken:[/] {escape(b.reason)}", soft_wrap=True)


def _packages(extra: Extra) -> str:
    if extra.installed:
        return "packages installed"
    return f"lacks {', '.join(extra.missing)}\nrun: {extra.command}"


@detectors.command()
@click.argument("name")
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def check(name: str, as_json: bool) -> int:
    """Check one detector as far as that goes without data: its plugin, its declaration, its settings, its build.

    The rest is checked by foreshock.testing.DetectorConformance in the plugin's own tests.
    """
    registry = Registry()
    if name not in registry.names:
        registry.detector(name, "detectors check")  # raises, with the nearest detector
    checks = _checks(name, registry)
    ok = all(c.ok for c in checks)
    if as_json:
        said = [{"name": c.name, "ok": c.ok, "problem": c.problem} for c in checks]
        emit({"detector": name, "distribution": distribution_of(name), "ok": ok, "checks": said})
    else:
        for c in checks:
            mark = "[green]ok[/]    " if c.ok else "[red]failed[/]"
            console.print(f"{mark} {escape(c.name)}" + (f": {escape(c.problem)}" if c.problem else ""), soft_wrap=True)
    return OK if ok else NEGATIVE


def _checks(name: str, registry: Registry) -> tuple[Check, ...]:
    """Loading, then the static checks; what cannot be checked because something before it failed is left out."""
    try:
        registry.load(name)
        spec = registry.detector(name, "detectors check")
        precursors = registry.precursors()
    except ForeshockError as e:
        return (Check("plugin loads and offers the detector", str(e)),)
    extra = extra_of(spec)
    missing = "" if extra.installed else f"not installed: {', '.join(extra.missing)}; run: {extra.command}"
    return (
        Check("plugin loads and offers the detector"),
        Check("packages that it needs are installed", missing),
        *spec_checks(spec, precursors),
    )


@detectors.command()
@click.argument("name")
@click.option("--kind", help="Precursor kind of the taxonomy that it reports; without it the plugin adds its own.")
@click.option(
    "--dir", "folder", type=click.Path(path_type=Path, file_okay=False), help="Folder to write; ./foreshock-NAME."
)
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def new(name: str, kind: str | None, folder: Path | None, as_json: bool) -> None:
    """Write a working plugin project for a detector NAME (kebab-case): package, settings, test, README."""
    registry = Registry()
    registry.load_all()
    known = builtin_taxonomy()
    if kind is not None:
        try:
            known = known.extended(registry.precursors())
        except ForeshockError:  # a broken plugin must not keep anybody from writing another
            known = builtin_taxonomy()
        kind = known.kind(kind, "--kind").id
    target = Path(f"foreshock-{name}") if folder is None else folder
    files = write_project(name, kind, target, registry.names)
    if as_json:
        emit({"name": name, "folder": str(target), "files": [str(f) for f in files]})
        return
    for file in files:
        console.print(escape(str(file)))
    console.print(f"next: pip install -e {escape(str(target))} && foreshock detectors check {name}", soft_wrap=True)
