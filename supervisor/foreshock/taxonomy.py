"""Accident modes, precursor classes and kinds as data, with their sources (Tables 1 to 3 and section 3.2.2).

Other modules know kinds only by their ids here; synonyms of one phenomenon are aliases of one kind.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping
from functools import cached_property, lru_cache
from importlib.resources import files
from pathlib import Path
from typing import Any

import msgspec

from foreshock._strict import convert, read_toml
from foreshock.errors import ConfigError, nearest

__all__ = ["AccidentMode", "Extension", "PrecursorClass", "PrecursorKind", "Taxonomy", "builtin_taxonomy"]


class PrecursorClass(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A functional group of precursors.

    Attributes:
        id: kebab-case id.
        title: the paper's words.
        share: its share of the 241 coded precursors, 0..1.
        modes: accident modes that it dominates (Table 2).
        examples: kinds that section 3.2.2 names for it.
        source: where this stands.
    """

    id: str
    title: str
    share: float
    modes: tuple[str, ...]
    examples: tuple[str, ...]
    source: str


class AccidentMode(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """An accident mode: code, id, title, n and percent of the 126 events (Table 1), ordered cascade (Table 3).

    hazard is what stands behind it in the words of ISO 12100 and the clauses of ISO 13482.
    """

    code: str
    id: str
    title: str
    n: int
    percent: float
    cascade: tuple[str, ...]
    hazard: str
    source: str


class PrecursorKind(msgspec.Struct, frozen=True, forbid_unknown_fields=True, rename={"class_": "class"}):
    """One phenomenon that announces accidents.

    Attributes:
        id: kebab-case id.
        title: for people.
        class_: id of its class.
        source: where it is named or defined.
        modes: accident modes beyond those that Tables 2 and 3 give.
        aliases: other names of the same phenomenon.
    """

    id: str
    title: str
    class_: str
    source: str
    modes: tuple[str, ...] = ()
    aliases: tuple[str, ...] = ()


class Extension(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A TOML file with further precursor kinds."""

    kinds: tuple[PrecursorKind, ...]


class Taxonomy(msgspec.Struct, frozen=True, forbid_unknown_fields=True, dict=True):
    """All classes, modes and kinds; validated by :meth:`check`."""

    version: int
    source: str
    classes: tuple[PrecursorClass, ...]
    modes: tuple[AccidentMode, ...]
    kinds: tuple[PrecursorKind, ...]

    @cached_property
    def _names(self) -> Mapping[str, PrecursorKind]:
        return {name: kind for kind in self.kinds for name in (kind.id, *kind.aliases)}

    @cached_property
    def _classes(self) -> Mapping[str, PrecursorClass]:
        return {c.id: c for c in self.classes}

    @cached_property
    def _modes_of(self) -> Mapping[str, tuple[str, ...]]:
        out = {}
        for kind in self.kinds:
            tied = {*kind.modes, *self._classes[kind.class_].modes}
            tied |= {mode.code for mode in self.modes if kind.id in mode.cascade}
            out[kind.id] = tuple(mode.code for mode in self.modes if mode.code in tied)
        return out

    @cached_property
    def codes(self) -> tuple[str, ...]:
        """Codes of all accident modes, in the paper's order."""
        return tuple(mode.code for mode in self.modes)

    def kind(self, name: str, place: str = "taxonomy") -> PrecursorKind:
        """The kind with this id or alias.

        Raises:
            ConfigError: no such kind; place says who asked.
        """
        try:
            return self._names[name]
        except KeyError:
            raise ConfigError(place, f"unknown precursor kind {name!r}", nearest(name, self._names)) from None

    def mode(self, code: str, place: str = "taxonomy") -> AccidentMode:
        """The accident mode with this code or id.

        Raises:
            ConfigError: no such mode.
        """
        for mode in self.modes:
            if code in (mode.code, mode.id):
                return mode
        raise ConfigError(place, f"unknown accident mode {code!r}", nearest(code, self.codes))

    def modes_of(self, kind: str) -> tuple[str, ...]:
        """Codes of the modes that a kind is tied to: by its class (Table 2), a cascade (Table 3), or by itself."""
        return self._modes_of[kind]

    def kinds_of(self, mode: str) -> frozenset[str]:
        """Ids of the kinds that are tied to a mode."""
        return frozenset(kind for kind, modes in self._modes_of.items() if mode in modes)

    def class_of(self, kind: str) -> str:
        """Id of the class of a kind."""
        return self._names[kind].class_

    def extended(self, kinds: Iterable[PrecursorKind], place: str = "plugin") -> Taxonomy:
        """This taxonomy with more kinds, checked. A kind that is already there, field for field, is not added twice."""
        new = tuple(k for k in kinds if k not in self.kinds)
        return msgspec.structs.replace(self, kinds=self.kinds + new).check(place) if new else self

    def extended_from(self, path: Path) -> Taxonomy:
        """This taxonomy with the ``[[kinds]]`` of a TOML file.

        Raises:
            ConfigError: the file is missing, is not TOML, or its kinds do not fit.
        """
        extension = convert(read_toml(path), Extension, str(path))
        return self.extended(extension.kinds, str(path))

    def check(self, place: str) -> Taxonomy:
        """This taxonomy, if every reference in it resolves and no name is used twice.

        Raises:
            ConfigError: names the first thing that does not hold.
        """
        codes, classes = set(self.codes), set(self._classes)
        seen: dict[str, str] = {}
        for kind in self.kinds:
            for name in (kind.id, *kind.aliases):
                if name in seen:
                    raise ConfigError(place, f"kinds {seen[name]!r} and {kind.id!r} share the name {name!r}")
                seen[name] = kind.id
            if kind.class_ not in classes:
                unknown = f"unknown class {kind.class_!r}"
                raise ConfigError(f"{place}: {kind.id}", unknown, nearest(kind.class_, classes))
        for owner, refs, known in (
            *((k.id, k.modes, codes) for k in self.kinds),
            *((c.id, c.modes, codes) for c in self.classes),
            *((c.id, c.examples, set(seen)) for c in self.classes),
            *((m.code, m.cascade, set(seen)) for m in self.modes),
        ):
            for ref in refs:
                if ref not in known:
                    raise ConfigError(f"{place}: {owner}", f"unknown name {ref!r}", nearest(ref, known))
        return self


@lru_cache(maxsize=1)
def builtin_taxonomy() -> Taxonomy:
    """The paper's taxonomy."""
    data: dict[str, Any] = tomllib.loads(files("foreshock").joinpath("data/taxonomy.toml").read_text())
    return msgspec.convert(data, Taxonomy).check("taxonomy.toml")
