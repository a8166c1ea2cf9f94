"""Finds plugins by entry point and loads only those that the configuration names.

The name of an entry point of group ``foreshock`` is the id of the detector, policy or twin behind it; its value is the
module with the hook implementations.
"""

from __future__ import annotations

import importlib.metadata as md
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from types import ModuleType
from typing import Any

import msgspec
import pluggy

from foreshock import hookspecs
from foreshock.detector import DetectorSpec
from foreshock.errors import ConfigError, ForeshockError, PluginError, nearest
from foreshock.hookspecs import GROUP
from foreshock.policy import PolicySpec
from foreshock.taxonomy import PrecursorKind
from foreshock.twin import TwinSpec

__all__ = ["Broken", "Registry"]


class Broken(msgspec.Struct, frozen=True):
    """A plugin that could not be loaded, or one of whose files could not, and why."""

    name: str
    reason: str


class Registry:
    """The plugins of this environment.

    Args:
        modules: further plugin modules by name, beside the installed ones; for tests and embedding.
    """

    def __init__(self, modules: Mapping[str, Any] | None = None) -> None:
        self._manager = pluggy.PluginManager(GROUP)
        self._manager.add_hookspecs(hookspecs)
        self._points = {e.name: e for e in md.entry_points(group=GROUP)}
        self._extra = dict(modules or {})

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all installed plugins, loaded or not."""
        return tuple(sorted({*self._points, *self._extra}))

    def load(self, name: str, place: str = "plugins") -> None:
        """Import a plugin and check its hooks.

        Raises:
            ConfigError: nobody offers that name.
            PluginError: its import fails, or it implements a hook that does not exist.
        """
        if self._manager.has_plugin(name):
            return
        if name not in self.names:
            raise ConfigError(place, f"no plugin {name!r} is installed", nearest(name, self.names))
        try:
            module = self._extra[name] if name in self._extra else self._points[name].load()
        except (Exception, SystemExit) as e:  # a script without a main guard ends in sys.exit()
            raise PluginError(f"plugin {name}", f"import failed: {type(e).__name__}: {e}") from e
        if any(p is module for _, p in self._manager.list_name_plugin()):
            return
        self._refuse_unknown_hooks(name, module)
        try:
            self._manager.register(module, name)
            self._manager.check_pending()
        except pluggy.PluginValidationError as e:
            self._manager.unregister(name=name)
            raise PluginError(f"plugin {name}", str(e)) from e

    def load_all(self) -> tuple[Broken, ...]:
        """Import every plugin; those that cannot be loaded."""
        broken = []
        for name in self.names:
            try:
                self.load(name)
            except ForeshockError as e:
                broken.append(Broken(name, str(e)))
        return tuple(broken)

    def detector(self, id_: str, place: str) -> DetectorSpec:
        """The detector with this id, loading the plugin of that name."""
        spec: DetectorSpec = self._named(id_, place, "foreshock_detectors", DetectorSpec, "detector")
        return spec

    def policy(self, id_: str, place: str) -> PolicySpec:
        """The policy with this id, loading the plugin of that name."""
        spec: PolicySpec = self._named(id_, place, "foreshock_policies", PolicySpec, "policy")
        return spec

    def twin(self, id_: str, place: str) -> TwinSpec:
        """The kind of twin with this id, loading the plugin of that name."""
        spec: TwinSpec = self._named(id_, place, "foreshock_twins", TwinSpec, "kind of twin")
        return spec

    def detectors(self) -> tuple[DetectorSpec, ...]:
        """Detectors of the loaded plugins, by id."""
        return self._sorted("foreshock_detectors", DetectorSpec)

    def policies(self) -> tuple[PolicySpec, ...]:
        """Policies of the loaded plugins, by id."""
        return self._sorted("foreshock_policies", PolicySpec)

    def twins(self) -> tuple[TwinSpec, ...]:
        """Kinds of twin of the loaded plugins, by id."""
        return self._sorted("foreshock_twins", TwinSpec)

    def precursors(self) -> tuple[PrecursorKind, ...]:
        """Precursor kinds with which the loaded plugins extend the taxonomy, by id."""
        return self._sorted("foreshock_precursors", PrecursorKind)

    def scenarios(self) -> tuple[Path, ...]:
        """Scenario files of the loaded plugins, sorted."""
        return tuple(sorted(path for _, path in self._call("foreshock_scenarios", Path)))

    def scenario_files(self) -> tuple[tuple[tuple[str, Path], ...], tuple[Broken, ...]]:
        """Scenario files of the loaded plugins as (plugin, file), sorted; and the plugins whose hook fails.

        Unlike :meth:`scenarios`, a plugin that fails hides no other.
        """
        files: list[tuple[str, Path]] = []
        broken: list[Broken] = []
        for impl in self._manager.hook.foreshock_scenarios.get_hookimpls():
            try:
                files += [(impl.plugin_name, path) for path in _given(impl, "foreshock_scenarios", Path)]
            except PluginError as e:
                broken.append(Broken(impl.plugin_name, str(e)))
        return tuple(sorted(files)), tuple(sorted(broken, key=lambda b: b.name))

    def _call(self, hook: str, of: type) -> Iterable[tuple[str, Any]]:
        """What each plugin's implementation gives; called one by one, since pluggy stops at the first that raises."""
        for impl in getattr(self._manager.hook, hook).get_hookimpls():
            for item in _given(impl, hook, of):
                yield impl.plugin_name, item

    def _named(self, id_: str, place: str, hook: str, of: type, what: str) -> Any:
        """What has this id, from the plugin of that name: the only one that is loaded, unless there is no such thing.

        Raises:
            ConfigError: nobody offers it; the hint names others of its sort, not whatever is installed.
            PluginError: as load().
        """
        problem = f"no plugin {id_!r} is installed"
        if id_ in self.names:
            self.load(id_, place)
            found = {item.id: item for item in self._sorted(hook, of)}
            if id_ in found:
                return found[id_]
            problem = f"plugin {id_!r} offers no {what} {id_!r}"
        raise ConfigError(place, problem, nearest(id_, self._offered(hook, of)))

    def _offered(self, hook: str, of: type) -> set[str]:
        """Ids of all that the installed plugins offer; loads them apart, and passes over those that are broken."""
        everything = Registry(self._extra)
        everything.load_all()
        ids: set[str] = set()
        for impl in getattr(everything._manager.hook, hook).get_hookimpls():
            with suppress(PluginError):
                ids |= {item.id for item in _given(impl, hook, of)}
        return ids

    def _sorted(self, hook: str, of: type) -> tuple[Any, ...]:
        found: dict[str, tuple[str, Any]] = {}
        for plugin, item in self._call(hook, of):
            if item.id in found:
                raise PluginError(f"plugin {plugin}", f"{hook}: id {item.id!r} is taken by plugin {found[item.id][0]}")
            found[item.id] = (plugin, item)
        return tuple(found[id_][1] for id_ in sorted(found))

    def _refuse_unknown_hooks(self, name: str, module: ModuleType) -> None:
        known = {h for h in vars(hookspecs) if h.startswith("foreshock_")}
        for attr in vars(module):
            if attr.startswith("foreshock_") and attr not in known and callable(getattr(module, attr)):
                raise PluginError(f"plugin {name}", f"unknown hook {attr!r}", nearest(attr, known))
            if attr in known and not hasattr(getattr(module, attr), f"{GROUP}_impl"):
                raise PluginError(f"plugin {name}", f"hook {attr!r} lacks @hookimpl")


def _given(impl: Any, hook: str, of: type) -> tuple[Any, ...]:
    """What one plugin's implementation gives.

    Raises:
        PluginError: it raises, or gives something of another type.
    """
    try:
        given = tuple(impl.function())
    except Exception as e:
        raise PluginError(f"plugin {impl.plugin_name}", f"{hook} raised {type(e).__name__}: {e}") from e
    for item in given:
        if not isinstance(item, of):
            problem = f"{hook} gave a {type(item).__name__}, {of.__name__} is expected"
            raise PluginError(f"plugin {impl.plugin_name}", problem)
    return given
