"""What a result depends on beside its parameters: files of the twin, code and plugins, as hashes of content."""

from __future__ import annotations

import hashlib
import importlib.metadata as md
import importlib.util
import re
from collections.abc import Iterable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import msgspec

from foreshock._strict import convert
from foreshock.hookspecs import GROUP
from foreshock.registry import Registry
from foreshock.session.isolated import placed
from foreshock.session.scenario import Scenario

__all__ = ["beside", "changes", "digest", "named_files", "twin_files", "versions"]

ASIDE = frozenset({"calibration", "campaign", "cli", "events", "live", "report", "sensitivity"})
"""Parts of the core that no stepped run passes through."""


_FILE = re.compile(r"[^\0\n]{1,240}\.\w{1,8}")
"""What may be the name of a file."""


def digest(value: Any) -> str:
    """SHA-256 of a value's canonical JSON, 16 hexadecimal digits."""
    return hashlib.sha256(msgspec.json.encode(value, order="sorted")).hexdigest()[:16]


@cache
def _file_digest(path: Path, size: int, mtime_ns: int) -> str:  # noqa: ARG001 # a file that changes is read again
    return hashlib.sha256(path.read_bytes()).hexdigest()[:16]


def _of_file(path: Path) -> str:
    if path.is_dir():
        return digest({str(p.relative_to(path)): _of_file(p) for p in sorted(path.rglob("*")) if p.is_file()})
    stat = path.stat()
    return _file_digest(path.resolve(), stat.st_size, stat.st_mtime_ns)


def twin_files(scenario: Scenario, registry: Registry) -> dict[str, str]:
    """Hashes of the files that a scenario's twin consists of, by role; empty if its kind cannot say.

    Raises:
        BadInputError: the twin's configuration is wrong, or a file is missing.
    """
    place = f"{scenario.id}: twin"
    spec = registry.twin(scenario.twin["kind"], f"{place}.kind")
    if spec.files is None:
        return {}
    table = placed({k: v for k, v in scenario.twin.items() if k != "kind"}, Path(scenario.folder))
    return {role: _of_file(path) for role, path in sorted(spec.files(convert(table, spec.config, place)).items())}


def named_files(config: Any, folder: Path) -> dict[str, str]:
    """Hashes of the files that a configuration names, such as parameters of the risk model or a URDF, by what it says.

    Args:
        config: tables, arrays and values.
        folder: that relative paths start from.
    """
    if isinstance(config, Mapping):
        config = tuple(config.values())
    if isinstance(config, (list, tuple)):
        return {name: found for part in config for name, found in named_files(part, folder).items()}
    if not isinstance(config, str) or not _FILE.fullmatch(config):
        return {}
    return {config: _of_file(folder / config)} if (folder / config).is_file() else {}


def beside(config: Any, folder: Path) -> Any:
    """A configuration with the files that it names, relative to a folder, by their paths.

    A name is that of a file if there is one, or if it ends as parameters, a taxonomy or a model of a robot do.
    """
    if isinstance(config, Mapping):
        return {key: beside(part, folder) for key, part in config.items()}
    if isinstance(config, (list, tuple)):
        return [beside(part, folder) for part in config]
    if not isinstance(config, str) or not _FILE.fullmatch(config):
        return config
    return (
        str(folder / config) if config.endswith((".toml", ".urdf", ".srdf")) or (folder / config).is_file() else config
    )


def versions(plugins: Iterable[str]) -> dict[str, str]:
    """Version and content hash of the core and of the packages behind these plugins, by distribution and package."""
    modules = {e.name: (e.value.partition(":")[0], e.dist) for e in md.entry_points(group=GROUP)}
    found = {"foreshock": f"{_version('foreshock')} {_package('foreshock', ASIDE)}"}
    for name in sorted(set(plugins)):
        if name in modules:  # others are given by hand, in tests
            module, dist = modules[name]
            package = module.partition(".")[0]
            found[package] = f"{dist.version if dist else ''} {_package(package)}"
    return found


def _version(distribution: str) -> str:
    try:
        return md.version(distribution)
    except md.PackageNotFoundError:
        return ""


@cache
def _package(name: str, aside: frozenset[str] = frozenset()) -> str:
    """Hash of all that a package holds but for byte code."""
    spec = importlib.util.find_spec(name)
    if spec is None or spec.origin is None:
        return ""
    origin = Path(spec.origin)
    if not spec.submodule_search_locations:
        return _of_file(origin)
    root = origin.parent
    parts = {}
    for path in sorted(root.rglob("*")):
        inner = path.relative_to(root)
        if path.is_file() and "__pycache__" not in inner.parts and inner.parts[0] not in aside:
            parts[str(inner)] = _of_file(path)
    return digest(parts)


def changes(before: Mapping[str, Any], now: Mapping[str, Any], path: str = "") -> list[str]:
    """What differs between two trees, one line for each leaf."""
    found = []
    for key in sorted({*before, *now}):
        place = f"{path}.{key}" if path else key
        if key not in before:
            found.append(f"{place} is new")
        elif key not in now:
            found.append(f"{place} is gone")
        elif isinstance(before[key], Mapping) and isinstance(now[key], Mapping):
            found += changes(before[key], now[key], place)
        elif before[key] != now[key]:
            old, new = _by_name(before[key]), _by_name(now[key])
            if old and new:
                found += changes(old, new, place) or [f"{place} are in another order"]
            else:
                found.append(f"{place} was {before[key]}, is {now[key]}")
    return found


def _by_name(value: Any) -> dict[str, Any]:
    """A list of tables by their names, else by their numbers; empty if it is no such list, or a name is there twice."""
    if not isinstance(value, list) or not all(isinstance(v, Mapping) for v in value):
        return {}
    names = [next((str(v[k]) for k in ("id", "parameter", "use") if k in v), str(n)) for n, v in enumerate(value)]
    return dict(zip(names, value, strict=True)) if len({*names}) == len(names) else {}
