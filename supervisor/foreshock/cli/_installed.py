"""What is installed: detectors with the distribution they come from and the packages they need, and broken plugins."""

from __future__ import annotations

import importlib.metadata as md
import re

import msgspec

from foreshock.detector import DetectorSpec, Isolation
from foreshock.errors import ForeshockError
from foreshock.hookspecs import GROUP
from foreshock.registry import Broken, Registry
from foreshock.supervisor import inputs_of

__all__ = ["DetectorInfo", "Extra", "InputInfo", "distribution_of", "extra_of", "installed"]


class InputInfo(msgspec.Struct, frozen=True):
    """An input with default settings: its name, channel below the robot's, message type, whether it is required."""

    name: str
    channel: str
    type: str
    required: bool


class Extra(msgspec.Struct, frozen=True):
    """The packages behind ``spec.extra``.

    Attributes:
        name: the extra of foreshock, or a distribution; empty for none.
        installed: whether all of them are.
        missing: distributions that are not.
        command: what installs them; empty if nothing is missing.
    """

    name: str
    installed: bool
    missing: tuple[str, ...] = ()
    command: str = ""


class DetectorInfo(msgspec.Struct, frozen=True):
    """One line of ``foreshock detectors list``."""

    id: str
    summary: str
    kinds: tuple[str, ...]
    inputs: tuple[InputInfo, ...]
    isolation: Isolation
    extra: Extra
    plugin: str
    distribution: str


def installed() -> tuple[tuple[DetectorInfo, ...], tuple[Broken, ...]]:
    """All detectors by id, and the plugins that are broken; one broken plugin hides no other."""
    found: dict[str, DetectorInfo] = {}
    broken: list[Broken] = []
    modules = {e.name: e.value for e in md.entry_points(group=GROUP)}
    for name in sorted(modules):
        registry = Registry()
        try:
            registry.load(name)
            for spec in registry.detectors():
                if spec.id == name:
                    found[name] = _info(spec, name)
                elif spec.id not in modules:
                    broken.append(Broken(name, f"plugin {name}: {spec.id!r} needs an entry point of that name"))
                elif modules[spec.id] != modules[name]:
                    broken.append(Broken(name, f"plugin {name}: id {spec.id!r} is that of another plugin"))
        except ForeshockError as e:
            broken.append(Broken(name, str(e)))
        except Exception as e:  # noqa: BLE001 # a spec's own function of its inputs may raise anything
            broken.append(Broken(name, f"plugin {name}: {type(e).__name__}: {e}"))
    return tuple(found[id_] for id_ in sorted(found)), tuple(broken)


def _info(spec: DetectorSpec, plugin: str) -> DetectorInfo:
    inputs = tuple(InputInfo(i.name, i.channel, i.type.__name__, i.required) for i in inputs_of(spec, spec.config()))
    extra, origin = extra_of(spec), distribution_of(plugin)
    return DetectorInfo(spec.id, spec.summary, tuple(spec.kinds), inputs, spec.isolation, extra, plugin, origin)


def distribution_of(plugin: str) -> str:
    """Name and version of the distribution that a plugin comes from."""
    points = [e for e in md.entry_points(group=GROUP, name=plugin) if e.dist is not None]
    return ", ".join(sorted({f"{e.dist.name} {e.dist.version}" for e in points if e.dist is not None}))


def extra_of(spec: DetectorSpec) -> Extra:
    """Whether the packages that a detector needs are installed, and else the command that installs them."""
    if not spec.extra:
        return Extra("", True)
    try:
        own = md.metadata("foreshock").get_all("Provides-Extra") or []
        needs = _requirements(spec.extra) if spec.extra in own else (spec.extra,)
    except md.PackageNotFoundError:
        own, needs = [], (spec.extra,)
    missing = tuple(need for need in needs if not _is_installed(need))
    what = f"foreshock[{spec.extra}]" if spec.extra in own else spec.extra
    return Extra(spec.extra, not missing, missing, f"pip install '{what}'" if missing else "")


def _requirements(extra: str) -> tuple[str, ...]:
    """Distributions that an extra of foreshock asks for, without their versions."""
    marker = re.compile(rf"""extra\s*==\s*['"]{re.escape(extra)}['"]""")
    lines = [line for line in md.requires("foreshock") or [] if marker.search(line)]
    return tuple(m.group() for line in lines if (m := re.match(r"[A-Za-z0-9._-]+", line)))


def _is_installed(distribution: str) -> bool:
    try:
        md.version(distribution)
    except md.PackageNotFoundError:
        return False
    return True
