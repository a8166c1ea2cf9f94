"""Strict reading of TOML: every key is asked for once, and what nobody asked for is an error with the nearest name."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NoReturn

from foreshock.errors import ConfigError, nearest

__all__ = ["TomlTable"]

_TYPE_NAMES = {str: "a string", float: "a number", list: "a list", dict: "a table"}


class TomlTable:
    """One table of a TOML file; it knows its place, so that errors can name it.

    Args:
        data: the table.
        file: the file's name, for errors.
        key: key path of the table inside the file, ``""`` for the top.
    """

    def __init__(self, data: dict[str, Any], file: str, key: str = "") -> None:
        self._data, self._file, self.key = data, file, key
        self._asked: set[str] = set()
        self._known: set[str] = set()

    @classmethod
    def read(cls, path: Path) -> TomlTable:
        """The top table of a file.

        Raises:
            ConfigError: there is no such file, or it is not TOML.
        """
        try:
            return cls(tomllib.loads(path.read_text(encoding="utf-8")), str(path))
        except OSError as error:
            siblings = [p.name for p in path.parent.glob("*.toml")] if path.parent.is_dir() else []
            raise ConfigError(str(path), f"cannot be read ({error.strerror})", nearest(path.name, siblings)) from None
        except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
            raise ConfigError(str(path), f"is not TOML: {error}") from None

    def place(self, name: str = "") -> str:
        """Where a key of this table stands: ``file: path.to.key``."""
        return f"{self._file}: {'.'.join(k for k in (self.key, name) if k)}"

    def fail(self, name: str, problem: str, hint: str = "") -> NoReturn:
        """Raise a ConfigError at a key of this table."""
        raise ConfigError(self.place(name), problem, hint)

    def has(self, name: str) -> bool:
        """Whether the key is there."""
        self._known.add(name)
        return name in self._data

    def names(self) -> tuple[str, ...]:
        """All keys, in the order of the file."""
        return tuple(self._data)

    def raw(self, name: str) -> Any:
        """The value of a key as TOML gives it; None if it is missing."""
        self._asked.add(name)
        return self._data.get(name)

    def text(self, name: str, default: str | None = None) -> str:
        """A string; required if it has no default."""
        return str(self._typed(name, str, default))

    def number(self, name: str, default: float | None = None) -> float:
        """A finite number; required if it has no default."""
        return self.finite(name, self._typed(name, float, default))

    def optional_number(self, name: str) -> float | None:
        """A finite number, None if the key is missing."""
        return self.number(name) if self.has(name) else None

    def table(self, name: str, required: bool = False) -> TomlTable:
        """A sub-table; an empty one if it is missing and not required."""
        value = self._typed(name, dict, None if required else {})
        return TomlTable(value, self._file, f"{self.key}.{name}" if self.key else name)

    def tables(self, name: str) -> Sequence[TomlTable]:
        """An array of tables; empty if it is missing."""
        value = self._typed(name, list, [])
        path = f"{self.key}.{name}" if self.key else name
        for i, item in enumerate(value):
            if not isinstance(item, dict):
                raise ConfigError(f"{self._file}: {path}[{i}]", f"is {item!r}", "; expected a table")
        return [TomlTable(item, self._file, f"{path}[{i}]") for i, item in enumerate(value)]

    def finite(self, name: str, value: object) -> float:
        """The value as a float.

        Raises:
            ConfigError: it is not a number, or not finite.
        """
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            self.fail(name, f"is {value!r}", "; expected a finite number")
        return float(value)

    def done(self) -> None:
        """Refuse every key that was not asked for."""
        for name in self._data:
            if name not in self._asked:
                self.fail(name, "is not a known key", nearest(name, self._asked | self._known))

    def _typed(self, name: str, kind: type, default: Any) -> Any:
        self._asked.add(name)
        if name not in self._data:
            if default is None:
                self.fail(name, "is missing", nearest(name, set(self._data) - self._asked))
            return default
        value = self._data[name]
        if isinstance(value, bool) or not isinstance(value, int | float if kind is float else kind):
            self.fail(name, f"is {value!r}", f"; expected {_TYPE_NAMES[kind]}")
        return value
