"""Strict reading of TOML into Structs: an unknown key or a wrong type is one error with place, value, nearest name."""

from __future__ import annotations

import math
import tomllib
import types
import typing
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from foreshock.errors import ConfigError, nearest

__all__ = ["convert", "read_toml", "within"]

T = TypeVar("T")


def within(place: str, value: float, least: float, most: float = math.inf, *, above: bool = False) -> None:
    """Refuse a number outside [least, most]; above excludes least. Neither NaN nor an infinity is ever within.

    Raises:
        ConfigError: names place, value and range.
    """
    if not (math.isfinite(value) and least <= value <= most and not (above and value == least)):
        floor = f"above {least:g}" if above else f"at least {least:g}"
        ceiling = f" and at most {most:g}" if most < math.inf else ""
        raise ConfigError(place, f"{value!r} is not a finite number {floor}{ceiling}")


def read_toml(path: Path) -> dict[str, Any]:
    """The tables of a TOML file.

    Raises:
        ConfigError: it cannot be read, or is not TOML (with line and column).
    """
    try:
        return tomllib.loads(path.read_text())
    except OSError as e:
        siblings = [p.name for p in path.parent.glob("*.toml")] if path.parent.is_dir() else []
        raise ConfigError(str(path), e.strerror or str(e), nearest(path.name, siblings)) from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as e:
        raise ConfigError(str(path), f"not TOML: {e}") from None


def convert(data: object, to: type[T], place: str) -> T:
    """Data as a Struct.

    Raises:
        ConfigError: names place and key path of the first thing that does not fit.
    """
    _refuse_unknown(data, to, place)
    try:
        return msgspec.convert(data, to)
    except ConfigError as e:
        raise ConfigError(f"{place}: {e.place}", e.problem, e.hint) from None
    except msgspec.ValidationError as e:
        problem, _, path = str(e).partition(" - at ")
        keys = path.strip("`").removeprefix("$").removeprefix(".")
        raise ConfigError(f"{place}: {keys}" if keys else place, problem, _offending(data, keys)) from None


def _offending(data: object, keys: str) -> str:
    """The value at a key path, for the message."""
    for key in keys.replace("[", ".[").split("."):
        if key.startswith("[") and key[1:-1].isdigit() and isinstance(data, list):
            data = data[int(key[1:-1])]
        elif isinstance(data, Mapping) and key in data:
            data = data[key]
        else:
            return ""
    return f", got {data!r}"


def _refuse_unknown(data: object, to: Any, place: str) -> None:
    origin = typing.get_origin(to)
    if origin in (typing.Union, types.UnionType):
        options = [t for t in typing.get_args(to) if t is not type(None)]
        if len(options) == 1:
            _refuse_unknown(data, options[0], place)
        elif isinstance(data, Mapping) and all(getattr(t, "__struct_config__", None) for t in options):
            _refuse_unknown(data, _tagged(data, options, place), place)
    elif origin is typing.Literal:
        known = [a for a in typing.get_args(to) if isinstance(a, str)]
        if isinstance(data, str) and data not in known:
            raise ConfigError(place, f"{data!r} is not one of {', '.join(map(repr, known))}", nearest(data, known))
    elif isinstance(data, list) and origin in (tuple, list):
        for k, item in enumerate(data):
            _refuse_unknown(item, typing.get_args(to)[0], f"{place}[{k}]")
    elif isinstance(data, Mapping) and isinstance(origin, type) and issubclass(origin, Mapping):
        for key, item in data.items():
            _refuse_unknown(item, typing.get_args(to)[1], f"{place}.{key}")
    elif isinstance(data, Mapping) and isinstance(to, type) and issubclass(to, msgspec.Struct):
        hints = typing.get_type_hints(to)
        tag = to.__struct_config__.tag_field
        names = dict(zip(to.__struct_encode_fields__, to.__struct_fields__, strict=True))
        joint = "." if ":" in place else ": "
        for key, item in data.items():
            if key == tag:
                continue
            if key not in names:
                raise ConfigError(f"{place}{joint}{key}", "unknown key", nearest(key, names))
            _refuse_unknown(item, hints[names[key]], f"{place}{joint}{key}")


def _tagged(data: Mapping[Any, Any], options: list[Any], place: str) -> Any:
    """Which of several Structs a table is, by the key that tells them apart."""
    field = options[0].__struct_config__.tag_field
    known = {t.__struct_config__.tag: t for t in options}
    where = f"{place}{'.' if ':' in place else ': '}{field}"
    if field not in data:
        raise ConfigError(where, f"missing; expected one of {', '.join(map(repr, known))}")
    tag = data[field]
    if not isinstance(tag, str) or tag not in known:
        raise ConfigError(where, f"{tag!r} is not one of {', '.join(map(repr, known))}", nearest(str(tag), known))
    return known[tag]
