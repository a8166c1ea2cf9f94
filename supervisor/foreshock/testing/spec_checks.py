"""What can be checked of a detector without data: its declaration, its settings, and that it can be built."""

from __future__ import annotations

import math
import pickle
import re
from collections.abc import Callable, Iterable, Sequence
from typing import Any, get_args

import msgspec

from foreshock._strict import convert
from foreshock.config import config_schema
from foreshock.detector import DetectorSpec, Input
from foreshock.errors import ForeshockError, nearest
from foreshock.messages import AnyMessage
from foreshock.supervisor import build_detector, inputs_of
from foreshock.taxonomy import PrecursorKind, Taxonomy, builtin_taxonomy

__all__ = ["KEBAB", "Check", "spec_checks"]

KEBAB = re.compile(r"[a-z][a-z0-9]*(-[a-z0-9]+)*")
"""An id: lower-case words joined by hyphens."""
CHANNEL = re.compile(r"[a-z0-9][a-z0-9_-]*(/[a-z0-9][a-z0-9_-]*)+")
"""``<subject>/<quantity>`` below the robot's name."""


class Check(msgspec.Struct, frozen=True):
    """One thing that was checked.

    Attributes:
        name: what must hold.
        problem: what does not; empty if it holds.
    """

    name: str
    problem: str = ""

    @property
    def ok(self) -> bool:
        """Whether it holds."""
        return not self.problem


def spec_checks(
    spec: DetectorSpec, precursors: Iterable[PrecursorKind] = (), config: msgspec.Struct | None = None
) -> tuple[Check, ...]:
    """Every static check of a detector, in the order in which an author wants to hear of them.

    Args:
        spec: what the detector declares.
        precursors: kinds that its plugin adds to the taxonomy.
        config: settings that its inputs depend on; the defaults if not given.
    """
    added = tuple(precursors)
    steps: Sequence[tuple[str, Callable[[], str]]] = (
        ("id is kebab-case", lambda: _kebab("id", (spec.id,))),
        ("own kinds fit the taxonomy", lambda: _precursors(added)),
        ("kinds are known to the taxonomy", lambda: _kinds(spec, added)),
        ("settings are a frozen Struct with defaults that refuses unknown keys", lambda: _config(spec)),
        ("inputs name channels and messages", lambda: _inputs(spec, config)),
        ("times are sensible", lambda: _times(spec)),
        ("has a summary of one line", lambda: _summary(spec)),
        ("build can be found by a child process", lambda: _picklable(spec)),
        ("builds, resets and updates", lambda: _builds(spec, config)),
    )
    return tuple(Check(name, _said(step)) for name, step in steps)


def _said(step: Callable[[], str]) -> str:
    """The problem that a step finds; an author's code runs in some steps and may raise anything."""
    try:
        return step()
    except ForeshockError as e:
        return str(e)
    except Exception as e:  # noqa: BLE001 # an author's mistake becomes a failed check, whatever it raises
        return f"{type(e).__name__}: {e}"


def _kebab(what: str, names: Iterable[str]) -> str:
    for name in names:
        if not KEBAB.fullmatch(name):
            meant = re.sub(r"[^a-z0-9]+", "-", re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "-", name).lower()).strip("-")
            hint = f"; try {meant!r}" if KEBAB.fullmatch(meant) else ""
            return f"{what} {name!r} is not lower-case words joined by hyphens{hint}"
    return ""


def _taxonomy(added: Sequence[PrecursorKind]) -> Taxonomy:
    return builtin_taxonomy().extended(added)


def _precursors(added: Sequence[PrecursorKind]) -> str:
    _taxonomy(added)
    for kind in added:
        if not (kind.title and kind.source):
            return f"kind {kind.id!r} needs a title and a source"
    return _kebab("kind", (name for kind in added for name in (kind.id, *kind.aliases)))


def _kinds(spec: DetectorSpec, added: Sequence[PrecursorKind]) -> str:
    if isinstance(spec.kinds, str) or not spec.kinds:
        return f"kinds is {spec.kinds!r}, a tuple of at least one taxonomy id is expected"
    try:
        taxonomy = _taxonomy(added)
    except ForeshockError:
        taxonomy = builtin_taxonomy()
    seen: dict[str, str] = {}
    for name in spec.kinds:
        id_ = taxonomy.kind(name, f"kinds of detector {spec.id!r}").id
        if id_ in seen:
            return f"{seen[id_]!r} and {name!r} are one kind, {id_!r}"
        seen[id_] = name
    unused = [k.id for k in added if k.id not in seen and not seen.keys() & {*k.aliases}]
    if unused and len(unused) == len(added):
        return f"the plugin adds {', '.join(unused)} to the taxonomy, but the detector reports none of them"
    return _kebab("kind", spec.kinds)


def _config(spec: DetectorSpec) -> str:
    kind = spec.config
    if not (isinstance(kind, type) and issubclass(kind, msgspec.Struct)):
        return f"config is {kind!r}, a msgspec.Struct class is expected"
    flags = kind.__struct_config__
    missing = [word for word in ("frozen", "forbid_unknown_fields") if not getattr(flags, word)]
    if missing:
        return f"class {kind.__name__}(msgspec.Struct, ...) lacks " + " and ".join(f"{m}=True" for m in missing)
    bare = [f.name for f in msgspec.structs.fields(kind) if f.required]
    if bare:
        return f"{kind.__name__}.{bare[0]} has no default, so that `use = {spec.id!r}` alone does not work"
    default: Any = kind()
    back = convert(msgspec.to_builtins(default), kind, f"{spec.id}.config")
    if back != default:
        return f"the defaults change when they are read back from TOML: {back!r}"
    config_schema((spec,))
    return ""


def _inputs(spec: DetectorSpec, config: msgspec.Struct | None) -> str:
    inputs = inputs_of(spec, spec.config() if config is None else config)
    if not inputs:
        return "it reads nothing"
    names: set[str] = set()
    for i in inputs:
        if not isinstance(i, Input):
            return f"inputs holds a {type(i).__name__}, Input is expected"
        problem = _input(i)
        if problem:
            return f"input {i.name!r}: {problem}"
        if i.name in names:
            return f"two inputs are called {i.name!r}"
        names.add(i.name)
    return ""


def _input(i: Input) -> str:
    if i.channel != "*" and not CHANNEL.fullmatch(i.channel):
        return f"channel {i.channel!r} is not <subject>/<quantity> in lower case, without the robot's name"
    known = {t.__name__: t for t in get_args(AnyMessage)}
    if i.channel != "*" and i.type not in known.values():
        name = getattr(i.type, "__name__", repr(i.type))
        return f"type {name} is not a message that a sample can carry{nearest(name, known)}"
    if not (math.isfinite(i.max_age_s) and i.max_age_s > 0.0):
        return f"max_age_s is {i.max_age_s}, a positive time is expected"
    if not (math.isfinite(i.max_standstill_s) and i.max_standstill_s >= 0.0):
        return f"max_standstill_s is {i.max_standstill_s}, zero or a positive time is expected"
    if i.channel == "*" and i.max_standstill_s:
        return f"max_standstill_s is {i.max_standstill_s}, but a reader of every channel cannot tell which stands still"
    if not (math.isfinite(i.min_rate_hz) and i.min_rate_hz >= 0.0):
        return f"min_rate_hz is {i.min_rate_hz}, zero or a positive rate is expected"
    return ""


def _times(spec: DetectorSpec) -> str:
    for name, least in (("period_s", "not negative"), ("deadline_s", "positive"), ("warm_up_s", "not negative")):
        value = getattr(spec, name)
        if not (math.isfinite(value) and (value > 0.0 or (value == 0.0 and least == "not negative"))):
            return f"{name} is {value}, it must be finite and {least}"
    if 0.0 < spec.period_s < spec.deadline_s:
        return f"deadline_s {spec.deadline_s:g} is longer than period_s {spec.period_s:g}: it could never keep up"
    return ""


def _summary(spec: DetectorSpec) -> str:
    if not spec.summary.strip():
        return "summary is empty; `foreshock detectors list` shows it"
    return "" if len(spec.summary.splitlines()) == 1 else f"summary has several lines: {spec.summary!r}"


def _picklable(spec: DetectorSpec) -> str:
    try:
        pickle.dumps(spec.build)
    except Exception as e:  # noqa: BLE001 # pickle raises whatever the object's own code raises
        return f"build must be a function or class at the top of an importable module: {e}"
    return ""


def _builds(spec: DetectorSpec, config: msgspec.Struct | None) -> str:
    detector = build_detector(spec, spec.config() if config is None else config, f"detector {spec.id}")
    for method in ("reset", "update"):
        if not callable(getattr(detector, method, None)):
            return f"build gave a {type(detector).__name__} without {method}()"
    detector.reset(0)
    return ""
